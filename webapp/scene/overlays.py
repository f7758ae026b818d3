"""What is drawn over the robot: pale blades, another method's arrows, the fin graph, dimensions."""

from itertools import combinations

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.mesh import NOTHING, Mesh, force_arrow, joined, tube
from webapp.scene.shape import Shape
from webapp.tasks.solver import Proposal
from webapp.theme import DEAD, LIGHT, Rgb, look

LIFT = np.array([0.0, 0.0, 0.025])
"""The arrows stand a little above the fins' own ones, so that equal ones can be told apart [m]."""

NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)
RADIUS = 0.004
"""Radius of an edge with the mean weight [m]; the others are thicker or thinner by their own."""
CONTRAST = 2.0
"""Power of the weights: they differ little, and the eye needs more."""


class Ghost:
    """Blades of some fins: pale where they stood or one would land, full where a search puts them."""

    def __init__(
        self, scene: viser.SceneApi, name: str, color: Rgb = DEAD, opacity: float | None = 0.3
    ) -> None:
        """Build the node, showing nothing."""
        self._shape = Shape(scene, name, color, opacity=opacity, visible=False, cast_shadow=False)

    def show(self, fins: tuple[Fin, ...]) -> None:
        """Show fins; none hides the node."""
        put(self._shape.node, visible=bool(fins))
        if fins:
            self._shape.show(_blades, fins)


def moved_fins(other: Layout | None, layout: Layout) -> tuple[Fin, ...]:
    """The fins of another version of a layout that stand elsewhere now."""
    if other is None or other.name != layout.name:
        return ()
    now = {fin.name: (fin.position, fin.mounting_angle) for fin in layout.fins}
    return tuple(fin for fin in other.fins if now.get(fin.name) != (fin.position, fin.mounting_angle))


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        turn = fin_mesh.mounting(fin.mounting_angle)
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ turn.T + np.array(fin.position), part.faces))
    return joined(*parts)


class Overlay:
    """Forces of the fins by another method, as plain arrows beside the robot's own."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the node, showing nothing."""
        self._shape = Shape(scene, "/robot/overlay", LIGHT.overlay, visible=False, cast_shadow=False)

    def refresh(self, answer: Allocation | None, scale: float, dark: bool) -> None:
        """Show an answer's forces, arrows of `scale` [m/N]; nothing for None."""
        put(self._shape.node, visible=answer is not None, color=look(dark).overlay)
        if answer is not None:
            place = answer.layout.position
            self._shape.show(_arrows, place, np.nan_to_num(answer.fin_forces) * scale)


def _arrows(place: np.ndarray, way: np.ndarray) -> Mesh:
    return joined(*(force_arrow(w, p + LIFT, 0.005) for p, w in zip(place, way, strict=True)))


class Lines:
    """The graph that the network sees, and how far the selected fin is from the centre of gravity."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the nodes."""
        self.graph = Shape(scene, "/robot/graph", LIGHT.line, visible=False, cast_shadow=False)
        self._steps = scene.add_line_segments(
            "/robot/dimension", NO_LINE, LIGHT.line, thickness=2.0, thickness_units="screen"
        )
        self._text = scene.add_label("/robot/dimension/text", "", anchor="top-center", font_screen_scale=0.85)

    def refresh(
        self,
        layout: Layout,
        healthy: tuple[str, ...],
        selected: str | None,
        graph: bool,
        proposal: Proposal | None = None,
    ) -> None:
        """Show the edges between healthy fins, and the coordinates of the selected one.

        Args:
            layout: the robot.
            healthy: fins that are in the graph.
            selected: fin whose coordinates are shown.
            graph: whether the graph is.
            proposal: whose attention makes the edges thick, where a network has answered for these very fins.
        """
        places = np.array([fin.position for fin in layout.fins if fin.name in healthy])
        wanted = graph and len(places) > 1
        put(self.graph.node, visible=wanted)
        if wanted:
            fits = proposal is not None and proposal.fins == healthy
            weight = proposal.seen.attention if fits and proposal is not None else np.ones((len(places),) * 2)
            self.graph.show(_edges, places, weight)
        put(self._steps, visible=selected is not None)
        put(self._text, visible=selected is not None)
        if selected is None:
            return
        x, y, z = layout.fins[layout.index(selected)].position
        corners = np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [x, y, z]], dtype=np.float32)
        put(self._steps, points=np.stack([corners[:-1], corners[1:]], axis=1))
        put(self._text, text=f"x {x:+.3f}  y {y:+.3f}  z {z:+.3f} m".replace("-", "−"))
        put(self._text, position=np.array([x, y, z - 0.07]))


def _edges(place: Array, weight: Array) -> Mesh:
    """A rod between each two fins; at each end as thick as that fin looks at the other one."""
    off = weight[~np.eye(len(weight), dtype=bool)]
    thick = RADIUS * np.clip(weight / max(float(off.mean()), 1e-9), 0.2, 2.5) ** CONTRAST
    rods = []
    for i, j in combinations(range(len(place)), 2):
        if np.linalg.norm(place[i] - place[j]) > 1e-3:
            rods.append(tube(place[[i, j]], np.array([thick[i, j], thick[j, i]]), 10))
    return joined(*rods) if rods else NOTHING
