"""One robot under way: hull, flapping fins, their forces, the wrench over it, and its trail."""

import math

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.layout import Layout
from webapp.handles import put
from webapp.scene.arrow_scale import LENGTH
from webapp.scene.lines import NO_LINE
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.arrows import NOTHING, force_arrow
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh import Mesh, joined, tube
from webapp.scene.shape import Shape
from webapp.tasks.swimmer import PLACE, Moment
from webapp.theme import ASKED, DEAD, DELIVERED, LIGHT, Rgb, fin_color

Array = NDArray[np.float64]
TRAIL_POINTS = 250
"""Most pieces of a trail."""
ABOVE = 0.1
"""Height of the wrench's arrows over the hull [m]."""


class SwimRobot:
    """The nodes of one robot. Made once, given another layout when another one swims."""

    def __init__(self, scene: viser.SceneApi, name: str, trail: Rgb, opacity: float | None) -> None:
        """Build the nodes, hidden; `opacity` makes a robot that others shine through."""
        self._scene, self._name, self._opacity = scene, name, opacity
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._hull = scene.add_mesh_simple(
            f"{name}/hull", NOTHING.vertices, NOTHING.faces, color=LIGHT.hull, opacity=opacity, side="double"
        )
        self._bow = scene.add_mesh_simple(
            f"{name}/bow", NOTHING.vertices, NOTHING.faces, color=LIGHT.glass, opacity=opacity, side="double"
        )
        self._fins: list[_Fin] = []
        self._wrench = [self._arrow(f"{name}/asked", ASKED), self._arrow(f"{name}/delivered", DELIVERED)]
        self._trail = scene.add_line_segments(
            f"{name}_trail", NO_LINE, trail, thickness=3.5, thickness_units="screen", visible=False
        )
        self._color = np.array(trail, dtype=np.uint8)
        self._top = 0.0
        self._phase: Array = np.zeros(0)
        self._ahead: Moment | None = None
        self._behind: Moment | None = None
        self._clock = 0.0

    def _arrow(self, name: str, color: Rgb) -> Shape:
        node = self._scene.add_mesh_simple(
            name, NOTHING.vertices, NOTHING.faces, color=color, opacity=self._opacity, cast_shadow=False
        )
        return Shape(node)

    def begin(self, layout: Layout, moment: Moment) -> None:
        """Take the shape of a layout and stand at the start."""
        hull = hull_of(layout)
        for node, mesh in ((self._hull, hull.mesh()), (self._bow, hull.bow())):
            put(node, vertices=mesh.vertices.astype(np.float32), faces=mesh.faces.astype(np.uint32))
        self._top = hull.center[2] + hull.half[2] + ABOVE
        while len(self._fins) < layout.n_fins:
            index = len(self._fins)
            self._fins.append(_Fin(self._scene, f"{self._name}/fin{index}", index, self._opacity))
        for place, fin in zip(self._fins, layout.fins, strict=False):
            place.place(np.array(fin.position), fin.mounting_angle)
        for spare in self._fins[layout.n_fins :]:
            spare.hide()
        self._phase = 1.9 * np.arange(layout.n_fins, dtype=np.float64)
        self._ahead = self._behind = moment
        self._clock = moment.time
        put(self._trail, points=NO_LINE, colors=self._color)
        put(self._root, visible=True)
        put(self._trail, visible=True)

    @property
    def place(self) -> Array:
        """Where it is on the screen (3,) [m]."""
        return np.array(self._root.position, dtype=np.float64)

    def hide(self) -> None:
        """Nobody swims."""
        self._ahead = None
        put(self._root, visible=False)
        put(self._trail, visible=False)

    def take(self, moment: Moment, scale: float) -> None:
        """Swim on to a moment; arrows are `scale` [m/N] long."""
        if self._ahead is None or moment is self._ahead:
            return
        self._behind, self._ahead = self._ahead, moment
        self._clock = self._behind.time
        top = np.array([0.0, 0.0, self._top])
        for shape, wrench, thickness in zip(
            self._wrench, (moment.asked, moment.delivered), (0.009, 0.006), strict=True
        ):
            shape.show(force_arrow, wrench[:3] * scale, top, thickness)
        for i, node in enumerate(self._fins[: len(moment.motion)]):
            node.push(moment.force[i] * scale)
        places = moment.record[:, PLACE : PLACE + 3]
        places = places[:: max(1, len(places) // TRAIL_POINTS)]
        if len(places) > 1:
            points = np.stack([places[:-1], places[1:]], axis=1).astype(np.float32)
            put(self._trail, points=points, colors=self._color)

    def animate(self, elapsed: float, lost: tuple[int, ...]) -> None:
        """Move on by some simulated time [s], towards the last moment and never beyond it."""
        if self._ahead is None or self._behind is None:
            return
        now = min(self._clock + elapsed, self._ahead.time)
        passed, self._clock = now - self._clock, now
        way = self._ahead.time - self._behind.time
        share = 1.0 if way <= 0 else min((now - self._behind.time) / way, 1.0)
        start, end = self._behind.pose, self._ahead.pose
        turn = end[3:] if start[3:] @ end[3:] >= 0 else -end[3:]
        attitude = (1 - share) * start[3:] + share * turn
        put(self._root, position=(1 - share) * start[:3] + share * end[:3])
        put(self._root, wxyz=attitude / np.linalg.norm(attitude))
        motion = self._ahead.motion
        self._phase = (self._phase + 2 * np.pi * motion[:, 1] * passed) % (2 * np.pi)
        for i, node in enumerate(self._fins[: len(motion)]):
            amplitude, _, direction = motion[i]
            angle = math.pi / 2 if i in lost else direction + amplitude * math.sin(self._phase[i])
            node.turn(float(angle), i in lost)


class _Fin:
    """Blade, shaft and force of one fin, in the frame of its mounting."""

    def __init__(self, scene: viser.SceneApi, name: str, index: int, opacity: float | None) -> None:
        self._color = fin_color(index)
        self._root = scene.add_frame(name, show_axes=False)
        blade, shaft = fin_mesh.blade(), fin_mesh.shaft()
        self._blade = scene.add_mesh_simple(
            f"{name}/blade", blade.vertices, blade.faces, color=self._color, opacity=opacity
        )
        scene.add_mesh_simple(
            f"{name}/shaft", shaft.vertices, shaft.faces, color=LIGHT.metal, opacity=opacity
        )
        self._force = Shape(
            scene.add_mesh_simple(
                f"{name}/force", NOTHING.vertices, NOTHING.faces, color=self._color, opacity=opacity
            )
        )
        self._frame = np.eye(3)
        self._angle: float | None = None

    def place(self, position: Array, mounting_angle: float) -> None:
        half = mounting_angle / 2
        cos, sin = math.cos(mounting_angle), math.sin(mounting_angle)
        self._frame = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        put(self._root, position=position, visible=True)
        put(self._root, wxyz=np.array([math.cos(half), 0.0, 0.0, math.sin(half)]))

    def hide(self) -> None:
        put(self._root, visible=False)

    def push(self, arrow: Array) -> None:
        root = np.array([fin_mesh.ROOT + fin_mesh.SPAN / 2, 0.0, 0.0])
        self._force.show(force_arrow, self._frame @ arrow, root, 0.006)

    def turn(self, angle: float, lost: bool) -> None:
        put(self._blade, color=DEAD if lost else self._color)
        if angle != self._angle:
            self._angle = angle
            self._blade.wxyz = (math.cos(angle / 2), math.sin(angle / 2), 0.0, 0.0)


def goal(path: Array) -> Mesh:
    """The way to go as a thin tube."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    kept = path[np.concatenate([[True], steps > 1e-6])]
    return joined(tube(kept, 0.006, 8)) if len(kept) > 1 else NOTHING


def arrow_scale(newtons: float) -> float:
    """Length of an arrow per newton [m/N]."""
    return LENGTH / newtons
