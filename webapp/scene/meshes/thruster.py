"""One thruster in its own frame: a duct around the axis of its force, with a hub in the middle."""

import numpy as np

from finlab.arrays import Array
from webapp.scene.meshes.mesh import Mesh, joined, tube

RADIUS, WALL = 0.038, 0.009
"""Of the duct and of its wall [m]."""
HUB: Array = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
"""Ends of the hub [m]."""


def duct() -> Mesh:
    """A ring around x' and a hub along it."""
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    circle = RADIUS * np.stack([np.zeros(33), np.cos(turn), np.sin(turn)], axis=-1)
    spoke = np.array([[0.0, -RADIUS, 0.0], [0.0, RADIUS, 0.0]])
    ring = tube(circle, WALL, 12, across=np.array([1.0, 0.0, 0.0]))
    return joined(ring, tube(HUB, 0.011, 14), tube(spoke, 0.004, 8))


def pod() -> Mesh:
    """The same around y', for a thruster that turns about x'."""
    mesh = duct()
    return Mesh(mesh.vertices[:, [2, 0, 1]], mesh.faces)
