"""Pose, motion and disturbances of a robot, from sensors and from its own model.

The controllers' observer. An extended Kalman filter holds surge, sway, heave and yaw rate, the
accelerations along surge, heave and yaw that the model does not explain (a wrong damping or
buoyancy, a weak fin), and the current, which shows in how the water carries the robot sideways. It
is carried on by what the actuators give, not by what was asked of them, so nothing winds up where a
wrench is out of reach. Pose comes from these velocities, corrected slowly by markers, pressure and
the IMU's tilt.
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
"""Surge, sway and heave speed and yaw rate in the state."""
UNKNOWN = slice(4, 7)
"""The accelerations that the model does not explain in the state."""
CURRENT = slice(7, 9)
"""The horizontal velocity of the water in the state."""
DRIVEN = [0, 2, 3]
"""Which of the motions the unknown accelerations (3,) change: surge, heave and yaw."""
FORCE_NOISE = 0.006
"""Unknown force that comes and goes, per root of a second, as a share of what all fins can give
together."""
FORCE_NOISE_OF_RUDDERS = 0.15
"""The same of a robot that rudders steer: their force goes with the square of a speed, and moments
of the water on the hull outweigh it."""
FORCE_DRIFT = 0.003
"""The same of the change of the unknown force that is constant."""
CURRENT_SPEED = 0.05
"""Standard deviation of the current that is expected [m/s]."""
CURRENT_DRIFT = 0.002
"""Of its change, per root of a second [m/s]."""
VELOCITY_NOISE = 0.02
"""Expected noise of a measured velocity, with what the fins' beat adds [m/s]."""
RATE_NOISE = 0.04
"""The same of a yaw rate [rad/s]."""
DIVERGED = 1.0
"""An innovation of the motion [m/s, rad/s] from which on it tells nothing of unknown forces: the
model cannot follow, as of a robot that water stops within a period."""
CRUISE = 1.0
"""Speed [m/s] at which the strength of rudders counts."""
MAX_AGE_S = 0.5
"""Age from which on a sample counts as so old [s]."""
POSE_S = 1.5
"""Time constant with which measured positions and headings correct predicted ones [s]."""
TILT_S = 1.0
"""The same of roll and pitch [s]."""


class MotionEstimate(NamedTuple):
    """The estimated pose and motion. World: z up; body: x forward, y left, z up."""

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
        force_noise = FORCE_NOISE_OF_RUDDERS if layout.flow_driven else FORCE_NOISE
        drift_share = force_noise * FORCE_DRIFT / FORCE_NOISE
        variances = [
            (force_noise * strength) ** 2,
            (drift_share * strength[DRIVEN]) ** 2,
            [CURRENT_DRIFT**2] * 2,
        ]
        self._noise = period_s * np.concatenate(variances)  # diagonal of Q (9,)
        self._sensor_noise = np.array([VELOCITY_NOISE] * 3 + [RATE_NOISE]) ** 2  # of R (4,)
        self._transition = np.eye(9)
        self._transition[DRIVEN, range(4, 7)] = period_s
        times = np.array([POSE_S, POSE_S, POSE_S, TILT_S, TILT_S, POSE_S])
        self._pose_gain = 1.0 - np.exp(-period_s / times)
        # Poses (position, roll, pitch and yaw) and motions of the last periods, the newest first.
        self._poses: deque[Array] = deque(maxlen=max(1, math.ceil(MAX_AGE_S / period_s)))
        self._motions: deque[Array] = deque(maxlen=self._poses.maxlen)
        self._state = np.zeros(9)
        self._covariance_at_start = np.diag(
            [*self._sensor_noise, *self._noise[UNKNOWN] * 100.0, *[CURRENT_SPEED**2] * 2]
        )
        self._covariance = self._covariance_at_start
        self._last_velocity: Array | None = None
        self._estimate: MotionEstimate | None = None

    def step(self, measurement: Measurement, wrench: Array) -> MotionEstimate:
        """Predicts over a period and corrects by a measurement.

        Args:
            measurement: of now.
            wrench: (6,) that the actuators have given since the last one, as far as known [N, N m].
        """
        m = measurement
        before = self._estimate
        pose = np.array([m.position[0], m.position[1], -m.depth, m.roll, m.pitch, m.yaw])
        if before is None:
            self._state[MOTION] = self._measured_motion(m)
        else:
            self._predict(before, wrench)
            self._correct(m)
            dt = self._dt
            x, y, z = before.position.tolist()
            roll = before.roll + dt * float(m.rates[0])
            pitch = before.pitch + dt * float(m.rates[1])
            yaw = float(self._poses[0][5]) + dt * float(self._state[3])  # counted on over the seam
            predicted = np.array([x, y, z, roll, pitch, yaw])
            predicted[:3] += dt * in_world(self._state, roll, pitch, yaw)
            marker, pressure, _, imu = m.ages
            ages = [marker, marker, pressure, imu, imu, marker]
            innovation = pose - self._when_sampled(self._poses, predicted, ages)
            innovation[5] = float(wrapped(innovation[5]))
            pose = predicted + self._pose_gain * innovation
        self._poses.appendleft(pose)
        self._motions.appendleft(self._state[MOTION].copy())
        self._last_velocity = m.velocity
        roll, pitch, yaw = pose[3:].tolist()
        self._estimate = self._estimate_of(m, pose[:3], roll, pitch, float(wrapped(yaw)))
        return self._estimate

    def _when_sampled(self, past: deque[Array], newest: Array, ages: Sequence[float]) -> Array:
        """What k values (k,) were when samples of them were taken, between the periods linearly.

        A late sample is held against that: its innovation then counts for now.

        Args:
            past: the values (k,) a period ago, two periods ago, and so on.
            newest: the values of now (k,).
            ages: how old each sample is (k,) [s].
        """
        if not any(ages):
            return newest
        known = np.array([newest, *past])
        periods_ago = np.minimum(np.array(ages) / self._dt, len(past))
        row = np.minimum(periods_ago.astype(int), len(past) - 1)
        column = np.arange(len(newest))
        after = known[row, column]
        before = known[row + 1, column]
        return np.asarray(after + (periods_ago - row) * (before - after))

    def sway_after(self, sway: float, surge: float, yaw_rate: float) -> float:
        """Returns the sway speed after a period by the model: v' = -D v / m_y - m_x / m_y u r.

        Args:
            sway: v, through the water [m/s].
            surge: u, through the water [m/s].
            yaw_rate: r [rad/s].
        """
        damping = damping_rates(self._dynamics, (0.0, sway, 0.0, 0.0, 0.0, 0.0))[1]
        coriolis = float(self.inertia[0] / self.inertia[1]) * surge * yaw_rate
        return math.exp(-self._dt * damping) * sway - self._dt * coriolis

    def deceleration(self, motion: Array) -> Array:
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
        surge_rate = (x * ax + y * ay) / np.maximum(speed, 1e-3)
        yaw_acceleration = np.gradient(turning, self._dt)
        no_sway = np.zeros(len(speed))
        nu = np.stack([speed, no_sway, velocity[:, 2], turning], axis=-1)  # (K, 4)
        nu_rate = np.stack([surge_rate, no_sway, acceleration[:, 2], yaw_acceleration], axis=-1)
        result = np.zeros((len(speed), 6))
        result[:, AXES] = self.inertia * (nu_rate + self.deceleration(nu))
        return result

    def _measured_motion(self, m: Measurement) -> Array:
        """Surge, sway and heave speed and yaw rate (4,) by the sensors [m/s, rad/s]."""
        return np.array([*m.velocity.tolist(), float(m.rates[2])])

    def _predict(self, before: MotionEstimate, wrench: Array) -> None:
        """The filter over one period: x <- f(x), P <- F P F^T + Q.

        Args:
            before: the estimate at its beginning.
            wrench: (6,) over the period [N, N m].
        """
        dt = self._dt
        state = self._state
        F = self._transition
        cosine = math.cos(before.yaw)
        sine = math.sin(before.yaw)
        current_x, current_y = state[CURRENT].tolist()
        nu_r = state[MOTION].copy()
        nu_r[0] -= cosine * current_x + sine * current_y
        nu_r[1] -= cosine * current_y - sine * current_x
        surge, sway, heave, yaw = nu_r.tolist()
        jacobian = damping_jacobian(self._dynamics, (surge, sway, heave, 0.0, 0.0, yaw))
        decay = np.exp(-dt * np.array([jacobian[k] for k in AXES]))
        F[range(4), range(4)] = decay
        # What damping takes of a motion it takes towards that of the water.
        by_current = 1.0 - decay[:2]
        F[0, CURRENT] = by_current[0] * cosine, by_current[0] * sine
        F[1, CURRENT] = -by_current[1] * sine, by_current[1] * cosine
        state[MOTION] += dt * (before.drift + wrench[AXES] / self.inertia)
        self._covariance = F @ self._covariance @ F.T
        self._covariance.ravel()[::10] += self._noise  # its diagonal

    def _correct(self, m: Measurement) -> None:
        """Corrects the state by the sensors: K = P H^T (H P H^T + R)^-1, x <- x + K innovation.

        A velocity counts where it is a new one.
        """
        measured = self._measured_motion(m)
        _, _, dvl, imu = m.ages
        expected = self._when_sampled(self._motions, self._state[MOTION], [dvl, dvl, dvl, imu])
        innovation = measured - expected
        if not max(map(abs, innovation.tolist())) < DIVERGED:
            self._state[:] = 0.0
            self._covariance = self._covariance_at_start
            self._state[MOTION] = measured
            return
        rows = slice(3 if m.velocity is self._last_velocity else 0, 4)
        P = self._covariance
        S = P[rows, rows] + np.diag(self._sensor_noise[rows])
        K = np.linalg.solve(S, P[rows]).T
        self._state += K @ innovation[rows]
        self._covariance = P - K @ P[rows]

    def _estimate_of(
        self, m: Measurement, position: Array, roll: float, pitch: float, yaw: float
    ) -> MotionEstimate:
        """The estimate by the filter's state and a pose.

        Args:
            m: the measurement, for the rates that the filter does not hold.
            position: in the world (3,) [m].
            roll: about x [rad].
            pitch: about y [rad].
            yaw: about z [rad].
        """
        u, v, w, r, by_surge, by_heave, by_yaw, current_x, current_y = self._state.tolist()
        attitude = quaternion_of(roll, pitch, yaw)
        self._vehicle.current = (current_x, current_y, 0.0)
        rate = self._vehicle.derivative(
            [0.0, 0.0, 0.0, *attitude, u, v, w, *m.rates[:2].tolist(), r], (0.0,) * 6
        )
        velocity = self._state[:3].copy()
        return MotionEstimate(
            position=position,
            roll=roll,
            pitch=pitch,
            yaw=yaw,
            velocity=velocity,
            yaw_rate=r,
            world_velocity=in_world(velocity, roll, pitch, yaw),
            current=self._state[CURRENT].copy(),
            pitch_rate=float(m.rates[1]),
            pitch_drift=rate[11],
            pitch_inertia=self._vehicle.inertia[4],
            drift=np.array([rate[7] + by_surge, rate[8], rate[9] + by_heave, rate[12] + by_yaw]),
        )


def strongest_wrench(layout: Layout, speed: float = CRUISE) -> Array:
    """Returns what all actuators give along each axis if each does its best for it.

    Args:
        layout: the robot.
        speed: through the water [m/s], which counts for rudders.

    Returns:
        Forces and torques (6,) [N, N m], each axis alone.
    """
    largest = np.zeros(6)
    for part, B in zip(layout.actuators, plant_of(layout).effectiveness, strict=True):
        largest += part.largest(speed) * np.linalg.norm(B[list(part.KIND.push_rows)], axis=0)
    return largest
