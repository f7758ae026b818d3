"""Files that take time to make, and go to the browser when they are ready."""

import threading
from collections.abc import Callable, Sequence
from functools import partial

import imageio.v3 as iio

from finlab.allocation.allocator import Allocator
from finlab.deploy.bundle import make_bundle
from finlab.errors import FinlabError
from finlab.sim.log_csv import csv_of
from webapp.session.companions import archive_of
from webapp.session.files import file_stem
from webapp.tasks.context import Context
from webapp.tasks.recorded import Recorded

PICTURE_SIZE = (1080, 1620)
"""Height and width of an exported picture [px]."""


class Exports:
    """Makes files beside the event loop and sends them to one browser."""

    def __init__(self, context: Context) -> None:
        """Send what the page's session holds to its browser."""
        self._context, self._session = context, context.session
        self._picturing = False

    def bundle(self) -> None:
        """Send the bundle for the robot: the same bytes as `finlab export --zip`.

        What was tried out with K and T on the page does not go to the robot.
        """
        self._send_made(".zip", lambda *robot: make_bundle(*robot).zip_bytes())

    def _send_made(self, suffix: str, make: Callable[[Allocator, tuple[str, ...]], bytes]) -> None:
        """Send what is made of the robot and its allocator, as that is shipped."""
        state, shipped = self._session.state, self._context.solver.shipped
        name = f"{file_stem(state.layout.name)}{suffix}"
        self._send(name, lambda: make(shipped(state.layout, state.method), state.failed))

    def swim(self, records: Sequence[Recorded]) -> None:
        """Send the logs of robots that swim as CSV; an archive of them where there are several."""
        names = [file_stem(f"{r.layout.name}_{r.method}_{r.about}") for r in records]
        if len(records) == 1:
            self._send(f"{names[0]}.csv", lambda: csv_of(records[0].log).encode())
            return

        def archive() -> bytes:
            (first, content), *others = (
                (f"{name}.csv", csv_of(r.log).encode()) for name, r in zip(names, records, strict=True)
            )
            return archive_of(first, content, dict(others))

        self._send(f"{names[0]}_csv.zip", archive)

    def picture(self) -> None:
        """Send a picture of the 3D view; the page has to make it, so not on the event loop."""
        if self._picturing:
            raise FinlabError("a picture is being made; wait for it")
        self._picturing = True
        name = f"{file_stem(self._session.state.layout.name)}.png"
        threading.Thread(target=self._take_picture, args=(name,), daemon=True).start()

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

    def _take_picture(self, name: str) -> None:
        client, loop = self._context.client, self._context.loop
        try:
            picture = client.get_render(*PICTURE_SIZE, transport_format="png", timeout=30.0)
        except Exception as error:  # it would be lost on this thread
            loop.post(partial(self._context.notify, "No picture", str(error) or type(error).__name__))
            return
        finally:
            self._picturing = False
        content = iio.imwrite("<bytes>", picture, extension=".png")
        loop.post(partial(self.download, name, content))
