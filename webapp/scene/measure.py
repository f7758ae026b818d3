"""A rule in the view: two clicks on the hull or on fins, and the way from one to the other."""

from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import put
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh import Mesh
from webapp.session import Session
from webapp.theme import look

NEAR = 0.035
"""A fin's root that the ray passes at most so far away is meant [m]."""
LIFT = np.array([0.0, 0.0, 0.02])
"""Where the figure stands above the middle of the line [m]."""


class Measure:
    """The line between two points, and its length."""

    def __init__(self, scene: viser.SceneApi, session: Session) -> None:
        """Build the nodes, hidden."""
        self._scene, self._session = scene, session
        self._places: list[Array] = []
        self._heard: Any = None
        line = np.zeros((1, 2, 3), dtype=np.float32)
        self._line = scene.add_line_segments(
            "/measure/line", line, colors=(0, 0, 0), thickness=3.0, visible=False
        )
        self._ends = scene.add_point_cloud(
            "/measure/ends", line[0], colors=(0, 0, 0), point_size=0.012, point_shape="circle", visible=False
        )
        self._label = scene.add_label("/measure/length", "", anchor="bottom-center", visible=False)

    def refresh(self, wanted: bool, dark: bool) -> None:
        """Listen to clicks while it is wanted; draw what has been measured."""
        if wanted and self._heard is None:
            clicked: Any = self._clicked  # viser waits for coroutines, although it does not say so
            self._heard = self._scene.on_click()(clicked)
        elif not wanted and self._heard is not None:
            self._scene.remove_click_callback(self._heard)
            self._heard, self._places = None, []
        color = np.array(look(dark).overlay, dtype=np.uint8)
        whole = len(self._places) == 2
        if self._places:
            ends = np.array([self._places[0], self._places[-1]], dtype=np.float32)
            put(self._ends, points=ends, colors=np.tile(color, (2, 1)))
            put(self._line, points=ends[None], colors=np.tile(color, (1, 2, 1)))
            put(self._label, text=told(*ends.astype(float)), position=ends.mean(axis=0) + LIFT)
        put(self._ends, visible=bool(self._places))
        put(self._line, visible=whole)
        put(self._label, visible=whole)

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        session = self._session
        layout = session.state.layout
        roots = np.array([fin.position for fin in layout.fins])
        origin, way = np.array(event.ray_origin), np.array(event.ray_direction)
        place = met(origin, way, roots, hull_of(layout).mesh())
        if place is not None:
            self._places = [place] if len(self._places) == 2 else [*self._places, place]
        self.refresh(session.display.measure, session.display.dark)


def told(one: Array, other: Array) -> str:
    """A distance, and its parts along x, y and z."""
    x, y, z = np.abs(other - one)
    return f"{np.linalg.norm(other - one):.3f} m   x {x:.3f}  y {y:.3f}  z {z:.3f}"


def met(origin: Array, way: Array, roots: Array, hull: Mesh) -> Array | None:
    """What a ray meets first: a fin's root, of those that it passes closely, else the hull.

    Args:
        origin: where the ray begins (3,) [m].
        way: its direction (3,), of any length.
        roots: of the fins (n, 3) [m].
        hull: its mesh.

    Returns:
        The place (3,) [m]; None where it meets nothing.
    """
    way = way / np.linalg.norm(way)
    along = (roots - origin) @ way
    gaps = np.linalg.norm(roots - origin - along[:, None] * way, axis=1)
    close = np.flatnonzero((gaps <= NEAR) & (along > 0.0))
    if close.size:
        return np.array(roots[close[np.argmin(along[close])]])
    # A triangle and a ray, all triangles at once: the place in it, and how far along the ray that is.
    a, b, c = (hull.vertices[hull.faces[:, k]] for k in range(3))
    side = np.cross(way, c - a)
    volume = ((b - a) * side).sum(axis=1)
    volume = np.where(np.abs(volume) < 1e-15, np.nan, volume)
    from_a = origin - a
    u = (from_a * side).sum(axis=1) / volume
    turned = np.cross(from_a, b - a)
    v = (turned @ way) / volume
    far = ((c - a) * turned).sum(axis=1) / volume
    hits = far[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 1e-6)]
    return None if hits.size == 0 else origin + float(hits.min()) * way
