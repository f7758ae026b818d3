"""Arrows of the whole robot's wrench: straight ones for forces, rings for torques."""

import numpy as np
from numpy.typing import NDArray

from webapp.scene.meshes.mesh import Mesh, tube
from webapp.theme import TORQUE_SCALE

Array = NDArray[np.float64]

SHORTEST = 1e-3
"""Arrows shorter than this are not drawn [m]."""
SMALLEST_TORQUE = 0.005
"""Torques below this are not drawn [N m]."""
RING_RADIUS = 0.12
"""Radius of a torque ring [m]."""
NOTHING = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
"""A mesh that shows nothing; a node keeps its name while it has nothing to show."""


def force_arrow(way: Array, start: Array, thickness: float) -> Mesh:
    """A straight arrow from `start` (3,) along `way` (3,) [m]: a force times the scale of the arrows."""
    length = float(np.linalg.norm(way))
    if length < SHORTEST:
        return NOTHING
    direction = np.asarray(way) / length
    head = min(5.0 * thickness, 0.6 * length)
    stations = np.array([0.0, length - head, length - head, length])
    radii = thickness * np.array([1.0, 1.0, 2.6, 0.02])
    return tube(np.asarray(start) + stations[:, None] * direction, radii, 18)


def torque_ring(torque: Array, center: Array, thickness: float, radius: float = RING_RADIUS) -> Mesh:
    """A ring arrow about a torque (3,) [N m] by the right-hand rule; its angle is the torque's size."""
    size = float(np.linalg.norm(torque))
    if size < SMALLEST_TORQUE:
        return NOTHING
    axis = np.asarray(torque) / size
    # The arrow starts astern, out of the way of the force arrow, which mostly points ahead.
    astern = np.array([-1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = astern - axis * (astern @ axis)
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = min(size * TORQUE_SCALE, np.radians(330.0))
    head = min(5.0 * thickness / radius, 0.6 * angle)
    body = np.linspace(0.0, angle - head, 40)
    tip = np.linspace(angle - head, angle, 8)
    turn = np.concatenate([body, tip])
    radii = np.concatenate([np.full(40, thickness), thickness * np.linspace(2.6, 0.02, 8)])
    circle = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    return tube(np.asarray(center) + radius * circle, radii, 14, across=axis)
