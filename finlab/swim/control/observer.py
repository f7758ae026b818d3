"""Place, motion and disturbances of a robot, from sensors and from its own model.

An extended Kalman filter holds surge, sway, heave and yaw rate, the accelerations along surge,
heave and yaw that the model does not explain (a wrong damping or buoyancy, a weak fin), and the
current, which shows in how the water carries the robot sideways. It is carried on by what the
actuators give, not by what was asked of them, so nothing winds up where a wrench is out of reach.
Pose comes from these velocities, corrected slowly by markers, pressure and the IMU's tilt.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.control.contract import Measurement, Setpoint
from finlab.swim.vehicle.attitude import in_world, quaternion_of
from finlab.swim.vehicle.fossen import complete_body, damping_jacobian, damping_rates
from finlab.swim.vehicle.vehicle import Vehicle

AXES = [0, 1, 2, 5]
"""Surge, sway, heave and yaw among the six."""
MOTION = slice(0, 4)
UNKNOWN = slice(4, 7)
CURRENT = slice(7, 9)
DRIVEN = [0, 2, 3]
"""Where what is in the state, and which of the motions the unknown accelerations (3,) change."""
UNKNOWN_FORCE = 0.006
"""Unknown force that comes and goes, per root of a second, as a share of what all fins can give
together."""
UNKNOWN_BY_RUDDERS = 0.15
"""The same of a robot that rudders steer: their force goes with the square of a speed, and moments
of the water on the hull outweigh it."""
LASTING_FORCE = 0.003
"""The same of the change of what stays."""
CURRENT_SPEED, CURRENT_CHANGE = 0.05, 0.002
"""Expected current [m/s], and its change per root of a second."""
VELOCITY_NOISE, RATE_NOISE = 0.02, 0.04
"""Expected noise of a measured velocity [m/s] and yaw rate [rad/s], with what the fins' beat
adds."""
ASTRAY = 1.0
"""A motion [m/s, rad/s] this far from the one that is seen tells nothing of unknown forces: the
model cannot follow, as of a robot that water stops within a period."""
CRUISE = 1.0
"""Speed [m/s] at which the strength of rudders counts."""
OLDEST_S = 0.5
"""Age from which on a sample counts as so old [s]."""
POSE_S, TILT_S = 1.5, 1.0
"""Time constants with which poses and tilts that are seen correct those that are counted on [s]."""


class Estimate(NamedTuple):
    """What is believed of now. World: z up; body: x forward, y left, z up."""

    position: Array
    """Position (3,) in the world [m]."""
    roll: float
    """[rad]."""
    pitch: float
    """[rad], positive with the nose down."""
    yaw: float
    """Heading [rad], wrapped."""
    velocity: Array
    """Velocity (3,) over ground in the body frame [m/s]."""
    yaw_rate: float
    """[rad/s]."""
    world_velocity: Array
    """The velocity (3,) in the world [m/s]."""
    current: Array
    """Horizontal velocity (2,) of the water in the world [m/s]."""
    pitch_rate: float
    """[rad/s]."""
    pitch_drift: float
    """Angular acceleration in pitch that there would be without any thrust [rad/s^2]."""
    pitch_inertia: float
    """Moment of inertia about y with that of the water that goes along [kg m^2]."""
    drift: Array
    """Acceleration (4,) along surge, sway, heave and yaw that there would be without any thrust
    [m/s^2, rad/s^2]."""


class MotionObserver:
    """Watches one robot; to be called once a period."""

    def __init__(self, layout: Layout, period_s: float) -> None:
        """Takes a layout, whose body is completed by U-CAT's, and the time between calls [s]."""
        self._vehicle = Vehicle(complete_body(layout))
        self._dt = period_s
        self._dynamics = self._vehicle.dynamics
        self.inertia = np.array(self._vehicle.inertia)[AXES]
        """Mass and moment (4,) with those of the water that goes along [kg, kg m^2]."""
        strength = strongest_wrench(layout)[AXES] / self.inertia
        unknown = UNKNOWN_BY_RUDDERS if layout.by_flow else UNKNOWN_FORCE
        self._noise = period_s * np.concatenate(
            [
                (unknown * strength) ** 2,
                (unknown * LASTING_FORCE / UNKNOWN_FORCE * strength[DRIVEN]) ** 2,
                [CURRENT_CHANGE**2] * 2,
            ]
        )
        self._sensors = np.array([VELOCITY_NOISE] * 3 + [RATE_NOISE]) ** 2
        self._transition = np.eye(9)
        self._transition[DRIVEN, range(4, 7)] = period_s
        times = np.array([POSE_S, POSE_S, POSE_S, TILT_S, TILT_S, POSE_S])
        self._shares = 1.0 - np.exp(-period_s / times)
        # Poses (position, roll, pitch and yaw) and motions of the last periods, the newest first.
        self._poses: deque[Array] = deque(maxlen=max(1, math.ceil(OLDEST_S / period_s)))
        self._motions: deque[Array] = deque(maxlen=self._poses.maxlen)
        self._state = np.zeros(9)
        self._first = np.diag(
            [*self._sensors, *self._noise[UNKNOWN] * 100.0, *[CURRENT_SPEED**2] * 2]
        )
        self._covariance = self._first
        self._last_velocity: Array | None = None
        self._estimate: Estimate | None = None

    def step(self, measurement: Measurement, wrench: Array) -> Estimate:
        """Takes a measurement and the wrench (6,) that the fins have given since the last one, as
        far as known [N, N m]; returns what is believed."""
        m = measurement
        before = self._estimate
        pose = np.array([m.position[0], m.position[1], -m.depth, m.roll, m.pitch, m.yaw])
        if before is None:
            self._state[MOTION] = self._seen(m)
        else:
            self._predict(before, wrench)
            self._correct(m)
            dt = self._dt
            x, y, z = before.position.tolist()
            roll = before.roll + dt * float(m.rates[0])
            pitch = before.pitch + dt * float(m.rates[1])
            yaw = float(self._poses[0][5]) + dt * float(self._state[3])  # counted on over the seam
            counted = np.array([x, y, z, roll, pitch, yaw])
            counted[:3] += dt * in_world(self._state, roll, pitch, yaw)
            marker, pressure, _, imu = m.ages
            missed = pose - self._then(
                self._poses, counted, [marker, marker, pressure, imu, imu, marker]
            )
            missed[5] = float(wrapped(missed[5]))
            pose = counted + self._shares * missed
        self._poses.appendleft(pose)
        self._motions.appendleft(self._state[MOTION].copy())
        self._last_velocity = m.velocity
        roll, pitch, yaw = pose[3:].tolist()
        self._estimate = self._believed(m, pose[:3], roll, pitch, float(wrapped(yaw)))
        return self._estimate

    def _then(self, past: deque[Array], now: Array, ages: Sequence[float]) -> Array:
        """What each of some values was when a sample of it was taken, `ages` [s] ago, between what
        was believed period by period; a sample is held against that, which moves it on to now."""
        if not any(ages):
            return now
        known = np.array([now, *past])
        back = np.minimum(np.array(ages) / self._dt, len(past))
        row = np.minimum(back.astype(int), len(past) - 1)
        each = np.arange(len(now))
        after = known[row, each]
        before = known[row + 1, each]
        return np.asarray(after + (back - row) * (before - after))

    def swayed(self, sway: float, surge: float, yaw_rate: float) -> float:
        """Sideways speed [m/s] a period after `sway` [m/s] by the model, in a turn [rad/s] at a
        speed through the water [m/s]."""
        damping = damping_rates(self._dynamics, (0.0, sway, 0.0, 0.0, 0.0, 0.0))[1]
        pushed = float(self.inertia[0] / self.inertia[1]) * surge * yaw_rate
        return math.exp(-self._dt * damping) * sway - self._dt * pushed

    def slowed_by(self, motion: Array) -> Array:
        """Decelerations (..., 4) that the water gives motions (..., 4) through it, along surge,
        sway, heave and yaw [m/s^2, rad/s^2]."""
        surge, sway, heave, yaw = np.moveaxis(motion, -1, 0)
        rates = damping_rates(self._dynamics, (surge, sway, heave, 0.0, 0.0, yaw))
        return np.stack([rates[k] for k in AXES], axis=-1) * motion

    def wrenches_along(self, setpoints: Sequence[Setpoint], current: Array, slow: float) -> Array:
        """Wrenches (K, 6) [N, N m] of a robot that moves as K setpoints say, at least two, nose
        ahead.

        Args:
            setpoints: a period apart.
            current: horizontal velocity (2,) of the water in the world [m/s].
            slow: speed through the water [m/s] below which turning counts less and less.
        """
        velocity = np.array([setpoint.velocity for setpoint in setpoints])
        acceleration = np.array([setpoint.acceleration for setpoint in setpoints])
        x, y = (velocity[:, :2] - current).T
        ax, ay = acceleration[:, :2].T
        speed = np.hypot(x, y)
        turning = (x * ay - y * ax) / np.maximum(speed * speed, slow * slow)
        faster = (x * ax + y * ay) / np.maximum(speed, 1e-3)
        rest = np.zeros(len(speed))
        motion = np.stack([speed, rest, velocity[:, 2], turning], axis=-1)
        changes = np.stack(
            [faster, rest, acceleration[:, 2], np.gradient(turning, self._dt)], axis=-1
        )
        result = np.zeros((len(speed), 6))
        result[:, AXES] = self.inertia * (changes + self.slowed_by(motion))
        return result

    def _seen(self, m: Measurement) -> Array:
        return np.array([*m.velocity.tolist(), float(m.rates[2])])

    def _predict(self, before: Estimate, wrench: Array) -> None:
        """The state over one period, and how much less is known of it."""
        dt = self._dt
        state = self._state
        transition = self._transition
        cosine = math.cos(before.yaw)
        sine = math.sin(before.yaw)
        c, d = state[CURRENT].tolist()
        flow = state[MOTION].copy()
        flow[:2] -= cosine * c + sine * d, cosine * d - sine * c
        surge, sway, heave, yaw = flow.tolist()
        jacobian = damping_jacobian(self._dynamics, (surge, sway, heave, 0.0, 0.0, yaw))
        kept = np.exp(-dt * np.array([jacobian[k] for k in AXES]))
        transition[range(4), range(4)] = kept
        carried = 1.0 - kept[:2]
        transition[0, CURRENT] = carried[0] * cosine, carried[0] * sine
        transition[1, CURRENT] = -carried[1] * sine, carried[1] * cosine
        state[MOTION] += dt * (before.drift + wrench[AXES] / self.inertia)
        self._covariance = transition @ self._covariance @ transition.T
        self._covariance.ravel()[::10] += self._noise

    def _correct(self, m: Measurement) -> None:
        """What the sensors have seen; a velocity counts where it is a new one."""
        seen = self._seen(m)
        _, _, dvl, imu = m.ages
        missed = seen - self._then(self._motions, self._state[MOTION], [dvl, dvl, dvl, imu])
        if not max(map(abs, missed.tolist())) < ASTRAY:
            self._state[:] = 0.0
            self._covariance = self._first
            self._state[MOTION] = seen
            return
        rows = slice(3 if m.velocity is self._last_velocity else 0, 4)
        covariance = self._covariance
        spread = covariance[rows, rows] + np.diag(self._sensors[rows])
        gain = np.linalg.solve(spread, covariance[rows]).T
        self._state += gain @ missed[rows]
        self._covariance = covariance - gain @ covariance[rows]

    def _believed(
        self, m: Measurement, position: Array, roll: float, pitch: float, yaw: float
    ) -> Estimate:
        u, v, w, r, by_surge, by_heave, by_yaw, c, d = self._state.tolist()
        attitude = quaternion_of(roll, pitch, yaw)
        self._vehicle.current = (c, d, 0.0)
        jacobian = self._vehicle.derivative(
            [0.0, 0.0, 0.0, *attitude, u, v, w, *m.rates[:2].tolist(), r], (0.0,) * 6
        )
        drift = np.array(
            [jacobian[7] + by_surge, jacobian[8], jacobian[9] + by_heave, jacobian[12] + by_yaw]
        )
        velocity = self._state[:3].copy()
        current = self._state[CURRENT].copy()
        world = in_world(velocity, roll, pitch, yaw)
        pitching = float(m.rates[1]), jacobian[11], self._vehicle.inertia[4]
        return Estimate(position, roll, pitch, yaw, velocity, r, world, current, *pitching, drift)


def strongest_wrench(layout: Layout, speed: float = CRUISE) -> Array:
    """Sizes (6,) [N, N m] of what all actuators give along each axis if every one does its best for
    it, at a speed [m/s] that counts for rudders."""
    effectiveness = plant_of(layout).effectiveness
    reach = np.zeros(6)
    for part, own in zip(layout.actuators, effectiveness, strict=True):
        reach += part.largest(speed) * np.linalg.norm(own[list(part.KIND.push_rows)], axis=0)
    return reach
