"""One robot under way: hull, flapping fins, their forces, the wrench over it, and its trail."""

import numpy as np
import viser

from finlab.arrays import Array
from finlab.layout import Layout
from webapp.handles import put
from webapp.scene.fin_node import FinShapes, Flapping, turn_of
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh import NOTHING, Mesh, force_arrow, joined, tube
from webapp.scene.shape import Shape
from webapp.tasks.moment import PLACE, Moment
from webapp.theme import ASKED, DELIVERED, LIGHT

NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)
TRAIL_POINTS = 250
"""Most pieces of a trail."""
ABOVE = 0.1
"""Height of the wrench's arrows over the hull [m]."""


class SwimRobot:
    """The nodes of one robot. Made once, given another layout when another one swims."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        """Build the nodes, hidden."""
        self._scene, self._name = scene, name
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._hull = Shape(scene, f"{name}/hull", LIGHT.hull, side="double")
        self._bow = Shape(scene, f"{name}/bow", LIGHT.glass, side="double")
        self._frames: list[viser.FrameHandle] = []
        self._fins: list[FinShapes] = []
        self._wrench = [
            Shape(scene, f"{name}/{word}", color, cast_shadow=False)
            for word, color in (("asked", ASKED), ("delivered", DELIVERED))
        ]
        self._trail = scene.add_line_segments(
            f"{name}_trail", NO_LINE, DELIVERED, thickness=3.5, thickness_units="screen", visible=False
        )
        self._color = np.array(DELIVERED, dtype=np.uint8)
        self._top = 0.0
        self._flapping = Flapping()
        self._names: tuple[str, ...] = ()
        self._axes: Array = np.zeros((0, 3, 3))
        self._ahead: Moment | None = None
        self._behind: Moment | None = None
        self._clock = 0.0

    def begin(self, layout: Layout, moment: Moment) -> None:
        """Take the shape of a layout and stand at the start."""
        hull = hull_of(layout)
        self._hull.become(hull.mesh())
        self._bow.become(hull.bow())
        self._top = hull.center[2] + hull.half[2] + ABOVE
        while len(self._fins) < layout.n:
            index = len(self._fins)
            name = f"{self._name}/fin{index}"
            self._frames.append(self._scene.add_frame(name, show_axes=False))
            self._fins.append(FinShapes(self._scene, name, index))
        self._axes = layout.frames
        for frame, shapes, part in zip(self._frames, self._fins, layout.actuators, strict=False):
            shapes.become(part)
            put(frame, position=np.array(part.position), visible=True, wxyz=turn_of(np.array(part.frame)))
        for spare in self._frames[layout.n :]:
            put(spare, visible=False)
        self._flapping = Flapping()
        self._names = layout.names
        self._flap(moment)
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
        """No robot swims."""
        self._ahead = None
        put(self._root, visible=False)
        put(self._trail, visible=False)

    def take(self, moment: Moment, scale: float) -> None:
        """Swim on to a moment; arrows are `scale` [m/N] long."""
        if self._is_at(moment) or self._ahead is None:
            return
        self._behind, self._ahead = self._ahead, moment
        self._clock = self._behind.time
        self._draw(moment, scale)

    def _is_at(self, moment: Moment) -> bool:
        """Whether this moment is shown already."""
        ahead = self._ahead
        return ahead is not None and (moment.time, moment.lost) == (ahead.time, ahead.lost)

    def _draw(self, moment: Moment, scale: float) -> None:
        """Everything but pose and blades."""
        top = np.array([0.0, 0.0, self._top])
        for shape, wrench, thickness in zip(
            self._wrench, (moment.asked, moment.delivered), (0.009, 0.006), strict=True
        ):
            shape.show(force_arrow, wrench[:3] * scale, top, thickness)
        self._flap(moment)
        for node, force, frame in zip(self._fins, moment.force, self._axes, strict=False):
            node.push(force * scale, frame, 0.006)
        places = moment.record[:, PLACE : PLACE + 3]
        places = places[:: max(1, len(places) // TRAIL_POINTS)]
        if len(places) > 1:
            points = np.stack([places[:-1], places[1:]], axis=1).astype(np.float32)
            put(self._trail, points=points, colors=self._color)

    def _flap(self, moment: Moment) -> None:
        """Take over what the fins do; lost ones hang limp, in the colour of failed ones."""
        alive = np.array([name not in moment.lost for name in self._names])
        self._flapping.take(np.where(alive[:, None], moment.motion, np.nan))
        for node, works in zip(self._fins, alive, strict=False):
            node.paint(bool(works))

    def animate(self, elapsed: float) -> None:
        """Move on by some simulated time [s], towards the last moment and never beyond it."""
        if self._ahead is None or self._behind is None or self._ahead is self._behind:
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
        for node, angle in zip(self._fins, self._flapping.angles(passed, False), strict=False):
            node.pose(angle)


def goal(path: Array) -> Mesh:
    """The way to go as a thin tube."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    kept = path[np.concatenate([[True], steps > 1e-6])]
    return joined(tube(kept, 0.006, 8)) if len(kept) > 1 else NOTHING
