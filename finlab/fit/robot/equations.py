"""Fossen's equations for many robots at once, in attitude angles: what a fit integrates thousands of times.

State (12, ...): position in the world [m], roll, pitch, yaw [rad] (about z, then y, then x), velocity over
ground [m/s] and angular rates [rad/s] in the body frame. The equations are those of `finlab.physics.vehicle`,
which a test holds them against.
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array


class Bodies(NamedTuple):
    """Parameters of bodies; what follows the first axis must broadcast with the states'."""

    inertia: Array
    """With added mass (6, ...) [kg, kg m^2]."""
    linear: Array
    """Damping (6, ...) per speed."""
    quadratic: Array
    """Damping (6, ...) per speed times its size."""
    weight: Array
    """(...) [N]."""
    lift: Array
    """Buoyant force (...) [N]."""
    center: Array
    """Centre of buoyancy (3, ...) as seen from the centre of gravity [m]."""
    current: Array
    """Velocity of the water in the world (2, ...), level [m/s]."""


def derivative(state: Array, wrench: Array, body: Bodies) -> Array:
    """Rate of change (12, ...) of states under wrenches (6, ...) [N, N m]."""
    r11, r21, r31, r12, r22, r32, r13, r23, r33 = _turn(state)
    u, v, w, p, q, r = state[6:]
    cx, cy = body.current
    cu, cv, cw = r11 * cx + r21 * cy, r12 * cx + r22 * cy, r13 * cx + r23 * cy
    flow = np.stack([u - cu, v - cv, w - cw, p, q, r])
    px, py, pz, hx, hy, hz = body.inertia * flow
    force = wrench - (body.linear + body.quadratic * np.abs(flow)) * flow
    net, (bx, by, bz) = body.lift - body.weight, body.lift * body.center
    ur, vr, wr = flow[:3]
    force[0] += net * r31 - (q * pz - r * py)
    force[1] += net * r32 - (r * px - p * pz)
    force[2] += net * r33 - (p * py - q * px)
    force[3] += by * r33 - bz * r32 - (q * hz - r * hy) - (vr * pz - wr * py)
    force[4] += bz * r31 - bx * r33 - (r * hx - p * hz) - (wr * px - ur * pz)
    force[5] += bx * r32 - by * r31 - (p * hy - q * hx) - (ur * py - vr * px)
    pace = np.empty_like(state)
    pace[0] = r11 * u + r12 * v + r13 * w
    pace[1] = r21 * u + r22 * v + r23 * w
    pace[2] = r31 * u + r32 * v + r33 * w
    cr, sr, cp = np.cos(state[3]), np.sin(state[3]), np.cos(state[4])
    turning = (q * sr + r * cr) / cp
    pace[3] = p - turning * r31  # r31 is minus the sine of the pitch
    pace[4] = q * cr - r * sr
    pace[5] = turning
    pace[6:] = force / body.inertia
    pace[6] -= q * cw - r * cv
    pace[7] -= r * cu - p * cw
    pace[8] -= p * cv - q * cu
    return pace


def integrate(state: Array, wrench: Array, body: Bodies, dt: float) -> Array:
    """States (L, 12, ...) at the beginnings of L steps of `dt` [s], from the first one (12, ...), under
    wrenches (L, 6, ...) that the body carries along: Runge-Kutta of order 4."""
    found = np.empty((len(wrench), *np.broadcast_shapes(state.shape, (12, *wrench.shape[2:]))))
    found[0] = state
    for k in range(len(wrench) - 1):
        y, tau = found[k], wrench[k]
        k1 = derivative(y, tau, body)
        k2 = derivative(y + 0.5 * dt * k1, tau, body)
        k3 = derivative(y + 0.5 * dt * k2, tau, body)
        k4 = derivative(y + dt * k3, tau, body)
        found[k + 1] = y + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return found


def body_rates(angles: Array, pace: Array) -> Array:
    """Angular rates (N, 3) of attitude angles (N, 3) that change by (N, 3) [rad/s]."""
    cr, sr = np.cos(angles[:, 0]), np.sin(angles[:, 0])
    cp, sp = np.cos(angles[:, 1]), np.sin(angles[:, 1])
    roll, pitch, yaw = pace.T
    return np.stack([roll - sp * yaw, cr * pitch + sr * cp * yaw, cr * cp * yaw - sr * pitch], axis=-1)


def body_velocity(angles: Array, velocity: Array) -> Array:
    """Velocities in the world (N, 3) as bodies of attitudes (N, 3) see them."""
    state = np.zeros((12, len(angles)))
    state[3:6] = angles.T
    turn = np.array(_turn(state)).reshape(3, 3, -1)
    result: Array = np.einsum("bwn,nw->nb", turn, velocity)
    return result


def _turn(state: Array) -> tuple[Array, ...]:
    """The rotation from body to world, column by column: nine numbers of shape (...)."""
    cr, sr = np.cos(state[3]), np.sin(state[3])
    cp, sp = np.cos(state[4]), np.sin(state[4])
    cy, sy = np.cos(state[5]), np.sin(state[5])
    first = cy * cp, sy * cp, -sp
    second = cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr
    third = cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr
    return (*first, *second, *third)
