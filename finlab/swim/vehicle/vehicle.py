"""One body in water that moves: its state, the state's rate of change, and steps in time.

State (13,): position in the world [m], quaternion (w, x, y, z), velocity over ground [m/s] and
angular rates [rad/s] in the body frame. The water moves without rotation, so nu' = nu_r' - omega x
(current in body) + (its acceleration in body). Where it accelerates, it carries the body along by
the pressure that it accelerates itself with: M nu_r' says so of a body as heavy as the water in its
place; the buoyant force leans with it. All in plain floats: at this size they are several times
faster than arrays. `many_bodies.py` has the same for many.
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.layout import Body
from finlab.swim.vehicle.attitude import rotation_of_quaternion, to_body, to_world
from finlab.swim.vehicle.fossen import accelerations, damping_jacobian, dynamics_of
from finlab.swim.vehicle.integration import midpoint_step, runge_kutta_step

STATE_SIZE = 13
STABLE_STEP = 1.5
"""Length of a step times the fastest rate of change in it, well within what Runge-Kutta (2.8) and
the midpoint rule (2) bear."""
MAX_SUBSTEPS = 500
"""Into how many steps at most a period is cut for a body that water stops almost at once."""


class Vehicle:
    """The dynamics of one vehicle; it holds no state."""

    def __init__(self, body: Body, current: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Makes the dynamics of a body in water.

        Args:
            body: what it does not say is zero.
            current: velocity (3,) of the water in the world [m/s].

        Raises:
            LayoutError: the body has no mass or no inertia, or the current is no velocity.
        """
        self.current = tuple(float(value) for value in current)
        """Velocity of the water (3,) in the world [m/s]."""
        if len(self.current) != 3 or not all(map(math.isfinite, self.current)):
            raise LayoutError(
                f"expected a velocity of three finite numbers, got {current!r:.60}", "current"
            )
        self.dynamics = dynamics_of(body)
        self.inertia = self.dynamics.inertia
        """Diagonal of M (6,) [kg, kg m^2]."""
        self.weight = self.dynamics.weight
        """[N]."""
        self.buoyancy = self.dynamics.buoyancy
        """Buoyant force [N]."""
        mass_spread = max(self.inertia[:3]) - min(self.inertia[:3])
        self._munk = math.sqrt(mass_spread / min(self.inertia[3:]))
        self._rate_at_rest = max(damping_jacobian(self.dynamics, (0.0,) * 6))
        quadratic = max(
            d / m for d, m in zip(self.dynamics.quadratic_damping, self.inertia, strict=True)
        )
        self._rate_by_speed = 2.0 * quadratic + self._munk + 1.0

    def n_steps(self, nu: Sequence[float], dt: float) -> int:
        """Into how many equal steps a period has to be cut so that integrating it stays stable.

        One for a robot as robots are; more where damping, Munk's moments or its own turning change
        the motion within the period, as of a light body that water holds fast, or of one that
        tumbles.

        Args:
            nu: velocity and angular rates (6,) in the body frame [m/s, rad/s].
            dt: the period [s].

        Raises:
            LayoutError: even `MAX_SUBSTEPS` would not do.
        """
        cx, cy, cz = self.current
        current_speed = abs(cx) + abs(cy) + abs(cz)
        speed_bound = max(map(abs, nu)) + current_speed
        if dt * (self._rate_at_rest + self._rate_by_speed * speed_bound) <= STABLE_STEP:
            return 1  # as nearly always: known from a bound, which takes less time
        u, v, w, p, q, r = map(abs, nu)
        speeds = (u + current_speed, v + current_speed, w + current_speed, p, q, r)
        damping: float = max(damping_jacobian(self.dynamics, speeds))
        fastest_rate = damping + self._munk * max(speeds[:3]) + max(speeds[3:])
        max_rate = MAX_SUBSTEPS * STABLE_STEP / dt
        if not fastest_rate <= max_rate:  # nor where it is no number any more
            got = "beyond all bounds"
            if math.isfinite(fastest_rate):
                got = f"{fastest_rate:.2g} times a second"
            raise LayoutError(
                f"its motion changes {got}, at most {max_rate:g} can be simulated; check mass, "
                "inertia, added mass, damping and buoyancy",
                "body",
            )
        return max(1, math.ceil(fastest_rate * dt / STABLE_STEP))

    def derivative(self, state: Sequence[float], wrench: Sequence[float]) -> list[float]:
        """Returns the rate of change (13,) of a state.

        Args:
            state: see the head of this file (13,).
            wrench: tau (6,) in the body frame [N, N m].
        """
        _, _, _, qw, qx, qy, qz, u, v, w, p, q, r = state
        rotation = rotation_of_quaternion(qw, qx, qy, qz)
        up = rotation[2::3]
        cu, cv, cw = to_body(rotation, *self.current)
        nu_r = (u - cu, v - cv, w - cw, p, q, r)
        surge, sway, heave, roll, pitch, yaw = accelerations(self.dynamics, nu_r, up, wrench)
        return [
            *to_world(rotation, u, v, w),
            # The quaternion's rate is half its product with (0, p, q, r).
            0.5 * (-qx * p - qy * q - qz * r),
            0.5 * (qw * p + qy * r - qz * q),
            0.5 * (qw * q + qz * p - qx * r),
            0.5 * (qw * r + qx * q - qy * p),
            # nu' = nu_r' - omega x (current in the body frame)
            surge - (q * cw - r * cv),
            sway - (r * cu - p * cw),
            heave - (p * cv - q * cu),
            roll,
            pitch,
            yaw,
        ]

    def velocity_in_water(self, state: Array) -> Array:
        """Returns nu_r (6,) of a state (13,): velocity relative to the water and angular rates,
        body frame [m/s, rad/s]."""
        velocity = state[7:].copy()
        if any(self.current):
            velocity[:3] -= to_body(rotation_of_quaternion(*state[3:7].tolist()), *self.current)
        return velocity

    def step(self, state: Array, wrench: Sequence[float], dt: float) -> Array:
        """Returns the state (13,) after a period, by Runge-Kutta of order 4.

        Args:
            state: at the beginning (13,).
            wrench: tau (6,) [N, N m], which the body carries along.
            dt: the period [s].

        Raises:
            LayoutError: the body moves too fast to be simulated.
        """
        y: list[float] = state.tolist()
        n_steps = self.n_steps(y[7:], dt)
        derivative = partial(self.derivative, wrench=wrench)
        for _ in range(n_steps):
            y = runge_kutta_step(derivative, y, dt / n_steps)
            norm = math.hypot(*y[3:7])  # of any size, as those of a motion beyond all bounds
            y[3:7] = [value / norm for value in y[3:7]]
        return np.array(y)

    def coarse_step(self, state: list[float], wrench: Sequence[float], dt: float) -> list[float]:
        """As `step`, by the midpoint rule, in half the time; the quaternion keeps the length that
        it comes to."""
        n_steps = self.n_steps(state[7:], dt)
        derivative = partial(self.derivative, wrench=wrench)
        for _ in range(n_steps):
            state = midpoint_step(derivative, state, dt / n_steps)
        return state
