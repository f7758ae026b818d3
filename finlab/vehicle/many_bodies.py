"""Many bodies side by side, in attitude angles: what a fit integrates thousands of times.

State (12, ...): position in the world [m], roll, pitch, yaw [rad] (about z, then y, then x), velocity over
ground [m/s] and angular rates [rad/s] in the body frame.
"""

import numpy as np

from finlab.arrays import Array
from finlab.vehicle.attitude import rotation_of_angles, to_body, to_world
from finlab.vehicle.fossen import Dynamics, accelerations

Bodies = Dynamics[Array, Array]
"""Numbers of many bodies; what follows the first axis must broadcast with the states'."""


def derivative(state: Array, wrench: Array, body: Bodies, current: Array) -> Array:
    """Rate of change (12, ...) of states under wrenches (6, ...) [N, N m], in a current (2, ...) [m/s]."""
    rotation = rotation_of_angles(state[3:6])
    u, v, w, p, q, r = state[6:]
    east, north = current
    cu, cv, cw = to_body(rotation, east, north, 0.0)
    up = rotation[2::3]
    pace = np.empty_like(state)
    pace[:3] = to_world(rotation, u, v, w)
    cr, sr, cp = np.cos(state[3]), np.sin(state[3]), np.cos(state[4])
    turning = (q * sr + r * cr) / cp
    pace[3] = p - turning * up[0]  # up[0] is minus the sine of the pitch
    pace[4] = q * cr - r * sr
    pace[5] = turning
    pace[6:] = accelerations(body, (u - cu, v - cv, w - cw, p, q, r), up, wrench)
    pace[6] -= q * cw - r * cv
    pace[7] -= r * cu - p * cw
    pace[8] -= p * cv - q * cu
    return pace


def integrate(state: Array, wrench: Array, body: Bodies, current: Array, dt: float) -> Array:
    """States (L, 12, ...) at the beginnings of L steps of `dt` [s], from the first one (12, ...), under
    wrenches (L, 6, ...) that the body carries along: Runge-Kutta of order 4."""
    found = np.empty((len(wrench), *np.broadcast_shapes(state.shape, (12, *wrench.shape[2:]))))
    found[0] = state
    for k in range(len(wrench) - 1):
        y, tau = found[k], wrench[k]
        k1 = derivative(y, tau, body, current)
        k2 = derivative(y + 0.5 * dt * k1, tau, body, current)
        k3 = derivative(y + 0.5 * dt * k2, tau, body, current)
        k4 = derivative(y + dt * k3, tau, body, current)
        found[k + 1] = y + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return found


def body_rates(angles: Array, pace: Array) -> Array:
    """Angular rates (N, 3) of attitude angles (N, 3) that change by (N, 3) [rad/s]."""
    (cr, cp, _), (sr, sp, _) = np.cos(angles.T), np.sin(angles.T)
    roll, pitch, yaw = pace.T
    return np.stack([roll - sp * yaw, cr * pitch + sr * cp * yaw, cr * cp * yaw - sr * pitch], axis=-1)


def body_velocity(angles: Array, velocity: Array) -> Array:
    """Velocities in the world (N, 3) as bodies of attitudes (N, 3) see them."""
    return np.stack(to_body(rotation_of_angles(angles.T), *velocity.T), axis=-1)
