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
from finlab.axes import wrapped_angle
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.control.contract import Measurement, Setpoint
from finlab.swim.vehicle.attitude import quaternion_of, rotation_of_quaternion, to_world
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle

AXES = [0, 1, 2, 5]
"""Surge, sway, heave and yaw among the six."""
MOTION = slice(0, 4)
"""Surge, sway and heave speed and yaw rate in the state."""
UNKNOWN = slice(4, 7)
"""The accelerations that the model does not explain in the state."""
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


Vector3 = tuple[float, float, float]
"""Components along three axes."""
Vector4 = tuple[float, float, float, float]
"""Numbers of surge, sway, heave and yaw."""
NO_WRENCH_AT_ALL = (0.0,) * 6
"""No force and no torque [N, N m]."""


class MotionEstimate(NamedTuple):
    """The estimated pose and motion, in plain floats: at this size they are quicker than arrays.
    World: z up; body: x forward, y left, z up."""

    position: Vector3
    """Position in the world [m]."""
    roll: float
    """[rad]."""
    pitch: float
    """[rad], positive with the nose down."""
    yaw: float
    """Heading [rad], wrapped."""
    velocity: Vector3
    """Velocity over ground in the body frame [m/s]."""
    yaw_rate: float
    """[rad/s]."""
    world_velocity: Vector3
    """The velocity in the world [m/s]."""
    current: tuple[float, float]
    """Horizontal velocity of the water in the world [m/s]."""
    pitch_rate: float
    """[rad/s]."""
    pitch_drift: float
    """Angular acceleration in pitch that there would be without any thrust [rad/s^2]."""
    pitch_inertia: float
    """Moment of inertia about y with that of the water that goes along [kg m^2]."""
    drift: Vector4
    """Acceleration along surge, sway, heave and yaw that there would be without any thrust [m/s^2,
    rad/s^2]."""


class AxisDamping(NamedTuple):
    """How the water damps the motion along one axis, alone."""

    linear: float
    """d_1 [N s/m, N m s]."""
    quadratic: float
    """d_2 [N s^2/m^2, N m s^2]."""
    inertia: float
    """m [kg, kg m^2]."""

    def rate(self, speed: float) -> float:
        """Deceleration over the speed [1/s]: (d_1 + d_2 |speed|) / m."""
        return (self.linear + self.quadratic * abs(speed)) / self.inertia

    def slope(self, speed: float) -> float:
        """Derivative of the deceleration by the speed [1/s]; the quadratic part counts twice."""
        return self.rate(2.0 * speed)


class MotionObserver:
    """Watches one robot; to be called once a period."""

    def __init__(self, layout: Layout, period_s: float) -> None:
        """Takes a layout, whose body is completed by U-CAT's, and the time between calls [s]."""
        self._vehicle = Vehicle(complete_body(layout))
        self._dt = period_s
        dynamics = self._vehicle.dynamics
        self.inertia = np.array(self._vehicle.inertia)[AXES]
        """Mass and moment (4,) with those of the water that goes along [kg, kg m^2]."""
        self._linear_damping = np.array(dynamics.linear_damping)[AXES]
        self._quadratic_damping = np.array(dynamics.quadratic_damping)[AXES]
        self.damping = tuple(
            AxisDamping(dynamics.linear_damping[k], dynamics.quadratic_damping[k], mass)
            for k, mass in zip(AXES, self.inertia.tolist(), strict=True)
        )
        """Damping along surge, sway, heave and yaw."""
        self._axes = SharedArray(self.damping)
        self._current = SharedArray(np.zeros(2))
        strength = strongest_wrench(layout)[AXES] / self.inertia
        force_noise = FORCE_NOISE_OF_RUDDERS if layout.flow_driven else FORCE_NOISE
        drift_share = force_noise * FORCE_DRIFT / FORCE_NOISE
        variances = [
            (force_noise * strength) ** 2,
            (drift_share * strength[DRIVEN]) ** 2,
            [CURRENT_DRIFT**2] * 2,
        ]
        noise = period_s * np.concatenate(variances)
        self._noise = SharedArray(noise)  # diagonal of Q (9,)
        sensor_noise = np.array([VELOCITY_NOISE] * 3 + [RATE_NOISE]) ** 2
        self._sensor_noise = SharedArray(sensor_noise)  # diagonal of R (4,)
        self._transition = SharedArray(np.eye(9))
        self._transition.array[DRIVEN, range(4, 7)] = period_s
        self._innovation = SharedArray(np.zeros(4))
        times = np.array([POSE_S, POSE_S, POSE_S, TILT_S, TILT_S, POSE_S])
        self._pose_gain: list[float] = (1.0 - np.exp(-period_s / times)).tolist()
        # Poses (position, roll, pitch and yaw) and motions of the last periods, the newest first.
        self._poses: deque[Sequence[float]] = deque(maxlen=max(1, math.ceil(MAX_AGE_S / period_s)))
        self._motions: deque[Sequence[float]] = deque(maxlen=self._poses.maxlen)
        self._state = SharedArray(np.zeros(9))
        self._covariance_at_start = np.diag(
            [*sensor_noise, *noise[UNKNOWN] * 100.0, *[CURRENT_SPEED**2] * 2]
        )
        self._covariance = SharedArray(self._covariance_at_start)
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
        x, y, _ = m.position.tolist()
        p, q, r = m.rates.tolist()
        motion = [*m.velocity.tolist(), r]
        pose = [x, y, -m.depth, m.roll, m.pitch, m.yaw]
        if before is None:
            self._state.array[MOTION] = motion
            state: list[float] = self._state.array.tolist()
        else:
            predicted = self._predict(before, wrench)
            state = self._corrected(predicted, motion, m)
            pose = self._corrected_pose(before, state, p, q, pose, m)
        self._poses.appendleft(pose)
        self._motions.appendleft(state[MOTION])
        self._last_velocity = m.velocity
        self._estimate = self._estimate_of(state, p, q, pose)
        return self._estimate

    def _corrected_pose(
        self,
        before: MotionEstimate,
        state: list[float],
        roll_rate: float,
        pitch_rate: float,
        measured: list[float],
        m: Measurement,
    ) -> list[float]:
        """The pose by the estimated motion, corrected by a share of what is measured: position in
        the world, roll, pitch and yaw.

        Args:
            before: the estimate a period ago.
            state: of the filter now (9).
            roll_rate: measured [rad/s].
            pitch_rate: measured [rad/s].
            measured: pose (6).
            m: the measurement, for the ages of its samples.
        """
        dt = self._dt
        u, v, w, r = state[MOTION]
        x, y, z = before.position
        roll = before.roll + dt * roll_rate
        pitch = before.pitch + dt * pitch_rate
        yaw = self._poses[0][5] + dt * r  # counted on over the seam
        rotation = rotation_of_quaternion(*quaternion_of(roll, pitch, yaw))
        x_rate, y_rate, z_rate = to_world(rotation, u, v, w)
        predicted = [x + dt * x_rate, y + dt * y_rate, z + dt * z_rate, roll, pitch, yaw]
        marker, pressure, _, imu = m.ages
        ages = (marker, marker, pressure, imu, imu, marker)
        expected = self._when_sampled(self._poses, predicted, ages)
        innovation = [a - b for a, b in zip(measured, expected, strict=True)]
        innovation[5] = wrapped_angle(innovation[5])
        pose = []
        for value, gain, change in zip(predicted, self._pose_gain, innovation, strict=True):
            pose.append(value + gain * change)
        return pose

    def _when_sampled(
        self, past: deque[Sequence[float]], newest: Sequence[float], ages: Sequence[float]
    ) -> Sequence[float]:
        """What k values were when samples of them were taken, between the periods linearly.

        A late sample is held against that: its innovation then counts for now.

        Args:
            past: the values (k) a period ago, two periods ago, and so on.
            newest: the values of now (k).
            ages: how old each sample is (k) [s].
        """
        if not any(ages):
            return newest
        known = [newest, *past]
        oldest = len(past)
        values = []
        for column, age in enumerate(ages):
            if age == 0.0:
                values.append(newest[column])
                continue
            periods_ago = min(age / self._dt, oldest)
            row = min(int(periods_ago), oldest - 1)
            after = known[row][column]
            before = known[row + 1][column]
            values.append(after + (periods_ago - row) * (before - after))
        return values

    def sway_after(self, sway: float, surge: float, yaw_rate: float) -> float:
        """Returns the sway speed after a period by the model: v' = -D v / m_y - m_x / m_y u r.

        Args:
            sway: v, through the water [m/s].
            surge: u, through the water [m/s].
            yaw_rate: r [rad/s].
        """
        along_x, along_y, _, _ = self.damping
        coriolis = along_x.inertia / along_y.inertia * surge * yaw_rate
        return math.exp(-self._dt * along_y.rate(sway)) * sway - self._dt * coriolis

    def deceleration(self, motion: Array) -> Array:
        """Decelerations (..., 4) that the water gives motions (..., 4) through it, along surge,
        sway, heave and yaw [m/s^2, rad/s^2]."""
        damping = self._linear_damping + self._quadratic_damping * np.abs(motion)
        return np.asarray(damping / self.inertia * motion)

    def wrenches_along(
        self, setpoints: Sequence[Setpoint], current: Sequence[float], slow: float
    ) -> Array:
        """Wrenches (K, 6) [N, N m] of a robot that moves as K setpoints say, at least two, nose
        ahead.

        Args:
            setpoints: a period apart.
            current: horizontal velocity (2) of the water in the world [m/s].
            slow: speed through the water [m/s] below which turning counts less and less.
        """
        count = len(setpoints)
        velocity = np.concatenate([each.velocity for each in setpoints], dtype=np.float64)
        acceleration = np.concatenate([each.acceleration for each in setpoints], dtype=np.float64)
        self._current.array[:] = current
        wrenches = np.empty((count, 6))
        library().fl_path_wrenches(
            self._axes.address,
            velocity.ctypes.data,
            acceleration.ctypes.data,
            count,
            self._current.address,
            slow,
            self._dt,
            wrenches.ctypes.data,
        )
        return wrenches

    def _predict(self, before: MotionEstimate, wrench: Array) -> list[float]:
        """The filter over one period: x <- f(x), P <- F P F^T + Q; returns x (9).

        Args:
            before: the estimate at its beginning.
            wrench: (6,) over the period [N, N m].
        """
        dt = self._dt
        F = self._transition.array
        cosine = math.cos(before.yaw)
        sine = math.sin(before.yaw)
        state: list[float] = self._state.array.tolist()
        surge, sway, heave, yaw, _, _, _, current_x, current_y = state
        surge_in_water = surge - (cosine * current_x + sine * current_y)
        sway_in_water = sway - (cosine * current_y - sine * current_x)
        nu_r = (surge_in_water, sway_in_water, heave, yaw)
        decays = []
        for k in range(4):
            decay = math.exp(-dt * self.damping[k].slope(nu_r[k]))
            F[k, k] = decay
            decays.append(decay)
        # What damping takes of a motion it takes towards that of the water.
        by_current_ahead = 1.0 - decays[0]
        by_current_aside = 1.0 - decays[1]
        F[0, 7] = by_current_ahead * cosine
        F[0, 8] = by_current_ahead * sine
        F[1, 7] = -by_current_aside * sine
        F[1, 8] = by_current_aside * cosine
        tau = wrench.tolist()
        for k, axis in enumerate(AXES):
            thrust = tau[axis] / self.damping[k].inertia
            state[k] += dt * (before.drift[k] + thrust)
        library().fl_kalman_predict(
            self._transition.address, self._noise.address, len(state), self._covariance.address
        )
        return state

    def _corrected(
        self, predicted: list[float], measured: list[float], m: Measurement
    ) -> list[float]:
        """The state (9) corrected by the sensors: K = P H^T (H P H^T + R)^-1, x <- x + K
        innovation.

        A velocity counts where it is a new one.

        Args:
            predicted: the state (9).
            measured: surge, sway and heave speed and yaw rate (4) [m/s, rad/s].
            m: the measurement that they come from.
        """
        _, _, dvl, imu = m.ages
        expected = self._when_sampled(self._motions, predicted[MOTION], (dvl, dvl, dvl, imu))
        innovation = [a - b for a, b in zip(measured, expected, strict=True)]
        state = self._state.array
        if not max(map(abs, innovation)) < DIVERGED:
            state[:] = 0.0
            state[MOTION] = measured
            self._covariance.array[:] = self._covariance_at_start
        else:
            state[:] = predicted
            self._innovation.array[:] = innovation
            is_velocity_old = m.velocity is self._last_velocity
            library().fl_kalman_correct(
                self._sensor_noise.address,
                self._innovation.address,
                3 if is_velocity_old else 0,
                4,
                len(predicted),
                self._state.address,
                self._covariance.address,
            )
        corrected: list[float] = state.tolist()
        return corrected

    def _estimate_of(
        self, state: list[float], roll_rate: float, pitch_rate: float, pose: Sequence[float]
    ) -> MotionEstimate:
        """The estimate by the filter's state and a pose.

        Args:
            state: of the filter (9).
            roll_rate: measured, as the filter does not hold it [rad/s].
            pitch_rate: likewise [rad/s].
            pose: position in the world [m], roll, pitch, yaw [rad] (6).
        """
        u, v, w, r, by_surge, by_heave, by_yaw, current_x, current_y = state
        x, y, z, roll, pitch, yaw_counted_on = pose
        yaw = wrapped_angle(yaw_counted_on)
        attitude = quaternion_of(roll, pitch, yaw)
        self._vehicle.current = (current_x, current_y, 0.0)
        rates = self._vehicle.derivative(
            [0.0, 0.0, 0.0, *attitude, u, v, w, roll_rate, pitch_rate, r], NO_WRENCH_AT_ALL
        )
        # The rates of the position are the velocity in the world.
        x_rate, y_rate, z_rate, _, _, _, _, surge, sway, heave, _, pitching, yawing = rates.tolist()
        return MotionEstimate(
            position=(x, y, z),
            roll=roll,
            pitch=pitch,
            yaw=yaw,
            velocity=(u, v, w),
            yaw_rate=r,
            world_velocity=(x_rate, y_rate, z_rate),
            current=(current_x, current_y),
            pitch_rate=pitch_rate,
            pitch_drift=pitching,
            pitch_inertia=self._vehicle.inertia[4],
            drift=(surge + by_surge, sway, heave + by_heave, yawing + by_yaw),
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
