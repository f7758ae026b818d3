"""Files that take time to make, and go to the browser when they are ready."""

import threading
from collections.abc import Callable
from functools import partial

import imageio.v3 as iio
import viser

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.layout_files import bundle_bytes, file_stem, graph_bytes
from webapp.tasks.recording import recorded_html
from webapp.tasks.solver import Solver
from webapp.tasks.worker import Worker

PICTURE_SIZE = (1080, 1620)
"""Height and width of an exported picture [px]."""


class Exports:
    """Makes files beside the event loop and sends them to one browser."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        worker: Worker,
        post: Callable[[Callable[[], object]], None],
        failed: Callable[[str, str], None],
    ) -> None:
        """Prepare.

        Args:
            client: the browser.
            session: what is exported.
            solver: whose networks go into files.
            worker: on whose thread files are made.
            post: brings a call to the event loop.
            failed: called there with a title and a sentence when there is no file.
        """
        self._client, self._session, self._solver = client, session, solver
        self._worker, self._post, self._failed = worker, post, failed

    def graph(self) -> None:
        """Send the layout graph file."""
        state, loaded = self._session.state, self._solver.loaded
        self._send(".graph.json", lambda: graph_bytes(state.layout, state.failed, loaded(state.method)))

    def bundle(self) -> None:
        """Send the bundle for the robot: the same bytes as `finlab export --zip`.

        What was tried out with K and T on the page does not go to the robot.
        """
        state, loaded = self._session.state, self._solver.loaded
        self._send(".zip", lambda: bundle_bytes(state.layout, state.failed, loaded(state.method)))

    def html(self, shown: Allocation | None) -> None:
        """Send a standalone page of the 3D view with an answer.

        Raises:
            FinlabError: there is no answer yet.
        """
        if shown is None:
            raise FinlabError("there is no answer yet; wait for one")
        twin = self._session.twin()
        self._send(".html", lambda: recorded_html(twin, shown))

    def picture(self) -> None:
        """Send a picture of the 3D view; the page has to make it, so not on the event loop."""
        name = f"{file_stem(self._session.state.layout.name)}.png"
        threading.Thread(target=self._take_picture, args=(name,), daemon=True).start()

    def _send(self, suffix: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file, and send it."""
        name = f"{file_stem(self._session.state.layout.name)}{suffix}"

        def job() -> None:
            content = make()
            self._post(partial(self._client.send_file_download, name, content, save_immediately=True))

        def failed(text: str) -> None:
            self._post(partial(self._failed, "Not exported", text))

        self._worker.submit((suffix, id(self)), job, failed)

    def _take_picture(self, name: str) -> None:
        try:
            picture = self._client.get_render(*PICTURE_SIZE, transport_format="png", timeout=30.0)
        except (RuntimeError, TimeoutError) as error:
            self._post(partial(self._failed, "No picture", str(error)))
            return
        content = iio.imwrite("<bytes>", picture, extension=".png")
        self._post(partial(self._client.send_file_download, name, content, save_immediately=True))
