"""One body in water that moves: its state, the state's rate of change, and steps in time.

State (13,): position in the world [m], quaternion (w, x, y, z), velocity over ground [m/s] and
angular rates [rad/s] in the body frame. The water moves without rotation, so nu' = nu_r' - omega x
(current in body) + (its acceleration in body). Where it accelerates, it carries the body along by
the pressure that it accelerates itself with: M nu_r' says so of a body as heavy as the water in its
place; the buoyant force leans with it. The core computes it (finlab/core/src/vehicle.c): a
simulation takes fifty such steps for each second that it simulates. `many_bodies.py` has the same
for many, by `fossen.py`.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.errors import LayoutError
from finlab.layout import Body, Layout
from finlab.swim.vehicle.attitude import rotation_of_quaternion, to_body
from finlab.swim.vehicle.body_integrator import ActuatorLoad
from finlab.swim.vehicle.fossen import complete_body, dynamics_of

STATE_SIZE = 13
STABLE_STEP = 1.5
"""Length of a step times the fastest rate of change in it, well within what Runge-Kutta (2.8) and
the midpoint rule (2) bear; the core's vehicle.c has it, too."""
MAX_SUBSTEPS = 500
"""Into how many steps at most a period is cut for a body that water stops almost at once; likewise
in the core."""


def vehicle_of(layout: Layout, current: Sequence[float] = (0.0, 0.0, 0.0)) -> "Vehicle":
    """Returns the vehicle of a robot.

    Args:
        layout: the robot; what its body does not say is U-CAT's.
        current: velocity (3,) of the water in the world [m/s].

    Raises:
        LayoutError: the current is no velocity.
    """
    return Vehicle(complete_body(layout), current)


class Vehicle:
    """The dynamics of one vehicle; it keeps nothing from one call to the next. It is a
    `BodyIntegrator`."""

    def __init__(self, body: Body, current: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Makes the dynamics of a body in water.

        Args:
            body: what it does not say is zero.
            current: velocity (3,) of the water in the world [m/s].

        Raises:
            LayoutError: the body has no mass or no inertia, or the current is no velocity.
        """
        velocity = tuple(float(value) for value in current)
        if len(velocity) != 3 or not all(map(math.isfinite, velocity)):
            raise LayoutError(
                f"expected a velocity of three finite numbers, got {velocity!r:.60}", "current"
            )
        self.dynamics = dynamics_of(body)
        self.inertia = self.dynamics.inertia
        """Diagonal of M (6,) [kg, kg m^2]."""
        self.weight = self.dynamics.weight
        """[N]."""
        self.buoyancy = self.dynamics.buoyancy
        """Buoyant force [N]."""
        mass_spread = max(self.inertia[:3]) - min(self.inertia[:3])
        munk_rate = math.sqrt(mass_spread / min(self.inertia[3:]))
        # In the order of `body_numbers` in the core's vehicle.c.
        self._body = SharedArray(
            [
                *self.inertia,
                *self.dynamics.linear_damping,
                *self.dynamics.quadratic_damping,
                self.weight,
                self.buoyancy,
                *self.dynamics.center_of_buoyancy,
                munk_rate,
                *velocity,
            ]
        )
        # Where the core reads the arguments of one call and writes what it returns.
        self._state = SharedArray(np.zeros(STATE_SIZE))
        self._wrench = SharedArray(np.zeros(6))
        self._rates = SharedArray(np.zeros(STATE_SIZE))

    @property
    def current(self) -> tuple[float, ...]:
        """Velocity of the water (3,) in the world [m/s]; it may be set."""
        return tuple(self._body.array[-3:].tolist())

    @current.setter
    def current(self, velocity: Sequence[float]) -> None:
        self._body.array[-3:] = velocity

    def n_steps(self, nu: ArrayLike, dt: float) -> int:
        """Into how many equal steps a period has to be cut so that integrating it stays stable.

        One for a robot as robots are; more where damping, Munk's moments or its own turning change
        the motion within the period, as of a light body that water holds fast, or of one that
        tumbles. The core cuts each of its steps so.

        Args:
            nu: velocity and angular rates (6,) in the body frame [m/s, rad/s].
            dt: the period [s].

        Raises:
            LayoutError: even `MAX_SUBSTEPS` would not do.
        """
        self._state.array[7:] = nu
        arguments = self._body.address, self._state.address
        parts: int = library().fl_body_parts(*arguments, dt)
        if parts:
            return parts
        fastest_rate = library().fl_body_fastest_rate(*arguments)
        got = "beyond all bounds"
        if math.isfinite(fastest_rate):
            got = f"{fastest_rate:.2g} times a second"
        raise LayoutError(
            f"its motion changes {got}, at most {MAX_SUBSTEPS * STABLE_STEP / dt:g} can be "
            "simulated; check mass, inertia, added mass, damping and buoyancy",
            "body",
        )

    def derivative(self, state: Sequence[float] | Array, wrench: Sequence[float] | Array) -> Array:
        """Returns the rate of change (13,) of a state.

        Args:
            state: see the head of this file (13,).
            wrench: tau (6,) in the body frame [N, N m].
        """
        self._state.array[:] = state
        self._wrench.array[:] = wrench
        library().fl_body_rates(
            self._body.address, self._state.address, self._wrench.address, self._rates.address
        )
        return self._rates.array.copy()

    def velocity_in_water(self, state: Array) -> Array:
        """Returns nu_r (6,) of a state (13,): velocity relative to the water and angular rates,
        body frame [m/s, rad/s]."""
        velocity = state[7:].copy()
        current = self.current
        if any(current):
            velocity[:3] -= to_body(rotation_of_quaternion(*state[3:7].tolist()), *current)
        return velocity

    def steps(self, state: ArrayLike, wrenches: ArrayLike, dt: float) -> Array:
        """Returns the states (K + 1, 13) at the beginning and after each of K periods, by
        Runge-Kutta of order 4.

        Args:
            state: at the beginning (13,).
            wrenches: tau (K, 6) in each period [N, N m], which the body carries along.
            dt: a period [s].

        Raises:
            LayoutError: the body moves too fast to be simulated.
        """
        tau = np.ascontiguousarray(wrenches, dtype=np.float64)
        count = len(tau)
        states = np.empty((count + 1, STATE_SIZE))
        states[0] = state
        taken = library().fl_body_steps(
            self._body.address, tau.ctypes.data, count, dt, states.ctypes.data
        )
        if taken < count:
            self.n_steps(states[taken, 7:], dt)  # says what is wrong
        return states

    def advance(self, state: Array, load: ActuatorLoad, dt: float) -> Array:
        """Returns the states (K, 13) after each of K periods; errors as of `steps`.

        Args:
            state: at the beginning (13,).
            load: what the actuators give in each period, of which the wrenches alone count.
            dt: a period [s].
        """
        return self.steps(state, load.wrench, dt)[1:]

    def step(self, state: ArrayLike, wrench: ArrayLike, dt: float) -> Array:
        """Returns the state (13,) after one period; arguments and errors as of `steps`, which takes
        many periods at once."""
        after: Array = self.steps(state, np.reshape(wrench, (1, 6)), dt)[1]
        return after

    def coarse_step(
        self, state: Sequence[float] | Array, wrench: Sequence[float] | Array, dt: float
    ) -> Array:
        """As `step`, by the midpoint rule, in half the time; the quaternion keeps the length that
        it comes to."""
        self._state.array[:] = state
        self._wrench.array[:] = wrench
        if not library().fl_body_coarse_step(
            self._body.address, self._wrench.address, dt, self._state.address
        ):
            self.n_steps(self._state.array[7:].copy(), dt)  # says what is wrong
        return self._state.array.copy()
