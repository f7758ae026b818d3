"""The model behind `FaultMonitor`: a robot's next velocities, from what its actuators do.

Fossen's equations with the layout's body, fins that lag as U-CAT's, and what is unknown: a current,
torques that stay, and how much of its law's thrust each fin gives. The state z (14 + n) holds

    velocity (3) and rates (3) in the body frame, roll and pitch (2), current (3) in the world,
    torque (3), strength (n).
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import quaternion_of, rotation_of_quaternion, tilt_of, to_body
from finlab.swim.vehicle.fossen import complete_body, jacobian
from finlab.swim.vehicle.vehicle import Vehicle

MOTION = slice(0, 6)
TILT = slice(6, 8)
CURRENT = slice(8, 11)
TORQUE = slice(11, 14)
RISING = 10
FIRST_FIN = 14
STRENGTH = slice(FIRST_FIN, None)
"""Where what is in the state."""
ABOUT_FACE = -0.9
"""Cosine of the angle to a direction below which a fin that is to turn there may go either way
round."""
UNSURE_S = 1.2
"""How long its direction is unknown then [s]."""


class Step(NamedTuple):
    """One period of a state z (14 + n), and how its neighbours move."""

    state: Array
    """The state (14 + n) at the end of the period."""
    transition: Array
    """Its derivatives (14 + n, 14 + n) by the state at the beginning, but for what two rates do
    together and for heeling out of the level."""
    turned: Array
    """What the velocities (n, 6) gain besides if one fin points the other way, at strength 1."""
    noise: Array | None = None
    """Covariance (6, 6) of what the velocities gain besides while a fin may turn either way
    round."""


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
        self._constant = np.eye(size)
        self._constant[range(3, 6), range(11, 14)] = period_s / self.inertia[3:]
        self._gain = period_s / self.inertia
        height = self._vehicle.dynamics.center[2]
        # Roll swings within a second: an oscillation over a period is a turn, and a step along it
        # would grow. (Of a robot that is heavy at the top the frequency is imaginary, and the
        # cosine a hyperbolic one.)
        swing = np.sqrt(self._vehicle.lift * height / self.inertia[3:5] + 1e-9j)
        sine = np.sin(swing * period_s)
        cosine = np.cos(swing * period_s)
        self._constant[range(3, 5), range(6, 8)] = (-swing * sine).real
        self._constant[range(6, 8), range(3, 5)] = (sine / swing).real
        self._constant[range(6, 8), range(6, 8)] = cosine.real
        self._swing = np.array([0.0, 0.0, 0.0, *(cosine.real - 1.0), 0.0])
        self._force = np.zeros((2, layout.n, 6))
        self._thrust = np.zeros((layout.n, 3))
        self._turned_off = np.array(["stuck" in part.KIND.faults for part in layout.actuators])
        self._unsure_s = np.zeros(layout.n)
        self._any_unsure = False
        self.unsure = np.zeros(layout.n, dtype=bool)
        """Which actuators (n,) turn about by command just now; which way round is unknown."""

    def adopt(self, layout: Layout) -> None:
        """From now on forces are those of another layout with the same body."""
        self._plant = plant_of(layout)

    def step(self, state: Array, yaw: float, command: Array, held: Array, other: Array) -> Step:
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
        wrench, turned = self._wrenches(command, held, other, np.array(flow))
        self._vehicle.current = tuple(current)
        thrust = state[STRENGTH] @ wrench
        thrust[3:] += state[TORQUE]
        moved = self._vehicle.coarse_step(
            [0.0, 0.0, 0.0, *quaternion, *motion], thrust.tolist(), self._dt
        )
        after = state.copy()
        after[:8] = (*moved[7:], *tilt_of(rotation_of_quaternion(*moved[3:7])))
        gained = wrench * self._gain
        transition = self._constant.copy()
        by_flow = self._by_flow(flow)
        transition[MOTION, MOTION] += by_flow
        transition[MOTION, CURRENT] = by_flow[:, :3] @ -np.array(rotation).reshape(3, 3)
        transition[MOTION, STRENGTH] = gained.T
        return Step(after, transition, self._gain * turned, self._either_way())

    def _by_flow(self, flow: list[float]) -> Array:
        """What velocities and rates gain over a period (6, 6) per unit of velocity in the water and
        of rate
        (6,): damping, Coriolis' forces and Munk's moments: unknown water that streams past turns
        the robot.
        """
        by_flow = self._dt * np.array(jacobian(self._vehicle.dynamics, flow))
        own = by_flow.diagonal()
        # A damping that is strong over a period brings to rest, not beyond it.
        decay = np.expm1(own) + self._swing
        by_flow[3:, 3:] = 0.0
        by_flow[range(6), range(6)] = decay
        return by_flow

    def _wrenches(
        self, command: Array, held: Array, other: Array, flow: Array
    ) -> tuple[Array, Array]:
        """Wrench (n, 6) of each actuator at full strength, mean over the period, and what it gains
        turned."""
        moves = self.motion
        facing = (
            np.cos(moves.held_part(command) - moves.direction) < ABOUT_FACE
        ) & moves.turns_fully
        moves.step(command, self._dt)
        if self._any_unsure or True in facing.tolist():
            self._unsure_s -= self._dt
            self._unsure_s[facing] = UNSURE_S
            self.unsure = self._unsure_s > 1e-9
            self._any_unsure = True in self.unsure.tolist()
        both = moves.turned_to(np.array([moves.command] * 2), np.array([held, other]))
        force = self._plant.force(both, flow=flow)
        # One that does not work gives nothing, but for one that is stuck and cannot be used.
        force *= (moves.pushes | ~(np.isnan(held) | self._turned_off))[:, None]
        self._thrust = force[0]
        offset = self._plant.offset(force, flow=flow)[:, None] / force.shape[1]
        now = np.matmul(force[:, :, None, :], self._plant.effectiveness)[:, :, 0] + offset
        # What stops, stops at once.
        mean = np.where(np.isfinite(command[:, :1]), 0.5 * (self._force + now), now)
        self._force = now
        return mean[0], mean[1] - mean[0]

    def _either_way(self) -> Array | None:
        """What the velocities may gain besides (6, 6), a covariance, by fins that had to turn
        around."""
        if not self._any_unsure:
            return None
        most = 2.0 * np.linalg.norm(self._thrust[self.unsure], axis=-1)
        effectiveness = self._plant.effectiveness[self.unsure, 1:]
        gained = (most[:, None, None] * effectiveness * self._gain).reshape(-1, 6)
        return np.asarray(gained.T @ gained)
