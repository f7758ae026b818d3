"""Thin lines: the graph of the fins, and the selected fin's distance from the centre of gravity."""

from itertools import combinations

import numpy as np
import viser

from finlab.layout import Layout
from webapp.handles import put
from webapp.theme import LIGHT

NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)


class Lines:
    """Line nodes, hidden when there is nothing to say."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the nodes."""
        self._graph = scene.add_line_segments(
            "/graph", NO_LINE, LIGHT.line, thickness=1.5, thickness_units="screen"
        )
        self._steps = scene.add_line_segments(
            "/dimension", NO_LINE, LIGHT.line, thickness=2.0, thickness_units="screen"
        )
        self._text = scene.add_label("/dimension/text", "", anchor="top-center", font_screen_scale=0.85)

    def refresh(self, layout: Layout, healthy: tuple[str, ...], selected: str | None, graph: bool) -> None:
        """Show the edges between healthy fins, and the coordinates of the selected one."""
        places = [fin.position for fin in layout.fins if fin.name in healthy]
        edges = np.array(list(combinations(places, 2)), dtype=np.float32).reshape(-1, 2, 3)
        put(self._graph, visible=graph and len(edges) > 0)
        if graph and len(edges) > 0:
            put(self._graph, points=edges, colors=np.array(LIGHT.line, dtype=np.uint8))
        put(self._steps, visible=selected is not None)
        put(self._text, visible=selected is not None)
        if selected is None:
            return
        x, y, z = layout.fins[layout.index(selected)].position
        corners = np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [x, y, z]], dtype=np.float32)
        put(self._steps, points=np.stack([corners[:-1], corners[1:]], axis=1))
        put(self._text, text=f"x {x:+.3f}  y {y:+.3f}  z {z:+.3f} m".replace("-", "−"))
        put(self._text, position=np.array([x, y, z - 0.07]))
