"""The geometry of forces, for numpy's arrays and torch's tensors: own axes, body frame, wrench.

Fin frame x' = shaft, y' = e_h, z' = e_z (see `finlab.actuators.fin.fin`); body frame FLU about the
centre of gravity. Wrench order [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m.
"""

from typing import Any

import numpy as np

from finlab.arrays import Array, Values, library_of
from finlab.layout.layout import Layout


def force_effectiveness(position: Any, mounting_angle: Any) -> Any:
    """Returns what one newton along each fin's three axes does to the robot.

    Args:
        position: (..., n, 3), body frame [m]; an array or a tensor.
        mounting_angle: (..., n) [rad].

    Returns:
        (..., n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along shaft, e_h and
        e_z.
    """
    xp = library_of(position)
    x = position[..., 0]
    y = position[..., 1]
    z = position[..., 2]
    c = xp.cos(mounting_angle)
    s = xp.sin(mounting_angle)
    zero = xp.zeros_like(x)
    one = xp.ones_like(x)
    shaft = [c, s, zero, -z * s, z * c, x * s - y * c]
    horizontal = [-s, c, zero, -z * c, -z * s, x * c + y * s]
    vertical = [zero, zero, one, y, -x, zero]
    return xp.stack([xp.stack(axis, axis=-1) for axis in (shaft, horizontal, vertical)], axis=-2)


def own_effectiveness(layout: Layout) -> Array:
    """What one newton along each actuator's own three axes does to the robot.

    Returns:
        (n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along each row of
        `layout.frames`, with the reaction torque of propellers about the direction of their force.
    """
    return moved_effectiveness(layout, layout.position, layout.frames)


def moved_effectiveness(layout: Layout, position: Array, frames: Array) -> Array:
    """The same (..., n, 3, 6) of actuators at positions (..., n, 3) [m] with own axes (..., n, 3,
    3)."""
    reaction = np.array([getattr(part, "torque_per_newton", 0.0) for part in layout.actuators])
    torque = np.cross(position[..., None, :], frames) + reaction[:, None, None] * frames
    return np.concatenate([frames, torque], axis=-1)


def layout_effectiveness(layout: Layout) -> Array:
    """What one newton along each direction in which an actuator pushes does to the robot.

    Returns:
        (6, m): wrench [Fx, Fy, Fz, Tx, Ty, Tz] of 1 N, actuators side by side: of a fin along zero
        and along shaft x zero, which are e_h and e_z of a horizontal shaft, of a thruster along its
        axis, of an azimuth along zero and turn_axis x zero, of a rudder along shaft x zero, its
        lift ahead.
    """
    pairs = zip(own_effectiveness(layout), layout.actuators, strict=True)
    return np.concatenate([own[list(actuator.KIND.push_rows)] for own, actuator in pairs]).T


def body_force(own_force: Values, frames: Values) -> Values:
    """Turns forces from the actuators' own frames to the body frame.

    Args:
        own_force: (..., 3) along own axes [N].
        frames: (..., 3, 3), own axes in the rows, such as `layout.frames`.

    Returns:
        (..., 3) along body (x, y, z) [N].
    """
    return (own_force[..., None, :] @ frames)[..., 0, :]


def wrench_of_forces(fin_force: Values, effectiveness: Values) -> Values:
    """Sums forces (..., n, 3) [N] in fin frames to wrenches (..., 6) [N, N m].

    Args:
        fin_force: broadcast with the effectiveness.
        effectiveness: wrench per newton of each fin (..., n, 3, 6), from `force_effectiveness`.
    """
    n = fin_force.shape[-2]
    flat = effectiveness.reshape(*effectiveness.shape[:-3], 3 * n, 6)
    if flat.ndim == 2:
        return fin_force.reshape(*fin_force.shape[:-2], 3 * n) @ flat
    row = fin_force.reshape(*fin_force.shape[:-2], 1, 3 * n)
    return (row @ flat)[..., 0, :]
