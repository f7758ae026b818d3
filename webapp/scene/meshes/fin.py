"""One fin in its own frame: the shaft along x', the blade trailing along -y' at zero direction zero.

A fin that points aft pushes forward, so the blade lies opposite to its thrust.
"""

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from webapp.scene.meshes.mesh import Mesh, joined, triangles, tube

CHORD = 0.18
"""Length of the blade from the shaft to its trailing edge [m]."""
SPAN = 0.10
"""Width of the blade along the shaft [m]."""
ROOT = 0.012
"""Gap between the fin's position and the blade along the shaft [m]."""


def blade() -> Mesh:
    """The blade: thick and narrow at the shaft, thin and wide at the trailing edge, a little cambered."""
    rows, columns = 22, 15
    along = np.linspace(0.0, 1.0, rows)
    across = np.linspace(-1.0, 1.0, columns)
    # Rounded corners at both ends come from shrinking the first and last rows' width.
    width = (0.62 + 0.38 * along**1.3) * np.clip(1 - np.clip((along - 0.86) / 0.14, 0, 1) ** 2.6 * 0.55, 0, 1)
    width *= np.clip(0.72 + along / 0.12 * 0.28, None, 1.0)
    middle = ROOT + SPAN / 2
    x = middle + 0.5 * SPAN * width[:, None] * across[None]
    # The trailing edge is a shallow fork, as of a fish's tail.
    y = -CHORD * along[:, None] * (1 - 0.07 * along[:, None] ** 4 * (1 - across[None] ** 2)) + 0.012
    rim = np.sqrt(np.clip(1 - across**2, 0, 1))[None]
    thickness = (0.0075 * (1 - along) ** 0.8 + 0.0012)[:, None] * (0.15 + 0.85 * rim)
    thickness[[0, -1]] *= 0.3
    camber = 0.006 * (1 - across[None] ** 2) * np.sin(np.pi * along)[:, None]
    top = np.stack([x, y, camber + thickness], axis=-1).reshape(-1, 3)
    bottom = np.stack([x, y, camber - thickness], axis=-1).reshape(-1, 3)
    return Mesh(np.concatenate([top, bottom]), _shell_faces(rows, columns))


def _shell_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Upper side, lower side, and the strip around the edge."""
    place = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = place[:-1, :-1], place[:-1, 1:], place[1:, :-1], place[1:, 1:]
    low = place.size  # from a point of the upper side to the one below it
    sides = triangles(a, c, b, b, c, d, a + low, b + low, c + low, b + low, d + low, c + low)
    edge = np.concatenate([place[0], place[1:, -1], place[-1, -2::-1], place[-2:0:-1, 0]])
    following = np.roll(edge, -1)
    strip = triangles(edge, following, edge + low, following, following + low, edge + low)
    return np.concatenate([sides, strip])


def shaft() -> Mesh:
    """The servo's housing at the root and the shaft that carries the blade."""
    housing = np.array([[-0.045, 0, 0], [-0.041, 0, 0], [-0.006, 0, 0], [-0.002, 0, 0]], dtype=float)
    rod = np.array([[-0.002, 0, 0], [ROOT + 0.86 * SPAN, 0, 0]], dtype=float)
    return joined(tube(housing, np.array([0.014, 0.018, 0.018, 0.013]), 20), tube(rod, 0.0055, 12))


def mounting(angle: float) -> Array:
    """The matrix (3, 3) from the frame of a fin under a mounting angle [rad] to the body frame."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def sweep(amplitude: float) -> Mesh:
    """The fan that the blade sweeps: +- `amplitude` [rad] about the shaft, across the blade's middle."""
    angle = np.linspace(-amplitude, amplitude, 17)
    arc = np.stack([np.full(17, ROOT + SPAN / 2), -np.cos(angle), -np.sin(angle)], axis=-1)
    rings = [arc * [1.0, radius, radius] for radius in (0.035, CHORD - 0.004)]
    k = np.arange(16)
    return Mesh(np.concatenate(rings), triangles(k, k + 1, k + 17, k + 1, k + 18, k + 17))
