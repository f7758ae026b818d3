"""Fins and rudders in their own frame: the shaft along x', the blade trailing along -y' at angle zero.

A fin that points aft pushes forward, so the blade lies opposite to its thrust.
"""

import numpy as np
from trimesh.convex import convex_hull

from finlab.hull.shapes import Mesh, revolved, triangles
from webapp.scene.meshes.mesh import joined, tube

CHORD = 0.18
"""Length of the blade from the shaft to its trailing edge [m]."""
SPAN = 0.10
"""Width of the blade along the shaft [m]."""
ROOT = 0.012
"""Gap between the fin's position and the blade along the shaft [m]."""


def blade() -> Mesh:
    """The blade: thick and narrow at the shaft, thin and wide at the trailing edge."""
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 30))
    ends = np.sqrt(np.clip(1.0 - np.abs(2.0 * along - 1.0) ** 10, 0.0, 1.0))  # round
    width = 0.5 * SPAN * (0.66 + 0.36 * along**1.3) * ends
    body = revolved(along, width, (0.0075 * (1 - along) ** 0.8 + 0.0012) * ends, sides=32)
    back, side, up = body.vertices.T
    whole = convex_hull(np.stack([ROOT + SPAN / 2 + side, 0.012 - CHORD * back, up], axis=-1))
    return Mesh(np.asarray(whole.vertices), np.asarray(whole.faces, dtype=np.int32))


def shaft() -> Mesh:
    """The servo's housing at the root and the shaft that carries the blade."""
    housing = np.array([[-0.045, 0, 0], [-0.041, 0, 0], [-0.006, 0, 0], [-0.002, 0, 0]], dtype=float)
    rod = np.array([[-0.002, 0, 0], [ROOT + 0.86 * SPAN, 0, 0]], dtype=float)
    return joined(tube(housing, np.array([0.014, 0.018, 0.018, 0.013]), 20), tube(rod, 0.0055, 12))


def sweep(amplitude: float) -> Mesh:
    """The fan that the blade sweeps: +- `amplitude` [rad] about the shaft, across the blade's middle."""
    angle = np.linspace(-amplitude, amplitude, 17)
    arc = np.stack([np.full(17, ROOT + SPAN / 2), -np.cos(angle), -np.sin(angle)], axis=-1)
    rings = [arc * [1.0, radius, radius] for radius in (0.035, CHORD - 0.004)]
    k = np.arange(16)
    return Mesh(np.concatenate(rings), triangles(k, k + 1, k + 17, k + 1, k + 18, k + 17))


def foil(slenderness: float) -> Mesh:
    """A rudder of span 1 along x', its leading edge towards y' and a quarter of its chord ahead of the shaft;
    `slenderness` is its span over its chord."""
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 24))
    shape = (0.2969, -0.126, -0.3516, 0.2843, -0.1036)  # of a symmetric NACA section with a closed end
    thick = 5.0 * 0.15 * sum(c * along**p for c, p in zip(shape, (0.5, 1, 2, 3, 4), strict=True))
    points = []
    for x, chord in ((-0.5, 1.0), (0.46, 0.82), (0.5, 0.74)):
        for side in (1.0, -1.0):
            section = [
                np.full(24, x),
                (0.25 - along) * chord / slenderness,
                side * thick * chord / slenderness,
            ]
            points.append(np.stack(section, axis=-1))
    whole = convex_hull(np.concatenate(points))
    return Mesh(np.asarray(whole.vertices), np.asarray(whole.faces, dtype=np.int32))


def stock() -> Mesh:
    """The shaft of a rudder of span 1."""
    return tube(np.array([[-0.6, 0.0, 0.0], [0.54, 0.0, 0.0]]), 0.035, 12)


def pin(size: float) -> Mesh:
    """A nail through what is stuck."""
    way = size * np.array([[0.0, 0.0, -0.04], [0.0, 0.0, 0.06], [0.0, 0.0, 0.06], [0.0, 0.0, 0.066]])
    return tube(way, size * np.array([0.004, 0.004, 0.016, 0.016]), 14)
