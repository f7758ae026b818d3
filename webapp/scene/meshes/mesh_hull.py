"""A hull from a mesh file that can be asked where its surface is."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import closest_point

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.files.guarded import read_file
from webapp.scene.meshes.mesh import NOTHING, Mesh
from webapp.scene.meshes.mesh_file import MAX_BYTES, MeshReport, read_mesh, simplified

COARSE_FACES = 400
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}
"""Metres per unit of a mesh file."""


class Triangles:
    """The surface of a closed mesh."""

    def __init__(self, mesh: Mesh) -> None:
        """Take the triangles that have an area."""
        corners = np.asarray(mesh.vertices, dtype=float)[mesh.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1)
        good = size > 1e-14
        self.corners = corners[good]
        """Corners (F, 3, 3) [m]."""
        self.normal = normal[good] / size[good, None]
        """Outward normals (F, 3)."""

    def nearest(self, point: Array) -> tuple[Array, Array]:
        """The point (3,) of the surface nearest to `point`, and the outward normal (3,) there."""
        point = np.asarray(point, dtype=float)
        found = closest_point(self.corners, np.broadcast_to(point, (len(self.corners), 3)))
        gap = np.linalg.norm(found - point, axis=1)
        best = int(np.argmin(gap))
        # On an edge several triangles are as near; their mean is what a hand would call the normal there.
        normal = self.normal[gap < gap[best] + 1e-6].sum(axis=0)
        size = float(np.linalg.norm(normal))
        return np.asarray(found[best]), self.normal[best] if size < 1e-9 else normal / size

    def contains(self, point: Array) -> bool:
        """Whether a point (3,) lies inside: the triangles fill the whole sphere around it, else nothing.

        The solid angle of a triangle is that of Van Oosterom and Strackee (1983).
        """
        a, b, c = np.swapaxes(self.corners - np.asarray(point, dtype=float), 0, 1)
        u, v, w = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        scale = u * v * w + (a * b).sum(axis=1) * w + (b * c).sum(axis=1) * u + (c * a).sum(axis=1) * v
        half_angle = np.arctan2(volume, scale)
        return bool(abs(half_angle.sum()) > np.pi)


@dataclass(frozen=True, eq=False)
class MeshHull:
    """A hull of triangles. Two are equal if they come from the same file in the same way."""

    source: tuple[str, float, tuple[float, float, float]]
    """File, metres per unit, and centre."""
    surface: Triangles
    half: tuple[float, float, float]
    """Half length, width and height of the box around it [m]."""
    center: tuple[float, float, float]
    """Where the middle of that box lies in the body frame [m]."""
    report: MeshReport
    shape: str = "mesh"
    """Tells it from the parametric hulls."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MeshHull) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)

    @staticmethod
    @lru_cache(maxsize=8)
    def load(path: str, scale: float, center: tuple[float, float, float]) -> "MeshHull":
        """Read a mesh file, its box centred at `center` [m].

        Raises:
            FinlabError: the file cannot be read or is no sensible hull.
        """
        file = Path(path)
        content = read_file(file, MAX_BYTES, "a mesh file", FinlabError)
        mesh, report = read_mesh(file.name, content, scale)
        corners = mesh.vertices + np.array(center)
        half = np.ptp(mesh.vertices, axis=0) / 2
        x, y, z = (float(v) for v in half)
        surface = Triangles(Mesh(corners, mesh.faces))
        return MeshHull((path, scale, center), surface, (x, y, z), center, report)

    def coarse(self) -> "MeshHull":
        """About the same hull with few triangles, for questions that are asked thousands of times."""
        mesh = simplified(self.mesh(), COARSE_FACES)
        return replace(self, surface=Triangles(mesh))

    def mesh(self) -> Mesh:
        """The hull's surface."""
        corners = self.surface.corners
        return Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))

    def bow(self) -> Mesh:
        """Nothing: a mesh shows by itself which end is the bow."""
        return NOTHING

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (..., 3) lie inside."""
        points = np.asarray(points, dtype=float)
        inside = [self.surface.contains(point) for point in points.reshape(-1, 3)]
        return np.array(inside).reshape(points.shape[:-1])

    def anchor(self, point: Array) -> Array:
        """Where a strut from `point` meets the surface; itself if inside."""
        return np.asarray(point) if self.contains(point) else self.nearest(point)[0]

    def nearest(self, point: Array) -> tuple[Array, Array]:
        """The point (3,) of the surface nearest to `point`, and the outward normal (3,) there."""
        return self.surface.nearest(point)
