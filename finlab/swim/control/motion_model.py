"""The model behind `FaultMonitor`: a robot's next velocities, from what its actuators do, and what
is unknown of it.

Fossen's equations with the layout's body, actuators that lag, and a state z that holds, beside the
motion, what nobody has measured: the current, a wrench that stays, how far inertia, damping and
righting moment are from the layout's, the bias of an accelerometer, the strength and the place of
each actuator, and what one that is stuck gives. `hypotheses.py` is the filter that runs on it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.layout import Actuator, Layout
from finlab.physics import plant_of
from finlab.swim.control.contract import LEVER_M
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import quaternion_of, rotation_of_quaternion, to_body
from finlab.swim.vehicle.fossen import Dynamics, complete_body, dynamics_of

MOTION = slice(0, 6)
"""Velocity over ground and rates in the state, body frame [m/s, rad/s]."""
VELOCITY = slice(0, 3)
"""Velocity over ground."""
RATES = slice(3, 6)
"""Angular rates."""
TILT = slice(6, 8)
"""Roll and pitch [rad]."""
DEPTH = 8
"""Depth [m]."""
N_MOVING = 9
"""Numbers of the state that move by themselves: the others only drift."""
CURRENT = slice(9, 12)
"""Velocity of the water in the world [m/s]."""
UNKNOWN = slice(12, 18)
"""A wrench that stays, body frame [N, N m]."""
INERTIA = slice(18, 24)
"""How far mass and moments, with those of the water, are above the layout's, as a share."""
COUPLING = slice(24, 39)
"""Entries of the inertia matrix beside its diagonal, over the geometric mean of the two diagonal
entries of the layout."""
DAMPING = slice(39, 45)
"""How far the damping along each axis is above the layout's, as a share."""
RIGHTING = 45
"""The same of the righting moment."""
BIAS = slice(46, 49)
"""What an accelerometer shows too much, body frame [m/s^2]; it moves nothing."""
FIRST_ACTUATOR = 49
"""The strength of the first actuator; after the strengths their places, and what stuck ones
give."""
TURN_ABOUT_COSINE = -0.9
"""Cosine of the angle to a direction below which an actuator that is to turn there may go either
way round."""
QUICK_RATE = 20.0
"""Rate from which one turns about within two periods [rad/s]."""
TURN_ABOUT_S = 1.2
"""How long its direction is unknown then [s]."""


class ModelStep(NamedTuple):
    """One period of a state z (d,), linearized."""

    state: Array
    """The state (d,) at the end of the period."""
    transition: Array
    """Derivatives (9, d) of its moving part by the state at the beginning; the others stay."""
    noise: Array
    """What the model may be wrong by, as squares of accelerations (4, 6): of all terms of the
    equation of motion; of what is not linear in the errors of the state; of how much the actuators'
    wrench changed; and of the forces of those that turn about, which way round is unknown."""
    acceleration: Array
    """Rate of change (9,) of the moving part at the beginning."""
    acceleration_slope: Array
    """Its derivatives (9, d)."""


class MotionModel:
    """The model of one robot; remembers what its actuators do.

    An actuator that is stuck gives a wrench that does not follow its command. What it gives is
    linear in few numbers: the force of a thruster [N], or the cosine and the sine of the angle at
    which a fin or a pod no longer turns. They stand in the state, 0 where nothing is stuck.
    """

    def __init__(self, layout: Layout) -> None:
        """Takes a layout, whose body is completed by U-CAT's."""
        self.dynamics = dynamics_of(complete_body(layout))
        self.inertia = np.array(self.dynamics.inertia)
        """Mass and moments (6,), those of the water that goes along included [kg, kg m^2]."""
        self._inertia_squared = np.square(self.inertia)
        self._body = SharedArray(_body_numbers(self.dynamics))
        self._plant = plant_of(layout)
        self.motion = ActuatorMotion(layout)
        """What the actuators do, if they follow their commands."""
        n = layout.n
        self.n = n
        parts = layout.actuators
        self.sticks = np.array(["stuck" in part.KIND.faults for part in parts])
        """Which actuators (n,) may be stuck."""
        self.sticks_at_angle = self.sticks & self.motion.angles
        """Which of them keep an angle; the others keep a force."""
        largest = [_largest_force(part) for part in parts]
        self.force_max = np.array(largest)
        """Largest forces (n,) of actuators whose command is a force [N]; 1 of others."""
        self.force_limits = np.full((n, 2), np.nan)
        """Least and largest forces (n, 2) of actuators whose command is a force alone [N]; NaN of
        others."""
        for k, part in enumerate(parts):
            if part.type == "thruster":
                self.force_limits[k] = part.lower[0], part.upper[0]
        self.held_owner = _owners_of_held(self.sticks, self.sticks_at_angle)
        """Actuator (h,) of each number of the state that says what a stuck one gives."""
        self.n_held = len(self.held_owner)
        self.strength = slice(FIRST_ACTUATOR, FIRST_ACTUATOR + n)
        """Strengths in the state."""
        self.place = slice(self.strength.stop, self.strength.stop + 3 * n)
        """How far actuators are from their places in the layout, three numbers of each [m]."""
        self.held = slice(self.place.stop, self.place.stop + self.n_held)
        """What stuck ones give in the state."""
        self.size = self.held.stop
        """Numbers of the state, d."""
        self.held_of = [np.flatnonzero(self.held_owner == k) for k in range(n)]
        """Which of the held numbers belong to each actuator."""
        # An angle at which a pod or a fin would push along the first and the second own axis.
        basis = np.full((2, n), np.nan)
        basis[0, self.sticks_at_angle] = 0.0
        basis[1, self.sticks_at_angle] = 0.5 * math.pi
        self._basis_angles = basis
        self._wrench_before = np.zeros((n, 6))
        self._turning_s = np.zeros(n)
        rate = layout.rates[np.arange(n), [part.KIND.stuck_number for part in parts]]
        self._turns_slowly = self.motion.turns_fully & (rate < QUICK_RATE)
        self._has_slow_ones = bool(self._turns_slowly.any())
        angled = np.flatnonzero(self.sticks_at_angle)
        self._angled = angled
        self._held_angles = np.array([self.held_of[k] for k in angled]).reshape(-1, 2)
        # Which of the held numbers are forces, and of which actuators.
        keeps_force = ~self.sticks_at_angle[self.held_owner]
        self._held_forces = np.flatnonzero(keeps_force)
        self._force_owner = self.held_owner[keeps_force]
        # Where the core reads the wrenches (n + h, 6) of a step, and writes what it returns.
        self._wrenches = SharedArray(np.zeros((n + self.n_held, 6)))
        self._owners = np.concatenate([np.arange(n), self.held_owner]).astype(np.int32)
        self._transition = SharedArray(np.zeros((N_MOVING, self.size)))
        self._slope = SharedArray(np.zeros((N_MOVING, self.size)))
        self._rates = SharedArray(np.zeros(N_MOVING))
        self._noise = SharedArray(np.zeros((4, 6)))
        self._set_unit_wrenches()

    def _set_unit_wrenches(self) -> None:
        """Takes the wrench of 1 N along the axis of each actuator whose command is a force."""
        of_held = self._wrenches.array[self.n :]
        of_held[self._held_forces] = self._plant.effectiveness[self._force_owner, 0]

    def adopt(self, layout: Layout) -> None:
        """From now on forces are those of another layout with the same body."""
        self._plant = plant_of(layout)
        self._set_unit_wrenches()

    def held_now(self) -> Array:
        """What each actuator would give on if it stuck now, as in the state (h,)."""
        direction = self.motion.direction
        result = np.empty(self.n_held)
        result[self._held_forces] = direction[self._force_owner]
        if len(self._angled):
            angle = direction[self._angled]
            result[self._held_angles[:, 0]] = np.cos(angle)
            result[self._held_angles[:, 1]] = np.sin(angle)
        return result

    def step(
        self,
        state: Array,
        yaw: float,
        command: Array,
        dt: float,
        covariance: SharedArray | None = None,
    ) -> ModelStep:
        """Carries a state on over a period.

        By the exponential Euler rule for z' = f(z), which stays stable however strongly the water
        damps (M. Hochbruck, A. Ostermann, Acta Numerica 19, 2010): with A = df/dz

            z <- z + dt phi_1(A dt) f(z),    phi_1(X) = (e^X - 1) / X

        Args:
            state: z (d,) at the beginning.
            yaw: heading [rad].
            command: (n, 3) in force over the period; NaN rows rest.
            dt: its length [s].
            covariance: of the state (d, d), where it is known.
        """
        flow = None
        if self._plant.feels_flow:
            flow = motion_through_water(state, yaw)
        of_changes, of_turning = self._push(command, flow, dt)
        after = SharedArray(state)
        library().fl_motion_step(
            self._body.address,
            self._wrenches.address,
            self._owners.ctypes.data,
            self.n,
            self.n_held,
            yaw,
            dt,
            None if covariance is None else covariance.address,
            after.address,
            self._transition.address,
            self._rates.address,
            self._slope.address,
            self._noise.address,
        )
        noise = self._noise.array.copy()
        noise[2] = of_changes / self._inertia_squared
        noise[3] = of_turning / self._inertia_squared
        return ModelStep(
            state=after.array,
            transition=self._transition.array.copy(),
            noise=noise,
            acceleration=self._rates.array.copy(),
            acceleration_slope=self._slope.array.copy(),
        )

    def _push(self, command: Array, flow: Array | None, dt: float) -> tuple[Array, Array]:
        """Moves the actuators on by a period, and notes their wrenches: of each at full strength,
        mean over the period, and of each unit of what stuck ones give.

        Returns:
            Squares (6,) of how much all wrenches changed, and of what those that turn about may
            give otherwise.
        """
        if self._has_slow_ones:
            self._note_turning(command, dt)
        self.motion.step(command, dt)
        force, wrench = self._pushed(flow)
        # What stops, stops at once.
        works = np.isfinite(command[:, :1])
        change = wrench - self._wrench_before
        self._wrenches.array[: self.n] = np.where(works, wrench - 0.5 * change, wrench)
        self._wrench_before = wrench
        of_turning = np.zeros(6)
        if self._has_slow_ones and self._turning_s.any():
            about = self._turning_s > 0.0
            # One that points the other way changes the force by twice its size.
            size = 2.0 * np.linalg.norm(force[about], axis=-1)
            effect = np.square(size[:, None, None] * self._plant.effectiveness[about, 1:])
            of_turning = effect.sum(axis=(0, 1))
        return np.square(change).sum(axis=0), of_turning

    def _pushed(self, flow: Array | None) -> tuple[Array, Array]:
        """Forces (n, 3) [N] in own frames and wrenches (n, 6) of what the actuators do now; of
        those that stick at an angle, the wrenches at two angles are noted, too."""
        moves = self.motion
        plant = self._plant
        now = moves.command
        pushes = moves.pushes[:, None]
        if len(self._angled):
            angles = np.concatenate([np.full((1, self.n), np.nan), self._basis_angles])
            forces = plant.force(moves.turned_to(np.array([now] * 3), angles), flow=flow) * pushes
            force = forces[0]
            at_angles = np.matmul(forces[1:, :, None, :], plant.effectiveness)[:, :, 0]
            of_held = self._wrenches.array[self.n :]
            of_held[self._held_angles.T] = at_angles[:, self._angled]
        else:
            force = plant.force(now, flow=flow) * pushes
        wrench = np.matmul(force[:, None, :], plant.effectiveness)[:, 0]
        if plant.interaction is not None:
            wrench += plant.offset(force, flow=flow) / self.n
        return force, wrench

    def _note_turning(self, command: Array, dt: float) -> None:
        """Notes which actuators are to turn about."""
        moves = self.motion
        self._turning_s = np.maximum(self._turning_s - dt, 0.0)
        cosine = np.cos(moves.held_part(command) - moves.direction)
        turns_about = (cosine < TURN_ABOUT_COSINE) & self._turns_slowly
        self._turning_s[turns_about] = TURN_ABOUT_S


def motion_through_water(state: Array, yaw: float) -> Array:
    """Velocity through the water and rates (6,) of a state (d,), body frame [m/s, rad/s]."""
    roll, pitch = state[TILT].tolist()
    rotation = rotation_of_quaternion(*quaternion_of(roll, pitch, yaw))
    motion = state[MOTION].copy()
    motion[:3] -= to_body(rotation, *state[CURRENT].tolist())
    return np.asarray(motion)


def _body_numbers(dynamics: Dynamics) -> list[float]:
    """Constants of a body in the order of `body_numbers` in the core's motion_model.c."""
    return [
        *dynamics.inertia,
        *dynamics.linear_damping,
        *dynamics.quadratic_damping,
        dynamics.buoyancy - dynamics.weight,
        dynamics.buoyancy,
        *dynamics.center_of_buoyancy,
    ]


def _owners_of_held(
    sticks: NDArray[np.bool_], sticks_at_angle: NDArray[np.bool_]
) -> NDArray[np.int_]:
    """Actuator (h,) of each number that says what a stuck one gives: cosine and sine of one that
    keeps an angle, the force of another."""
    numbers_of_each = np.where(sticks, np.where(sticks_at_angle, 2, 1), 0)
    return np.repeat(np.arange(len(sticks)), numbers_of_each)


def _largest_force(part: Actuator) -> float:
    """The largest force of an actuator whose command is a force [N]; 1 of others."""
    if part.KIND.sticks_at_angle:
        return 1.0
    return max(abs(part.lower[0]), abs(part.upper[0]), 1e-9)


def gyration_radius(inertia: Array) -> Array:
    """Radii (3,) of gyration [m] of a robot with mass and moments (6,)."""
    radius = np.sqrt(inertia[3:] / inertia[:3].mean())
    return np.asarray(np.maximum(radius, 0.1 * LEVER_M))
