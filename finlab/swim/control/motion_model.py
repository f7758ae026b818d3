"""The model behind `FaultMonitor`: a robot's next velocities, from what its actuators do.

Fossen's equations with the layout's body, fins that lag as U-CAT's, and what is unknown: a current,
constant torques, and how much of its law's thrust each fin gives. The state z (14 + n) holds

    velocity (3) and rates (3) in the body frame, roll and pitch (2), current (3) in the world,
    torque (3), strength (n).

`hypotheses.py` is the filter that runs on it.
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import (
    quaternion_of,
    rotation_of_quaternion,
    tilt_of_quaternion,
    to_body,
)
from finlab.swim.vehicle.fossen import complete_body, jacobian
from finlab.swim.vehicle.vehicle import Vehicle

MOTION = slice(0, 6)
"""Velocity and rates in the state."""
TILT = slice(6, 8)
"""Roll and pitch in the state."""
CURRENT = slice(8, 11)
"""Velocity of the water in the state."""
CURRENT_UP = 10
"""Its vertical component in the state."""
TORQUE = slice(11, 14)
"""Constant torque in the state."""
FIRST_FIN = 14
"""The strength of the first fin in the state."""
STRENGTH = slice(FIRST_FIN, None)
"""The strengths of all fins in the state."""
TURN_ABOUT_COSINE = -0.9
"""Cosine of the angle to a direction below which a fin that is to turn there may go either way
round."""
TURN_ABOUT_S = 1.2
"""How long its direction is unknown then [s]."""


class ModelStep(NamedTuple):
    """One period of a state z (14 + n), linearized."""

    state: Array
    """The state (14 + n) at the end of the period."""
    transition: Array
    """Its derivatives (14 + n, 14 + n) by the state at the beginning, but for what two rates do
    together and for heeling out of the level."""
    gain_if_turned: Array
    """What the velocities (n, 6) gain besides if one fin points the other way, at strength 1."""
    turn_about_covariance: Array | None = None
    """Covariance (6, 6) of what the velocities gain besides while a fin may turn either way
    round; None where none does."""


class MotionModel:
    """The model of one robot; remembers what its fins do."""

    def __init__(self, layout: Layout, period_s: float) -> None:
        """Takes a layout, whose body is completed by U-CAT's, and the time of a step [s]."""
        self._vehicle = Vehicle(complete_body(layout))
        self._plant = plant_of(layout)
        self.inertia = np.array(self._vehicle.inertia)
        """Mass and moments (6,), those of the water that goes along included [kg, kg m^2]."""
        self._dt = period_s
        self.motion = ActuatorMotion(layout)
        """What the actuators do, if they follow their commands."""
        size = FIRST_FIN + layout.n
        self._constant_transition = np.eye(size)
        """The part of the transition matrix that does not depend on the state."""
        self._constant_transition[range(3, 6), range(11, 14)] = period_s / self.inertia[3:]
        self._velocity_by_wrench = period_s / self.inertia
        height = self._vehicle.dynamics.center_of_buoyancy[2]
        # Roll swings within a second: an oscillation over a period is a turn, and a step along it
        # would grow. (Of a robot that is heavy at the top the frequency is imaginary, and the
        # cosine a hyperbolic one.)
        omega = np.sqrt(self._vehicle.buoyancy * height / self.inertia[3:5] + 1e-9j)
        sine = np.sin(omega * period_s)
        cosine = np.cos(omega * period_s)
        self._constant_transition[range(3, 5), range(6, 8)] = (-omega * sine).real
        self._constant_transition[range(6, 8), range(3, 5)] = (sine / omega).real
        self._constant_transition[range(6, 8), range(6, 8)] = cosine.real
        self._tilt_decay = np.array([0.0, 0.0, 0.0, *(cosine.real - 1.0), 0.0])
        self._wrench_before = np.zeros((2, layout.n, 6))
        self._force = np.zeros((layout.n, 3))
        self._may_stick = np.array(["stuck" in part.KIND.faults for part in layout.actuators])
        self._turning_about_s = np.zeros(layout.n)
        self._any_turning_about = False
        self.is_turning_about = np.zeros(layout.n, dtype=bool)
        """Which actuators (n,) turn about by command just now; which way round is unknown."""

    def adopt(self, layout: Layout) -> None:
        """From now on forces are those of another layout with the same body."""
        self._plant = plant_of(layout)

    def step(
        self, state: Array, yaw: float, command: Array, held: Array, other: Array
    ) -> ModelStep:
        """Carries a state on over a period.

        Args:
            state: z (14 + n) at the beginning.
            yaw: heading at its end [rad], as measured.
            command: (n, 3) in force over the period; NaN rows rest.
            held: where actuators (n,) are believed to stick, as `ActuatorMotion.direction`; NaN
                where they turn as commanded.
            other: where they might be instead; NaN likewise.
        """
        motion = state[MOTION].tolist()
        current = state[CURRENT].tolist()
        roll, pitch = state[TILT].tolist()
        quaternion = quaternion_of(roll, pitch, yaw - self._dt * motion[5])
        rotation = rotation_of_quaternion(*quaternion)
        water = to_body(rotation, *current)
        flow = [a - b for a, b in zip(motion, (*water, 0.0, 0.0, 0.0), strict=True)]
        wrenches, wrenches_if_turned = self._wrenches(command, held, other, np.array(flow))
        self._vehicle.current = tuple(current)
        tau = state[STRENGTH] @ wrenches
        tau[3:] += state[TORQUE]
        vehicle_state = self._vehicle.coarse_step(
            [0.0, 0.0, 0.0, *quaternion, *motion], tau, self._dt
        )
        after = state.copy()
        after[MOTION] = vehicle_state[7:]
        after[TILT] = tilt_of_quaternion(*vehicle_state[3:7].tolist())
        transition = self._constant_transition.copy()
        by_flow = self._by_flow(flow)
        transition[MOTION, MOTION] += by_flow
        transition[MOTION, CURRENT] = by_flow[:, :3] @ -np.array(rotation).reshape(3, 3)
        transition[MOTION, STRENGTH] = (wrenches * self._velocity_by_wrench).T
        return ModelStep(
            state=after,
            transition=transition,
            gain_if_turned=self._velocity_by_wrench * wrenches_if_turned,
            turn_about_covariance=self._turn_about_covariance(),
        )

    def _by_flow(self, flow: list[float]) -> Array:
        """Derivatives (6, 6) of what velocities and rates gain over a period by nu_r (6,).

        Damping, Coriolis' forces and Munk's moments: unknown water that streams past turns the
        robot.
        """
        by_flow = self._dt * np.array(jacobian(self._vehicle.dynamics, flow))
        damping = by_flow.diagonal()
        # A damping that is strong over a period brings to rest, not beyond it.
        decay = np.expm1(damping) + self._tilt_decay
        by_flow[3:, 3:] = 0.0
        by_flow.reshape(-1)[::7] = decay  # its diagonal
        return by_flow

    def _wrenches(
        self, command: Array, held: Array, other: Array, flow: Array
    ) -> tuple[Array, Array]:
        """Moves the actuators on by a period.

        Returns:
            The wrench (n, 6) of each at full strength, mean over the period, and what it is more
            where the actuator points to `other`.
        """
        moves = self.motion
        cosine = np.cos(moves.held_part(command) - moves.direction)
        turns_about = (cosine < TURN_ABOUT_COSINE) & moves.turns_fully
        moves.step(command, self._dt)
        if self._any_turning_about or True in turns_about.tolist():
            self._turning_about_s -= self._dt
            self._turning_about_s[turns_about] = TURN_ABOUT_S
            self.is_turning_about = self._turning_about_s > 1e-9
            self._any_turning_about = True in self.is_turning_about.tolist()
        both = moves.turned_to(np.array([moves.command] * 2), np.array([held, other]))
        force = self._plant.force(both, flow=flow)
        # One that does not work gives nothing, but for one that is stuck and cannot be used.
        force *= (moves.pushes | ~(np.isnan(held) | self._may_stick))[:, None]
        self._force = force[0]
        offset = self._plant.offset(force, flow=flow)[:, None] / force.shape[1]
        wrench = np.matmul(force[:, :, None, :], self._plant.effectiveness)[:, :, 0] + offset
        # What stops, stops at once.
        mean = np.where(np.isfinite(command[:, :1]), 0.5 * (self._wrench_before + wrench), wrench)
        self._wrench_before = wrench
        return mean[0], mean[1] - mean[0]

    def _turn_about_covariance(self) -> Array | None:
        """Covariance (6, 6) of what the velocities may gain by fins that had to turn about."""
        if not self._any_turning_about:
            return None
        # A fin that points the other way than it is taken to changes the force by twice its size.
        deviation = 2.0 * np.linalg.norm(self._force[self.is_turning_about], axis=-1)
        effectiveness = self._plant.effectiveness[self.is_turning_about, 1:]
        gains = deviation[:, None, None] * effectiveness * self._velocity_by_wrench
        gains = gains.reshape(-1, 6)
        return np.asarray(gains.T @ gains)
