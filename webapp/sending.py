"""Files that take time to make, and go to the browser when they are ready."""

import threading
from collections.abc import Callable
from functools import partial

import imageio.v3 as iio
import viser

from finlab.errors import FinlabError
from webapp.worker import Worker

PICTURE_SIZE = (1080, 1620)
"""Height and width of an exported picture [px]."""


class Sender:
    """Makes files beside the event loop and sends them to one browser."""

    def __init__(
        self,
        client: viser.ClientHandle,
        worker: Worker,
        post: Callable[[Callable[[], object]], None],
        failed: Callable[[str, str], None],
    ) -> None:
        """Prepare; `failed` is called on the event loop with a title and a sentence."""
        self._client, self._worker, self._post, self._failed = client, worker, post, failed

    def send(self, name: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file, and send it."""

        def job() -> None:
            try:
                content = make()
            except FinlabError as error:
                self._post(partial(self._failed, "Not exported", str(error)))
            else:
                self._post(partial(self._client.send_file_download, name, content, save_immediately=True))

        self._worker.submit((name, id(self)), job)

    def send_picture(self, name: str) -> None:
        """Send a picture of the 3D view; the page has to make it, so not on the event loop."""
        threading.Thread(target=self._take_picture, args=(name,), daemon=True).start()

    def _take_picture(self, name: str) -> None:
        try:
            picture = self._client.get_render(*PICTURE_SIZE, transport_format="png", timeout=30.0)
        except (RuntimeError, TimeoutError) as error:
            self._post(partial(self._failed, "No picture", str(error)))
            return
        content = iio.imwrite("<bytes>", picture, extension=".png")
        self._post(partial(self._client.send_file_download, name, content, save_immediately=True))
