"""A triangle mesh that can be asked where its surface is."""

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import closest_point

from webapp.scene.meshes.mesh import Mesh

Array = NDArray[np.float64]


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
        """Whether a point (3,) lies inside: a ray from it leaves the mesh an odd number of times."""
        a, b, c = np.swapaxes(self.corners, 0, 1)
        # An odd direction hits no edge of a mesh that is built along the axes.
        ray = np.array([0.8137, 0.4271, 0.3944])
        one, two = b - a, c - a
        across = np.cross(ray, two)
        size = np.einsum("fi,fi->f", one, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            start = np.asarray(point, dtype=float) - a
            u = np.einsum("fi,fi->f", start, across) / size
            other = np.cross(start, one)
            v = other @ ray / size
            way = np.einsum("fi,fi->f", two, other) / size
            hit = (np.abs(size) > 1e-14) & (u >= 0) & (v >= 0) & (u + v <= 1) & (way > 0)
        return bool(hit.sum() % 2)
