"""Triangle meshes, and hulls drawn from a shape and a size: a closed profile along x."""

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


STATIONS: Array = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 41))
"""Positions along a hull of half length 1, closer together towards the ends where it curves most."""
ACROSS = {"box": 5.0, "ellipsoid": 2.0, "torpedo": 2.0, "ucat": 3.2}
ALONG = {"box": 6.0, "ellipsoid": 2.0, "ucat": 3.0}
"""Powers of the superellipses across and along each shape; a torpedo has a profile of its own."""

Three = tuple[float, float, float]


def shape_mesh(
    shape: str, half: Three, center: Three, stations: Array = STATIONS, swell: float = 1.0
) -> Mesh:
    """The surface of a shape, or a part of it.

    Args:
        shape: one of `finlab.layout.body.HULL_SHAPES`.
        half: half length, width and height [m].
        center: where its middle lies in the body frame [m].
        stations: where along it, from -1 to 1, rising.
        swell: how many times as large it is drawn.
    """
    x, y, z = (swell * value for value in half)
    share = _profile(shape, stations)
    mesh = revolved(stations * x, share * y, share * z, ACROSS[shape])
    return Mesh(mesh.vertices + np.array(center), mesh.faces)


def _profile(shape: str, s: Array) -> Array:
    """Share of the full width at s in [-1, 1] along a shape."""
    if shape == "torpedo":
        nose = np.sqrt(np.clip(1 - (np.clip(s - 0.6, 0, None) / 0.4) ** 2, 0, 1))
        tail = 1 - 0.62 * (np.clip(-s - 0.35, 0, None) / 0.65) ** 2
        end = np.sqrt(np.clip(1 - (np.clip(-s - 0.94, 0, None) / 0.06) ** 2, 0, 1))
        return nose * tail * end
    power = ALONG[shape]
    return np.clip(1 - np.abs(s) ** power, 0, 1) ** (1 / power)
