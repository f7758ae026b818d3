"""Bodies in water that moves: one vehicle, and many side by side, their states, rates of change and
steps.

State (13,): position in the world [m], quaternion (w, x, y, z), velocity over ground [m/s] and
angular rates [rad/s] in the body frame. The water moves without rotation, so nu' = nu_r' - omega x
(current in body) + (its acceleration in body). Where it accelerates, it carries the body along by
the pressure that it accelerates itself with: M nu_r' says so of a body as heavy as the water in its
place; the buoyant force leans with it. Of one vehicle, plain floats: at this size they are several
times faster than arrays.

Many bodies, which a fit integrates thousands of times, have states (12, ...) with attitude angles
roll, pitch, yaw [rad] (about z, then y, then x) in place of the quaternion.
"""

import math
from collections.abc import Sequence

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.layout import Body
from finlab.swim.vehicle.attitude import (
    rotation_of_angles,
    rotation_of_quaternion,
    to_body,
    to_world,
)
from finlab.swim.vehicle.fossen import Dynamics, accelerations, damping_jacobian, dynamics_of

STATE_SIZE = 13
LONGEST, MOST_STEPS = 1.5, 500
"""Times what is fastest in a motion that a step may last, well within what Runge-Kutta (2.8) and
the midpoint rule (2) bear; and into how many steps at most a period is cut for a body that water
stops almost at once."""


class Vehicle:
    """The dynamics of one vehicle; it holds no state."""

    def __init__(self, body: Body, current: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Takes a body and the water's velocity (3,) in the world [m/s]; what the body does not say
        is zero. Raises LayoutError: the body has no mass or no inertia."""
        self.current = tuple(float(value) for value in current)
        """Velocity of the water (3,) in the world [m/s]."""
        if len(self.current) != 3 or not all(map(math.isfinite, self.current)):
            raise LayoutError(
                f"expected a velocity of three finite numbers, got {current!r:.60}", "current"
            )
        self.dynamics = dynamics = dynamics_of(body)
        self.inertia = dynamics.inertia
        """Diagonal of M (6,) [kg, kg m^2]."""
        self.weight, self.lift = dynamics.weight, dynamics.lift
        """Weight and buoyant force [N]."""
        uneven = max(self.inertia[:3]) - min(self.inertia[:3])
        self._munk = math.sqrt(uneven / min(self.inertia[3:]))
        self._rate_at_rest = max(damping_jacobian(dynamics, (0.0,) * 6))
        quadratic = max(b / m for b, m in zip(dynamics.quadratic, self.inertia, strict=True))
        self._rate_by_speed = 2.0 * quadratic + self._munk + 1.0

    def n_steps(self, motion: Sequence[float], dt: float) -> int:
        """Into how many equal steps `dt` [s] has to be cut so that integrating it stays stable.

        One for a robot as robots are; more where damping, Munk's moments or its own turning change
        the motion
        (6,) [m/s, rad/s] within `dt`, as of a light body that water holds fast, or of one that
        tumbles. Raises LayoutError: even `MOST_STEPS` would not do."""
        cx, cy, cz = self.current
        stream = abs(cx) + abs(cy) + abs(cz)
        if (
            dt * (self._rate_at_rest + self._rate_by_speed * (max(map(abs, motion)) + stream))
            <= LONGEST
        ):
            return 1  # as nearly always: known from a bound, which takes less time
        u, v, w, p, q, r = map(abs, motion)
        speeds = (u + stream, v + stream, w + stream, p, q, r)
        damping: float = max(damping_jacobian(self.dynamics, speeds))
        often = damping + self._munk * max(speeds[:3]) + max(speeds[3:])
        most = MOST_STEPS * LONGEST / dt
        if not often <= most:  # nor where it is no number any more
            got = f"{often:.2g} times a second" if math.isfinite(often) else "beyond all bounds"
            raise LayoutError(
                f"its motion changes {got}, at most {most:g} can be simulated; check mass, "
                "inertia, "
                "added mass, damping and buoyancy",
                "body",
            )
        return max(1, math.ceil(often * dt / LONGEST))

    def derivative(self, state: Sequence[float], wrench: Sequence[float]) -> list[float]:
        """Rate of change (13,) of a state under a wrench (6,) in the body frame [N, N m]."""
        _, _, _, qw, qx, qy, qz, u, v, w, p, q, r = state
        rotation = rotation_of_quaternion(qw, qx, qy, qz)
        up = rotation[2::3]
        cu, cv, cw = to_body(rotation, *self.current)
        flow = (u - cu, v - cv, w - cw, p, q, r)
        surge, sway, heave, roll, pitch, yaw = accelerations(self.dynamics, flow, up, wrench)
        return [
            *to_world(rotation, u, v, w),
            0.5 * (-qx * p - qy * q - qz * r),
            0.5 * (qw * p + qy * r - qz * q),
            0.5 * (qw * q + qz * p - qx * r),
            0.5 * (qw * r + qx * q - qy * p),
            surge - (q * cw - r * cv),
            sway - (r * cu - p * cw),
            heave - (p * cv - q * cu),
            roll,
            pitch,
            yaw,
        ]

    def velocity_in_water(self, state: Array) -> Array:
        """Velocity relative to the water and angular rates (6,) of a state, body frame [m/s,
        rad/s]."""
        velocity = state[7:].copy()
        if any(self.current):
            velocity[:3] -= to_body(rotation_of_quaternion(*state[3:7].tolist()), *self.current)
        return velocity

    def step(self, state: Array, wrench: Sequence[float], dt: float) -> Array:
        """The state (13,) after `dt` [s] under a wrench that the body carries along: Runge-Kutta,
        order 4. Raises LayoutError: the body moves too fast to be simulated."""
        y: list[float] = state.tolist()
        n_steps = self.n_steps(y[7:], dt)
        for _ in range(n_steps):
            y = self._runge_kutta(y, wrench, dt / n_steps)
        return np.array(y)

    def coarse_step(self, state: list[float], wrench: Sequence[float], dt: float) -> list[float]:
        """The same by the midpoint rule, in half the time; the quaternion's length is left
        alone."""
        n_steps = self.n_steps(state[7:], dt)
        h = dt / n_steps
        for _ in range(n_steps):
            slopes = self.derivative(state, wrench)
            middle = [a + 0.5 * h * b for a, b in zip(state, slopes, strict=True)]
            state = [a + h * b for a, b in zip(state, self.derivative(middle, wrench), strict=True)]
        return state

    def _runge_kutta(self, y0: list[float], wrench: Sequence[float], dt: float) -> list[float]:
        k1 = self.derivative(y0, wrench)
        k2 = self.derivative([a + 0.5 * dt * b for a, b in zip(y0, k1, strict=True)], wrench)
        k3 = self.derivative([a + 0.5 * dt * b for a, b in zip(y0, k2, strict=True)], wrench)
        k4 = self.derivative([a + dt * b for a, b in zip(y0, k3, strict=True)], wrench)
        y = [
            a + dt / 6 * (b + 2 * (c + d) + e)
            for a, b, c, d, e in zip(y0, k1, k2, k3, k4, strict=True)
        ]
        norm = math.hypot(*y[3:7])  # of any size, as those of a motion beyond all bounds
        y[3:7] = [value / norm for value in y[3:7]]
        return y


Bodies = Dynamics[Array, Array]
"""Numbers of many bodies; what follows the first axis must broadcast with the states'."""


def derivative(state: Array, wrench: Array, body: Bodies, current: Array) -> Array:
    """Rate of change (12, ...) of states under wrenches (6, ...) [N, N m], in a current (2, ...)
    [m/s]."""
    rotation = rotation_of_angles(state[3:6])
    u, v, w, p, q, r = state[6:]
    east, north = current
    cu, cv, cw = to_body(rotation, east, north, 0.0)
    up = rotation[2::3]
    pace = np.empty_like(state)
    pace[:3] = to_world(rotation, u, v, w)
    cr = np.cos(state[3])
    sr = np.sin(state[3])
    cp = np.cos(state[4])
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
    """States (L, 12, ...) at the beginnings of L steps of `dt` [s], from the first one (12, ...),
    under wrenches (L, 6, ...) that the body carries along: Runge-Kutta of order 4."""
    states = np.empty((len(wrench), *np.broadcast_shapes(state.shape, (12, *wrench.shape[2:]))))
    states[0] = state
    for k in range(len(wrench) - 1):
        y = states[k]
        tau = wrench[k]
        k1 = derivative(y, tau, body, current)
        k2 = derivative(y + 0.5 * dt * k1, tau, body, current)
        k3 = derivative(y + 0.5 * dt * k2, tau, body, current)
        k4 = derivative(y + dt * k3, tau, body, current)
        states[k + 1] = y + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return states


def body_rates(angles: Array, pace: Array) -> Array:
    """Angular rates (N, 3) of attitude angles (N, 3) that change by (N, 3) [rad/s]."""
    cr, cp, _ = np.cos(angles.T)
    sr, sp, _ = np.sin(angles.T)
    roll, pitch, yaw = pace.T
    return np.stack(
        [roll - sp * yaw, cr * pitch + sr * cp * yaw, cr * cp * yaw - sr * pitch], axis=-1
    )


def body_velocity(angles: Array, velocity: Array) -> Array:
    """Velocities in the world (N, 3) as bodies of attitudes (N, 3) see them."""
    return np.stack(to_body(rotation_of_angles(angles.T), *velocity.T), axis=-1)
