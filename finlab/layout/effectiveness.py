"""The effectiveness matrix B of Eq. 1: from forces along own axes to body frame and wrench.

The plant, the methods and the networks use it, with numpy arrays and torch tensors.

Fin frame x' = shaft, y' = e_h, z' = e_z (see `finlab.actuators.fin.fin`); body frame FLU about the
centre of gravity. Wrench order [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m.
"""

from typing import Any

import numpy as np

from finlab.arrays import Array, Values, library_of
from finlab.layout.layout import Layout


def force_effectiveness(position: Any, mounting_angle: Any) -> Any:
    """Returns the effectiveness of fins with horizontal shafts.

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
    # Each row is an axis a, then the torque r x a of 1 N along it.
    shaft = [c, s, zero, -z * s, z * c, x * s - y * c]
    horizontal = [-s, c, zero, -z * c, -z * s, x * c + y * s]
    vertical = [zero, zero, one, y, -x, zero]
    rows = [xp.stack(axis, axis=-1) for axis in (shaft, horizontal, vertical)]
    return xp.stack(rows, axis=-2)


def own_effectiveness(layout: Layout) -> Array:
    """Returns the effectiveness of each actuator along its own axes.

    Args:
        layout: the robot.

    Returns:
        (n, 3, 6): wrench [Fx, Fy, Fz, Tx, Ty, Tz] about the origin of 1 N along each row of
        `layout.frames`, with the reaction torque of propellers about the direction of their force.
    """
    return moved_effectiveness(layout, layout.position, layout.frames)


def moved_effectiveness(layout: Layout, position: Array, frames: Array) -> Array:
    """Returns `own_effectiveness` of a layout whose actuators have been moved.

    Args:
        layout: the robot, whose propellers have a reaction torque.
        position: points (..., n, 3) where the forces act, body frame [m].
        frames: own axes (..., n, 3, 3), rows in the body frame.

    Returns:
        (..., n, 3, 6): wrench about the origin of 1 N along each own axis [1, m].
    """
    torque_per_newton = [
        getattr(actuator, "torque_per_newton", 0.0) for actuator in layout.actuators
    ]
    reaction = np.array(torque_per_newton)[:, None, None] * frames
    # tau = r x a + k a, with the reaction torque k a about the force
    torque = np.cross(position[..., None, :], frames) + reaction
    return np.concatenate([frames, torque], axis=-1)


def layout_effectiveness(layout: Layout) -> Array:
    """Returns the effectiveness matrix of a layout, by the directions in which actuators push.

    Args:
        layout: the robot.

    Returns:
        (6, m): wrench [Fx, Fy, Fz, Tx, Ty, Tz] of 1 N, actuators side by side: of a fin along zero
        and along shaft x zero, which are e_h and e_z of a horizontal shaft, of a thruster along its
        axis, of an azimuth along zero and turn_axis x zero, of a rudder along shaft x zero, its
        lift ahead.
    """
    columns = []
    for effectiveness, actuator in zip(own_effectiveness(layout), layout.actuators, strict=True):
        columns.append(effectiveness[list(actuator.KIND.push_rows)])
    return np.concatenate(columns).T


def body_force(own_force: Values, frames: Values) -> Values:
    """Returns forces rotated from the actuators' own frames to the body frame.

    Args:
        own_force: (..., 3) along own axes [N].
        frames: (..., 3, 3), own axes in the rows, such as `layout.frames`.

    Returns:
        (..., 3) along body (x, y, z) [N].
    """
    return (own_force[..., None, :] @ frames)[..., 0, :]


def wrench_of_forces(fin_force: Values, effectiveness: Values) -> Values:
    """Returns the wrenches of forces, w = sum_i B_i y_i (Eq. 1).

    Args:
        fin_force: forces (..., n, 3), own frames [N]; an array or a tensor.
        effectiveness: wrenches (..., n, 3, 6) of 1 N along own axes [1, m]; leading axes broadcast
            with those of the forces.

    Returns:
        (..., 6) [N, N m], body frame.
    """
    n = fin_force.shape[-2]
    flat = effectiveness.reshape(*effectiveness.shape[:-3], 3 * n, 6)
    if flat.ndim == 2:
        return fin_force.reshape(*fin_force.shape[:-2], 3 * n) @ flat
    row = fin_force.reshape(*fin_force.shape[:-2], 1, 3 * n)
    return (row @ flat)[..., 0, :]
