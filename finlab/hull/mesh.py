"""A triangle mesh, and bodies that are round about an axis."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array


class Mesh(NamedTuple):
    """Triangles with outward normals."""

    vertices: Array
    """Points (V, 3) [m]."""
    faces: NDArray[np.int32]
    """Corners of the triangles (F, 3), counter-clockwise from outside."""


def grid_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Triangles between neighbouring rings of points; the columns close on themselves."""
    a = np.arange((rows - 1) * columns).reshape(-1, columns)
    b = np.roll(a, -1, axis=1)
    return triangles(a, b, a + columns, b, b + columns, a + columns)


def triangles(*corners: NDArray[np.intp]) -> NDArray[np.int32]:
    """Arrays of corners, three for each set of triangles, as triangles (F, 3)."""
    return np.stack(corners, axis=-1).reshape(-1, 3).astype(np.int32)


def revolved(x: Array, radius_y: Array, radius_z: Array, power: float = 2.0, sides: int = 48) -> Mesh:
    """A closed body along the x axis whose cross-section at `x` is a superellipse.

    Args:
        x: stations (P,), rising [m].
        radius_y: half width (P,) at each station [m].
        radius_z: half height (P,) at each station [m].
        power: 2 is an ellipse, larger is boxier.
        sides: corners of the cross-section.
    """
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    cos, sin = np.cos(turn), np.sin(turn)
    unit_y = np.sign(cos) * np.abs(cos) ** (2 / power)
    unit_z = np.sign(sin) * np.abs(sin) ** (2 / power)
    x, y, z = np.broadcast_arrays(x[:, None], radius_y[:, None] * unit_y, radius_z[:, None] * unit_z)
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), grid_faces(len(x), sides))
