"""A ducted propeller and what holds it, of size 1: the water goes along x', or along y' for a pod."""

from functools import cache

import numpy as np

from finlab.arrays import Array
from finlab.hull.shapes import Mesh, revolved, triangles
from webapp.scene.meshes.mesh import joined, tube

RADIUS = 0.046
"""Of the duct [m]."""
N_BLADES = 3
COLUMN: Array = RADIUS * np.array([[1.02, 0.0, 0.0], [1.12, 0.0, 0.0], [1.12, 0.0, 0.0], [2.2, 0.0, 0.0]])
"""Steps of the column about which a pod turns [m]."""


@cache
def duct(along: int) -> Mesh:
    """A short ring, a hub, and three struts between them; `along` is 0 for x', 1 for y'."""
    section = np.linspace(0.0, 2.0 * np.pi, 17)
    x = 0.5 * np.cos(section)
    radius = 1.0 - 0.07 * np.sin(section) + 0.06 * x  # a little wider where water comes in
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    rim = [np.broadcast_to(x[:, None], (17, 40)), *(radius[:, None] * f(turn) for f in (np.cos, np.sin))]
    k, n = np.meshgrid(np.arange(16), np.arange(40), indexing="ij")
    a, b = (40 * k + n).ravel(), (40 * k + (n + 1) % 40).ravel()
    ring = Mesh(np.stack(rim, axis=-1).reshape(-1, 3), triangles(a, b, a + 40, b, b + 40, a + 40))
    s = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 13))
    round_ = 0.25 * np.sqrt(1.0 - s**2) + 1e-4
    hub = revolved(0.62 * s - 0.12, round_, round_, sides=20)
    spokes = [
        tube(np.array([[-0.32, 0, 0], [-0.32, np.cos(t), np.sin(t)]]), 0.05, 8) for t in turn[[0, 13, 27]]
    ]
    return _along(joined(ring, hub, *spokes), along)


@cache
def propeller(along: int) -> Mesh:
    """Three twisted blades, ahead of the struts; a node shows both their sides."""
    radius, share = np.linspace(0.2, 0.9, 9), np.linspace(-0.5, 0.5, 5)
    pitch = np.arctan(0.42 / radius)[:, None]
    chord = (0.42 * np.sqrt(np.clip(1.0 - ((radius - 0.55) / 0.62) ** 2, 0.0, 1.0)))[:, None] * share
    place = np.stack([0.1 + chord * np.sin(pitch), radius[:, None] + 0 * chord, chord * np.cos(pitch)], -1)
    k, n = (v.ravel() for v in np.meshgrid(np.arange(8), np.arange(4), indexing="ij"))
    a = 5 * k + n
    faces = triangles(a, a + 1, a + 5, a + 1, a + 6, a + 5)
    blades = []
    for turn in 2.0 * np.pi * np.arange(N_BLADES) / N_BLADES:
        c, s = np.cos(turn), np.sin(turn)
        blades.append(Mesh(place.reshape(-1, 3) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), faces))
    return _along(joined(*blades), along)


def column(up: bool) -> Mesh:
    """What a pod turns about: from its duct towards the hull, on one side or the other."""
    radius = RADIUS * np.array([0.2, 0.34, 0.24, 0.24])
    return tube(COLUMN if up else -COLUMN, radius, 16)


def _along(mesh: Mesh, along: int) -> Mesh:
    """A mesh of radius 1 along x', as large as a thruster, along another axis."""
    return Mesh(RADIUS * np.roll(mesh.vertices, along, axis=1), mesh.faces)
