"""Many bodies in water that moves, side by side: what a fit integrates thousands of times.

Their states (12, ...) are position in the world [m], attitude angles roll, pitch, yaw [rad] (about
z, then y, then x) in place of the quaternion of `vehicle.py`, velocity over ground [m/s] and
angular rates [rad/s] in the body frame. The axes after the first are those of the bodies.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from finlab.arrays import Array
from finlab.swim.vehicle.attitude import rotation_of_angles, to_body, to_world
from finlab.swim.vehicle.fossen import Dynamics, accelerations
from finlab.swim.vehicle.integration import runge_kutta_step

Bodies = Dynamics
"""Numbers of many bodies; what follows the first axis must broadcast with the states'."""


def derivative(
    state: Sequence[Array], wrench: Array, bodies: Bodies, current: Array
) -> list[Array]:
    """Returns the rates of change of states, 12 arrays (...).

    Args:
        state: the states, 12 arrays (...), or one array (12, ...).
        wrench: tau (6, ...) in the body frame [N, N m].
        bodies: their numbers.
        current: horizontal velocity (2, ...) of the water in the world [m/s].
    """
    roll, pitch, _ = state[3:6]
    u, v, w, p, q, r = state[6:]
    rotation = rotation_of_angles(np.asarray(state[3:6]))
    up = rotation[2::3]
    east, north = current
    cu, cv, cw = to_body(rotation, east, north, 0.0)
    nu_r = (u - cu, v - cv, w - cw, p, q, r)
    surge, sway, heave, *angular = accelerations(bodies, nu_r, up, wrench)

    # Rates of attitude angles, (2.28) of Fossen: yaw' = (q sin roll + r cos roll) / cos pitch.
    cos_roll = np.cos(roll)
    sin_roll = np.sin(roll)
    yaw_rate = (q * sin_roll + r * cos_roll) / np.cos(pitch)
    return [
        *to_world(rotation, u, v, w),
        p - yaw_rate * up[0],  # up[0] is minus the sine of the pitch
        q * cos_roll - r * sin_roll,
        yaw_rate,
        # nu' = nu_r' - omega x (current in the body frame)
        surge - (q * cw - r * cv),
        sway - (r * cu - p * cw),
        heave - (p * cv - q * cu),
        *angular,
    ]


def integrate(state: Array, wrench: Array, bodies: Bodies, current: Array, dt: float) -> Array:
    """Returns the states (L, 12, ...) at the beginnings of L steps, by Runge-Kutta of order 4.

    Args:
        state: the first states (12, ...).
        wrench: tau (L, 6, ...) in each step, carried along by the bodies [N, N m].
        bodies: their numbers.
        current: horizontal velocity (2, ...) of the water in the world [m/s].
        dt: length of a step [s].
    """
    states = np.empty((len(wrench), *np.broadcast_shapes(state.shape, (12, *wrench.shape[2:]))))
    states[0] = state
    for k in range(len(wrench) - 1):
        rate = partial(derivative, wrench=wrench[k], bodies=bodies, current=current)
        states[k + 1] = runge_kutta_step(rate, list(states[k]), dt)
    return states


def body_rates(angles: Array, angle_rates: Array) -> Array:
    """Returns the angular rates p, q, r (N, 3) [rad/s] of attitudes that change.

    Args:
        angles: roll, pitch, yaw (N, 3) [rad].
        angle_rates: their rates of change (N, 3) [rad/s].
    """
    cos_roll, cos_pitch, _ = np.cos(angles.T)
    sin_roll, sin_pitch, _ = np.sin(angles.T)
    roll, pitch, yaw = angle_rates.T
    p = roll - sin_pitch * yaw
    q = cos_roll * pitch + sin_roll * cos_pitch * yaw
    r = cos_roll * cos_pitch * yaw - sin_roll * pitch
    return np.stack([p, q, r], axis=-1)


def body_velocity(angles: Array, velocity: Array) -> Array:
    """Returns velocities (N, 3) in the body frame [m/s].

    Args:
        angles: roll, pitch, yaw (N, 3) [rad].
        velocity: the same velocities (N, 3) in the world [m/s].
    """
    return np.stack(to_body(rotation_of_angles(angles.T), *velocity.T), axis=-1)
