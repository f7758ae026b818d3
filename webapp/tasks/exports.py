"""Files that take time to make, and go to the browser when they are ready."""

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import imageio.v3 as iio

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.deploy.bundle import make_bundle, with_tables_inside
from finlab.deploy.graph import build_graph
from finlab.deploy.graph_file import graph_bytes
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.scene.robot_scene import RobotScene
from webapp.session.companions import archive_of, has_tables
from webapp.session.files import file_stem
from webapp.tasks.context import Context
from webapp.viser_internals import start_server, stop_server

SECONDS = 4.0
"""Length of the recording on the clock on the wall; it plays again and again."""
FRAMES_PER_SECOND = 20

PICTURE_SIZE = (1080, 1620)
"""Height and width of an exported picture [px]."""


def recorded_html(context: Context, allocation: Allocation) -> bytes:
    """The robot of a page's session as it flaps with an answer.

    Takes a second and must not run on the event loop: viser records shared scenes only, so the robot is
    built once more on a server of its own.
    """
    server = start_server()
    try:
        server.scene.world_axes.visible = False
        studio: Any = SimpleNamespace(scene=server.scene, camera=server.initial_camera, atomic=server.atomic)
        robot = RobotScene(replace(context, client=studio, do=lambda _: None))
        robot.refresh(allocation)
        recording = server.get_scene_serializer()
        for _ in range(int(SECONDS * FRAMES_PER_SECOND)):
            robot.animate(1 / FRAMES_PER_SECOND)
            recording.insert_sleep(1 / FRAMES_PER_SECOND)
        return recording.as_html(dark_mode=context.session.display.dark).encode()
    finally:
        stop_server(server)


class Exports:
    """Makes files beside the event loop and sends them to one browser."""

    def __init__(self, context: Context) -> None:
        """Send what the page's session holds to its browser."""
        self._context, self._session = context, context.session
        self._picturing = False

    def graph(self) -> None:
        """Send the layout graph file; where fins are known by tables, an archive with them."""
        layout = self._session.state.layout
        name = f"{file_stem(layout.name)}.graph.json"

        def archive(*robot: Any) -> bytes:
            inside, tables = with_tables_inside(layout)
            return archive_of(name, graph_bytes(replace(build_graph(*robot), layout=inside)), tables)

        if has_tables(layout):
            self._send_made(".graph.zip", archive)
        else:
            self._send_made(".graph.json", lambda *robot: graph_bytes(build_graph(*robot)))

    def bundle(self) -> None:
        """Send the bundle for the robot: the same bytes as `finlab export --zip`.

        What was tried out with K and T on the page does not go to the robot.
        """
        self._send_made(".zip", lambda *robot: make_bundle(*robot).zip_bytes())

    def _send_made(self, suffix: str, make: Callable[[Layout, Allocator, tuple[str, ...]], bytes]) -> None:
        """Send what is made of the robot and its allocator, as that is shipped but for the objective."""
        state, loaded = self._session.state, self._context.solver.loaded
        self._send(suffix, lambda: make(state.layout, loaded(state.method, state.objective), state.failed))

    def html(self, shown: Allocation | None) -> None:
        """Send a standalone page of the 3D view with an answer.

        Raises:
            FinlabError: there is no answer yet.
        """
        if shown is None:
            raise FinlabError("there is no answer yet; wait for one")
        frozen = replace(self._context, session=self._session.twin())
        self._send(".html", lambda: recorded_html(frozen, shown))

    def picture(self) -> None:
        """Send a picture of the 3D view; the page has to make it, so not on the event loop."""
        if self._picturing:
            raise FinlabError("a picture is being made; wait for it")
        self._picturing = True
        name = f"{file_stem(self._session.state.layout.name)}.png"
        threading.Thread(target=self._take_picture, args=(name,), daemon=True).start()

    def _send(self, suffix: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file, and send it; of each kind only the newest that is asked for."""
        name = f"{file_stem(self._session.state.layout.name)}{suffix}"
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
