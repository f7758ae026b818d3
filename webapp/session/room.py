"""The room that fins need: outside of the hull, and apart from what the others sweep."""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from webapp.scene.meshes.fin import CHORD, ROOT, SPAN
from webapp.scene.meshes.hull import AnyHull, hull_of
from webapp.scene.meshes.mesh_hull import MeshHull

ALONG = np.linspace(ROOT, ROOT + SPAN, 4)
"""Places along a shaft, from where its blade begins to where it ends [m]."""
INSIDE = 0.02
"""How far a place inside the hull counts as wrong [m]."""


class Room:
    """What a layout's fins have to keep when they are moved."""

    def __init__(self, layout: Layout, apart: float) -> None:
        """Blades stand outside of the layout's hull, and what two fins sweep is `apart` [m].

        A fin sweeps a cylinder about its shaft. Cylinders that are closer already, or overlap, need not part,
        but come no closer.
        """
        hull = hull_of(layout)
        self._hull: AnyHull = hull.coarse() if isinstance(hull, MeshHull) else hull
        now = swept_gaps(layout.position[None], layout.mounting_angle[None])[0]
        self._needed = np.minimum(now, apart)

    def broken(self, position: Array, angle: Array) -> Array:
        """How far fins at positions (P, n, 3) [m] under angles (P, n) [rad] break the rules (P,) [m]."""
        inside = self._hull.contains(_places(position, angle)).sum(axis=(-1, -2))
        close = np.maximum(self._needed - swept_gaps(position, angle) - 1e-9, 0.0).sum(axis=-1)
        return np.asarray(INSIDE * inside + close)


def swept_gaps(position: Array, angle: Array) -> Array:
    """Distances (P, pairs) [m] between the cylinders that fins sweep; negative where they overlap."""
    places = _places(position, angle)
    first, second = np.triu_indices(position.shape[1], k=1)
    between = places[:, first, :, None] - places[:, second, None]
    return np.asarray(np.linalg.norm(between, axis=-1).min(axis=(-1, -2)) - 2.0 * CHORD)


def _places(position: Array, angle: Array) -> Array:
    """Places along the shafts (P, n, 4, 3) [m]."""
    shaft = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    return np.asarray(position[..., None, :] + ALONG[:, None] * shaft[..., None, :])
