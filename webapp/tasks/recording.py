"""The 3D view as one HTML file that moves by itself and needs no server."""

from types import SimpleNamespace
from typing import Any

from finlab.allocation.allocation import Allocation
from webapp.scene.robot_scene import RobotScene
from webapp.session import Session
from webapp.viser_internals import start_server, stop_server

SECONDS = 4.0
"""Length of the recording on the clock on the wall; it plays again and again."""
FRAMES_PER_SECOND = 20


def recorded_html(session: Session, allocation: Allocation) -> bytes:
    """The robot of a session as it flaps with an answer.

    Takes a second and must not run on the event loop: viser records shared scenes only, so the robot is
    built once more on a server of its own.
    """
    server = start_server("127.0.0.1", 0)
    try:
        server.scene.world_axes.visible = False
        studio: Any = SimpleNamespace(scene=server.scene, camera=server.initial_camera, atomic=server.atomic)
        robot = RobotScene(studio, session, lambda *_: None, lambda *_: None, lambda *_: None)
        robot.refresh(allocation)
        recording = server.get_scene_serializer()
        for _ in range(int(SECONDS * FRAMES_PER_SECOND)):
            robot.animate(1 / FRAMES_PER_SECOND)
            recording.insert_sleep(1 / FRAMES_PER_SECOND)
        return recording.as_html(dark_mode=session.display.dark).encode()
    finally:
        stop_server(server)
