"""The geometry of a layout's forces, for numpy's arrays and torch's tensors."""

from typing import Any

import numpy as np

from finlab.arrays import Array, library_of
from finlab.layout.layout import Layout


def force_effectiveness(position: Any, mounting_angle: Any) -> Any:
    """Returns what one newton along each fin's three axes does to the robot.

    Args:
        position: (..., n, 3), body frame [m]; an array or a tensor.
        mounting_angle: (..., n) [rad].

    Returns:
        (..., n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along shaft, e_h and e_z.
    """
    xp = library_of(position)
    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    c, s = xp.cos(mounting_angle), xp.sin(mounting_angle)
    zero, one = xp.zeros_like(x), xp.ones_like(x)
    shaft = [c, s, zero, -z * s, z * c, x * s - y * c]
    horizontal = [-s, c, zero, -z * c, -z * s, x * c + y * s]
    vertical = [zero, zero, one, y, -x, zero]
    return xp.stack([xp.stack(axis, axis=-1) for axis in (shaft, horizontal, vertical)], axis=-2)


def own_effectiveness(layout: Layout) -> Array:
    """What one newton along each actuator's own three axes does to the robot.

    Returns:
        (n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along each row of `layout.frames`,
        with the reaction torque of propellers about the direction of their force.
    """
    return moved_effectiveness(layout, layout.position, layout.frames)


def moved_effectiveness(layout: Layout, position: Array, frames: Array) -> Array:
    """The same (..., n, 3, 6) of actuators at positions (..., n, 3) [m] with own axes (..., n, 3, 3)."""
    reaction = np.array([getattr(part, "torque_per_newton", 0.0) for part in layout.actuators])
    torque = np.cross(position[..., None, :], frames) + reaction[:, None, None] * frames
    return np.concatenate([frames, torque], axis=-1)


def layout_effectiveness(layout: Layout) -> Array:
    """What one newton along each direction in which an actuator pushes does to the robot.

    Returns:
        (6, m): wrench [Fx, Fy, Fz, Tx, Ty, Tz] of 1 N, actuators side by side: of a fin along zero and along
        shaft x zero, which are e_h and e_z of a horizontal shaft, of a thruster along its axis, of an azimuth
        along zero and turn_axis x zero, of a rudder along shaft x zero, its lift ahead.
    """
    pairs = zip(own_effectiveness(layout), layout.actuators, strict=True)
    return np.concatenate([own[list(actuator.PUSHES)] for own, actuator in pairs]).T
