"""What a robot's velocities should do next, from what its fins do: the model behind `FaultMonitor`.

Fossen's equations with the layout's body, fins that lag as U-CAT's, and what nobody told: a current, torques
that stay, and how much of its law's thrust each fin gives. The state z (14 + n) holds

    velocity (3) and rates (3) in the body frame, roll and pitch (2), current (3) in the world, torque (3),
    strength (n).
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.control.nominal_lag import NominalLag
from finlab.layout import Body, Layout
from finlab.physics import plant_of
from finlab.physics.vehicle import Vehicle, complete_body

MOTION, TILT, CURRENT, TORQUE = slice(0, 6), slice(6, 8), slice(8, 11), slice(11, 14)
FIRST_FIN = 14
STRENGTH = slice(FIRST_FIN, None)
"""Where what is in the state."""


class Step(NamedTuple):
    """One period of a state z (14 + n), and how its neighbours move."""

    state: Array
    """The state (14 + n) at the end of the period."""
    transition: Array
    """Its derivatives (14 + n, 14 + n) by the state at the beginning, but for the couplings between axes and
    Munk's moments, which small differences hardly feel."""
    turned: Array
    """What the velocities (n, 6) gain besides if one fin points the other way, at strength 1."""


class MotionModel:
    """The model of one robot; remembers what its fins do."""

    def __init__(self, layout: Layout, body: Body | None, period_s: float) -> None:
        """Takes a layout, whose body is completed by U-CAT's where none is given, and the time of a step."""
        body = complete_body(layout) if body is None else body
        self._vehicle = Vehicle(body)
        self._plant = plant_of(layout)
        self.inertia = np.array(self._vehicle.inertia)
        """Mass and moments (6,), those of the water that goes along included [kg, kg m^2]."""
        zeros = (0.0,) * 6
        self._linear = np.array(body.linear_damping or zeros) / self.inertia
        self._quadratic = 2.0 * np.array(body.quadratic_damping or zeros) / self.inertia
        self._dt = period_s
        self.fins = NominalLag(layout, period_s)
        """What the fins do, if they follow their commands."""
        size = FIRST_FIN + layout.n_fins
        self._one = np.eye(size)
        self._slopes = np.zeros((size, size))
        self._slopes[range(3, 6), range(11, 14)] = 1.0 / self.inertia[3:]
        height = (body.center_of_buoyancy_m or zeros)[2]
        # Roll swings within a second: an oscillation over a period is a turn, and a step along it would grow.
        # (Of a robot that is heavy at the top the frequency is imaginary, and the cosine a hyperbolic one.)
        swing = np.sqrt(self._vehicle.lift * height / self.inertia[3:5] + 1e-9j)
        sine, cosine = np.sin(swing * period_s), np.cos(swing * period_s)
        self._slopes[range(3, 5), range(6, 8)] = (-swing * sine).real / period_s
        self._slopes[range(6, 8), range(3, 5)] = (sine / swing).real / period_s
        self._slopes[range(6, 8), range(6, 8)] = (cosine.real - 1.0) / period_s
        self._swing = np.zeros(6)
        self._swing[3:5] = (cosine.real - 1.0) / period_s
        self._force = np.zeros((2, layout.n_fins, 6))

    def step(
        self, state: Array, yaw: float, command: Array, reported: Array | None, held: Array, other: Array
    ) -> Step:
        """Carries a state on over a period.

        Args:
            state: z (14 + n) at the beginning.
            yaw: heading at its end [rad], as measured.
            command: (n, 3) in force over the period; NaN rows rest.
            reported: what the servos say that they do (n, 3), NaN where they say nothing; or nothing.
            held: zero directions (n,) that are believed [rad]; NaN where fins turn as commanded.
            other: zero directions (n,) as they might be instead [rad]; NaN likewise.
        """
        dt = self._dt
        wrench, turned = self._wrenches(command, reported, held, other)
        roll, pitch = state[TILT].tolist()
        quaternion = _quaternion(roll, pitch, yaw - dt * float(state[5]))
        rotation = _rotation(*quaternion)
        motion, current = state[MOTION], state[CURRENT]
        self._vehicle.current = tuple(current.tolist())
        thrust = state[STRENGTH] @ wrench
        thrust[3:] += state[TORQUE]
        moved = self._carried([0.0, 0.0, 0.0, *quaternion, *motion.tolist()], thrust.tolist())
        after = state.copy()
        after[:8] = (*moved[7:], *_tilt(*moved[3:7]))
        flow = motion.copy()
        flow[:3] -= current @ rotation
        damping = -np.expm1(-dt * (self._linear + self._quadratic * np.abs(flow))) / dt
        slopes = self._slopes.copy()
        slopes.ravel()[: 6 * len(slopes) : len(slopes) + 1] = self._swing - damping
        slopes[:3, CURRENT] = damping[:3, None] * rotation.T
        slopes[MOTION, STRENGTH] = (wrench / self.inertia).T
        slopes *= dt
        slopes += self._one
        return Step(after, slopes, dt / self.inertia * turned)

    def _carried(self, body: list[float], wrench: list[float]) -> list[float]:
        """A body's state (13,) after the period, by the midpoint rule in plain floats, which are fast."""
        slopes = self._vehicle.derivative(body, wrench)
        middle = [a + 0.5 * self._dt * b for a, b in zip(body, slopes, strict=True)]
        return [a + self._dt * b for a, b in zip(body, self._vehicle.derivative(middle, wrench), strict=True)]

    def _wrenches(
        self, command: Array, reported: Array | None, held: Array, other: Array
    ) -> tuple[Array, Array]:
        """Wrench (n, 6) of each fin at full strength, mean over the period, and what it gains turned."""
        does = self.fins.step(command)
        if reported is not None:
            does = np.where(np.isnan(reported), does, reported)
        both = np.empty((2, *does.shape))
        both[:] = does
        directions = np.array([held, other])
        np.copyto(both[:, :, 2], directions, where=~np.isnan(directions))
        force = self._plant.force(both)
        force *= does[:, :1] * does[:, 1:2] > 0.0  # one that does not beat gives nothing, whatever its law
        now = np.matmul(force[:, :, None, :], self._plant.columns)[:, :, 0]
        mean, self._force = 0.5 * (self._force + now), now
        return mean[0], mean[1] - mean[0]


def _quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Angles about z, then y, then x [rad], as w, x, y, z."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _tilt(w: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Roll and pitch of a quaternion [rad]."""
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0))


def _rotation(w: float, x: float, y: float, z: float) -> Array:
    """The matrix (3, 3) of a quaternion, from the body to the world."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
