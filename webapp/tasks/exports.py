"""Files that take time to make, and go to the browser when they are ready."""

from collections.abc import Callable
from functools import partial

from finlab.deploy.bundle import make_bundle
from webapp.session.files import file_stem
from webapp.tasks.context import Context
from webapp.tasks.swimming import Swimming


class Exports:
    """Makes files beside the event loop and sends them to one browser."""

    def __init__(self, context: Context) -> None:
        """Send what the page's session holds to its browser."""
        self._context, self._session = context, context.session

    def bundle(self) -> None:
        """Send the bundle for the robot: the same bytes as `finlab export --zip`.

        What was tried out with K and T on the page does not go to the robot.
        """
        state, shipped = self._session.state, self._context.solver.shipped
        self._send(
            f"{file_stem(state.layout.name)}.zip",
            lambda: make_bundle(shipped(state.layout, state.method), state.failed).zip_bytes(),
        )

    def swim(self, swimming: Swimming) -> None:
        """Send the log of the robot that swims as NPZ."""
        log = swimming.log()
        swimmer = swimming.swimmer
        assert swimmer is not None
        name = file_stem(f"{swimmer.layout.name}_{swimmer.method}_{swimmer.about}")
        self._send(f"{name}.npz", log.npz)

    def _send(self, name: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file, and send it; of each name only the newest that is asked for."""
        loop, notify = self._context.loop, self._context.notify
        self._context.workers.answers.submit(
            (id(self), name),
            lambda: loop.post(partial(self.download, name, make())),
            lambda text: loop.post(partial(notify, "Not exported", text)),
        )

    def download(self, name: str, content: bytes) -> None:
        """Send a file that is there already."""
        self._context.client.send_file_download(name, content, save_immediately=True)
