"""Hulls drawn from a shape and a size: a closed profile along x with a superelliptic cross-section."""

import numpy as np

from finlab.arrays import Array
from finlab.hull.mesh import Mesh, revolved

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
