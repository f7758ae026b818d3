"""Hulls drawn from a shape and a size: a closed profile along x with a superelliptic cross-section."""

from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Fin, Layout
from webapp.scene.meshes.mesh import Mesh, revolved
from webapp.scene.meshes.mesh_hull import MeshHull, Triangles

STATIONS: Array = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 41))
"""Positions along a hull of half length 1, closer together towards the ends where it curves most."""


@dataclass(frozen=True)
class HullShape:
    """A drawable hull. It can tell inside from outside, so that fins can be tied to its surface."""

    shape: str
    """`box`, `ellipsoid`, `torpedo` or `ucat`."""
    half: tuple[float, float, float]
    """Half length, width and height [m]."""
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where its middle lies in the body frame [m]."""

    @property
    def _power(self) -> float:
        return {"box": 5.0, "ellipsoid": 2.0, "torpedo": 2.0, "ucat": 3.2}[self.shape]

    def _profile(self, s: Array) -> Array:
        """Share of the full width at s in [-1, 1] along the hull."""
        if self.shape == "torpedo":
            nose = np.sqrt(np.clip(1 - (np.clip(s - 0.6, 0, None) / 0.4) ** 2, 0, 1))
            tail = 1 - 0.62 * (np.clip(-s - 0.35, 0, None) / 0.65) ** 2
            end = np.sqrt(np.clip(1 - (np.clip(-s - 0.94, 0, None) / 0.06) ** 2, 0, 1))
            return nose * tail * end
        power = {"box": 6.0, "ellipsoid": 2.0, "ucat": 3.0}[self.shape]
        return np.clip(1 - np.abs(s) ** power, 0, 1) ** (1 / power)

    def mesh(self) -> Mesh:
        """The hull's surface."""
        return self._surface(STATIONS, 1.0)

    def bow(self) -> Mesh:
        """A dark window over the foremost part, a little proud of the hull: it shows which end is the bow."""
        return self._surface(np.concatenate([[0.72], STATIONS[STATIONS > 0.72]]), 1.012)

    def _surface(self, s: Array, swell: float) -> Mesh:
        share = self._profile(s) * swell
        mesh = revolved(s * self.half[0] * swell, share * self.half[1], share * self.half[2], self._power)
        return Mesh(mesh.vertices + np.array(self.center), mesh.faces)

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (..., 3) lie inside."""
        local = (np.asarray(points) - np.array(self.center)) / np.array(self.half)
        share = np.maximum(self._profile(np.clip(local[..., 0], -1, 1)), 1e-9)
        section = np.abs(local[..., 1] / share) ** self._power + np.abs(local[..., 2] / share) ** self._power
        return np.asarray((np.abs(local[..., 0]) < 1) & (section < 1))

    def anchor(self, point: Array) -> Array:
        """Where a strut from `point` towards the hull's axis meets the surface; itself if inside."""
        x = np.clip(point[0], self.center[0] - 0.8 * self.half[0], self.center[0] + 0.8 * self.half[0])
        axis = np.array([x, self.center[1], self.center[2]])
        way = point + np.linspace(0, 1, 200)[:, None] * (axis - point)
        inside = np.flatnonzero(self.contains(way))
        return np.asarray(way[inside[0]] if len(inside) else axis)

    def nearest(self, point: Array) -> tuple[Array, Array]:
        """The point (3,) of the surface nearest to `point`, and the outward normal (3,) there."""
        return _triangles(self).nearest(point)


@lru_cache(maxsize=8)
def _triangles(hull: HullShape) -> Triangles:
    return Triangles(hull.mesh())


AnyHull = HullShape | MeshHull


def hull_of(layout: Layout) -> AnyHull:
    """The hull that the layout describes, or one that fits between its actuators."""
    described = layout.body.hull if layout.body is not None else None
    if described is not None and described.mesh is not None:
        x, y, z = described.center_m
        with suppress(FinlabError):  # the file may be on another computer; a made-up hull is better than none
            return MeshHull.load(described.mesh, described.scale, (x, y, z))
    elif described is not None and described.shape is not None and described.size_m is not None:
        length, width, height = described.size_m
        x, y, z = described.center_m
        return HullShape(described.shape, (length / 2, width / 2, height / 2), (x, y, z))
    reach = np.abs(layout.position).max(axis=0)
    half = np.maximum(reach * [1.06, 0.86, 0.86], [0.16, 0.09, 0.08])
    slender = half[0] > 2.4 * max(half[1], half[2])
    round_plan = half[1] > 0.8 * half[0]
    shape = "torpedo" if slender else "ellipsoid" if round_plan else "ucat"
    return HullShape(shape, (float(half[0]), float(half[1]), float(half[2])))


@lru_cache(maxsize=8)
def has_inside(layout: Layout) -> bool:
    """Whether a thruster sits inside the hull, where it could not be seen."""
    places = [part.position for part in layout.actuators if not isinstance(part, Fin)]
    return bool(places) and bool(hull_of(layout).contains(np.array(places)).any())
