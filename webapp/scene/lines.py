"""The graph that the network sees, and the selected fin's distance from the centre of gravity."""

from itertools import combinations

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.layout import Layout
from webapp.handles import put
from webapp.scene.meshes.mesh import NOTHING, Mesh, joined, tube
from webapp.scene.shape import UNLIT, Shape
from webapp.tasks.solver import Attention
from webapp.theme import LIGHT

NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)
RADIUS = 0.004
"""Radius of an edge with the mean weight [m]; the others are thicker or thinner by their own."""
CONTRAST = 2.0
"""Power of the weights: they differ little, and the eye needs more."""


class Lines:
    """Nodes that are hidden when there is nothing to say."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the nodes."""
        self.graph = Shape(scene, "/robot/graph", LIGHT.line, visible=False, **UNLIT)
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
        attention: Attention | None = None,
    ) -> None:
        """Show the edges between healthy fins, and the coordinates of the selected one.

        Args:
            layout: the robot.
            healthy: fins that are in the graph.
            selected: fin whose coordinates are shown.
            graph: whether the graph is.
            attention: weights of the edges, where a network has answered for these very fins.
        """
        places = np.array([fin.position for fin in layout.fins if fin.name in healthy])
        wanted = graph and len(places) > 1
        put(self.graph.node, visible=wanted)
        if wanted:
            fits = attention is not None and attention.fins == healthy
            weight = attention.weight if fits and attention is not None else np.ones((len(places),) * 2)
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


def _edges(place: NDArray[np.float64], weight: NDArray[np.float64]) -> Mesh:
    """A rod between each two fins; at each end as thick as that fin looks at the other one."""
    off = weight[~np.eye(len(weight), dtype=bool)]
    thick = RADIUS * np.clip(weight / max(float(off.mean()), 1e-9), 0.2, 2.5) ** CONTRAST
    rods = []
    for i, j in combinations(range(len(place)), 2):
        if np.linalg.norm(place[i] - place[j]) > 1e-3:
            rods.append(tube(place[[i, j]], np.array([thick[i, j], thick[j, i]]), 10))
    return joined(*rods) if rods else NOTHING
