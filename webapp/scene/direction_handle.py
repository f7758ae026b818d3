"""The direction of the selected actuator as a needle whose ends are dragged on a sphere."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import put
from webapp.scene.arrows import tube
from webapp.scene.stage import Shape
from webapp.theme import LIGHT, Rgb

LENGTH = 0.3
"""From the actuator to the tip [m], for size 1."""
TIP, TAIL = 0.02, 0.012
"""Radii of the ends [m], for size 1; where the robot is before one of them, the other one is free."""
SNAP = np.cos(np.radians(5.0))
"""Cosine of the angle up to which the needle jumps to an axis of the body."""


class DirectionHandle:
    """Needle and ends; hidden while nothing that can be turned is selected."""

    def __init__(self, client: viser.ClientHandle, on_turn: Callable[[str, Array], None]) -> None:
        """`on_turn` gets `update` or `end`, and a direction (3,) in the body frame."""
        self._client, self._on_turn = client, on_turn
        self._size, self._direction = 1.0, np.array([1.0, 0.0, 0.0])
        scene = client.scene
        self._root = scene.add_frame("/robot/direction", show_axes=False, visible=False)
        way = np.array([[-LENGTH, 0.0, 0.0], [LENGTH, 0.0, 0.0]])
        needle = Shape(scene, "/robot/direction/needle", LIGHT.line, tube(way, 0.0025, 10), cast_shadow=False)
        self._ends = []
        for name, radius, sign in (("tip", TIP, 1.0), ("tail", TAIL, -1.0)):
            end = scene.add_icosphere(f"/robot/direction/{name}", radius, cast_shadow=False)
            end.on_drag(self._dragging(sign))
            self._ends.append((end, sign))
        self._needle = needle.node

    def _dragging(self, sign: float) -> Callable[[Any], Any]:
        async def dragged(event: Any) -> None:
            if event.phase != "start":
                center, eye = np.array(self._root.position), np.array(self._client.camera.position)
                aim = np.array(event.end_position) - eye
                before, radius = sign * self._direction, LENGTH * self._size
                self._direction = sign * snapped(on_sphere(eye - center, aim, radius, before))
                self._turn()
                self._on_turn(event.phase, self._direction)

        return dragged

    def show(self, place: Array | None, direction: Array, size: float, color: Rgb) -> None:
        """Show the direction (3,) of what stands at a place (3,) [m]; None hides it."""
        put(self._root, visible=place is not None)
        if place is not None:
            self._size, self._direction = size, direction
            put(self._root, position=place)
            put(self._needle, scale=size)
            for end, sign in self._ends:
                put(end, scale=size, color=color, position=np.array([sign * LENGTH * size, 0.0, 0.0]))
            self._turn()

    def _turn(self) -> None:
        x, y, z = self._direction
        wxyz = np.array([1.0 + x, 0.0, -z, y]) if x > -1.0 + 1e-9 else np.array([0.0, 0.0, 1.0, 0.0])
        put(self._root, wxyz=wxyz / np.linalg.norm(wxyz))


def on_sphere(eye: Array, aim: Array, radius: float, before: Array) -> Array:
    """Direction (3,) to the point of a sphere about the origin that a ray from an eye (3,) along `aim` (3,)
    meets, the one nearer to `before` (3,) of two; the nearest to the ray where it passes by."""
    aim = aim / np.linalg.norm(aim)
    foot = eye - (eye @ aim) * aim
    inside = radius**2 - foot @ foot
    if inside > 0.0:
        both = foot + np.sqrt(inside) * np.array([[-1.0], [1.0]]) * aim
        foot = both[np.argmax(both @ before)]
    return np.asarray(foot / np.linalg.norm(foot))


def snapped(direction: Array) -> Array:
    """The axis of the body that a direction (3,) almost has, or the direction itself."""
    k = int(np.argmax(np.abs(direction)))
    return np.sign(direction[k]) * np.eye(3)[k] if abs(direction[k]) > SNAP else direction
