"""The controller of trajectories: where to go next, how fast, and which wrench that takes.

One law for all robots and methods, by backstepping through three loops. The path loop turns what is
missing of the position into a velocity over ground; the heading loop points the robot so that it
moves that way, with the sideslip that it has in a turn; the velocity loops ask for the wrench that
the robot's own model needs for the acceleration, with the reference's, and against what the
observer cannot explain. All gains follow from one number, how late the actuators are (`gains_for`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped_angle
from finlab.layout import Layout
from finlab.swim.control.completion import axes_of
from finlab.swim.control.contract import Measurement, Setpoint
from finlab.swim.control.observer import (
    AXES,
    CRUISE,
    MotionEstimate,
    MotionObserver,
    Vector3,
    strongest_wrench,
)
from finlab.swim.vehicle.fossen import complete_body, dynamics_of

BY_FORCES = (1.0, 0.756, 0.38)
"""Bandwidths of velocities, heading and path, times the delay."""
BY_RUDDERS = (0.75, 0.24, 0.045)
"""The same of a robot that rudders steer: it has to turn before it goes elsewhere."""
WRENCH_SHARE_MAX = 0.7
"""Share of what all actuators could do for an axis that is asked for at most."""
STEERAGE_SHARE = 0.5
"""Share of the desired speed with which a robot that rudders steer goes on at least, whatever its
heading."""
PATH_FILTER_S = 0.3
"""Time over which the distance to the path is averaged [s]: markers jump."""
TURN_RATE_MAX = 0.6
"""Largest yaw rate that is asked for [rad/s]."""
SLOW = 0.08
"""Velocity through the water [m/s] below which the robot turns less and less to where it should go,
which changes all the time where it keeps a place, and more and more to where the path goes on."""
SPEED_MAX = 3.0
"""Fastest that a robot is asked to go [m/s]."""
CLIMB_MAX = 0.5
"""Sine of the steepest climb that is asked of a robot that dives by its pitch."""
SLIP_FILTER_S = 1.0
"""Time constant with which its vertical slip is known [s]."""
SLIP_MAX = 0.7
"""Sine of the largest sideslip that the heading makes up for."""
RUDDER_GAIN_MAX = 8.0
"""Rudders are taken to give at most this much more than at `CRUISE`, as a share of that."""
SENSOR_DELAY_S = 0.2
"""Delay of sensors and of a control period [s]."""


@dataclass(frozen=True)
class TrackingGains:
    """Bandwidths [rad/s] of the loops, and bounds."""

    velocity: float
    """Of surge and heave speed, and of the yaw rate."""
    heading: float
    """Of the heading."""
    path: float
    """Of the position."""
    max_wrench: tuple[float, ...]
    """Largest wrench that is asked for (6,) [N, N m]."""
    max_speed: float = 0.5
    """Largest velocity over ground that is asked for [m/s]; what the robot can hold, if that is
    more."""


def inverse_delay(layout: Layout) -> float:
    """Inverse of the delay of a robot's actuators, its sensors and a period [1/s]."""
    return 1.0 / (layout.delay_s + SENSOR_DELAY_S)


def max_wrench_of(layout: Layout) -> Array:
    """Largest wrench (6,) that a robot is asked for [N, N m]."""
    return WRENCH_SHARE_MAX * strongest_wrench(layout)


def gains_for(layout: Layout) -> TrackingGains:
    """The gains for one robot, by one rule.

    The slowest actuator and what is behind it (the sensors, the period) are a delay in every loop.
    Of the inverse of that delay, velocities close at 1.0, the heading 1.3 times slower than they,
    and the path round it twice as slow as the heading; of robots that rudders steer see
    `BY_RUDDERS`."""
    bandwidth = inverse_delay(layout)
    dives = "Ty" in axes_of(layout)
    velocity, heading, path = BY_RUDDERS if dives else BY_FORCES
    max_wrench = max_wrench_of(layout)
    # Steady speed ahead under the largest force: d_1 u + d_2 u^2 = Fx.
    body = dynamics_of(complete_body(layout))
    d_1 = body.linear_damping[0]
    d_2 = max(body.quadratic_damping[0], 1e-9)
    steady = (math.sqrt(d_1**2 + 4.0 * d_2 * float(max_wrench[0])) - d_1) / (2.0 * d_2)
    return TrackingGains(
        velocity=velocity * bandwidth,
        heading=heading * bandwidth,
        path=path * bandwidth,
        max_wrench=tuple(max_wrench.tolist()),
        max_speed=min(max(steady, TrackingGains.max_speed), SPEED_MAX),
    )


class TrackingController:
    """Follows a trajectory in surge, heave and yaw, and in sway where no fins have to hold it."""

    name = "tracking"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as its designer knows it."""
        self.layout = layout
        self.gains = gains_for(layout)
        self.axes = axes_of(layout)
        self._sways = "Fy" in self.axes
        self._dives = "Ty" in self.axes
        self._commanded = [axis in self.axes for axis in ("Fx", "Fy", "Fz", "Tz")]
        self.free: tuple[str, ...] = ("Fy",)
        if self._sways:
            self.free = ()
        elif self._dives:
            self.free = ("Fy", "Fz")
        self._wrench_of_rudders = WRENCH_SHARE_MAX * (
            strongest_wrench(layout) - strongest_wrench(layout, 0.0)
        )
        self._has_rudders = bool(self._wrench_of_rudders.any())
        self._max_wrench = np.array(self.gains.max_wrench)
        self.reset()

    def reset(self) -> None:
        """Forget all that was seen."""
        self._observer = MotionObserver(self.layout, self.period_s)
        self._transient_sway = 0.0
        self._vertical_slip = 0.0
        self._path_error: Vector3 | None = None
        self._path_filter_gain = 1.0 - math.exp(-self.period_s / PATH_FILTER_S)
        self._wrench = np.zeros(6)
        self._wrench_bound = self._max_wrench
        self.estimate: MotionEstimate | None = None

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) along the trajectory: tau = M (nu_d' + k (nu_d - nu) - drift).

        Args:
            measurement: of now.
            setpoint: of now.
            delivered: wrench (6,) of the actuators since the last call [N, N m].
        """
        bandwidth = self.gains.velocity
        estimate = self._observer.step(measurement, delivered)
        self.estimate = estimate
        velocity = self._velocity(estimate, setpoint)
        surge, yaw_rate = self._surge_and_turn(estimate, velocity, setpoint)
        cy = math.cos(estimate.yaw)
        sy = math.sin(estimate.yaw)
        vx, vy, vz = velocity
        ax, ay, az = setpoint.acceleration.tolist()
        u, v, _ = estimate.velocity
        nu_error = (
            surge - u,
            cy * vy - sy * vx - v,
            vz - estimate.world_velocity[2],
            yaw_rate - estimate.yaw_rate,
        )
        feedforward = (cy * ax + sy * ay, cy * ay - sy * ax, az, 0.0)
        # Damping in yaw counts at the rate that is wanted: one that the body does not have would
        # spin it.
        damping = self._observer.damping
        in_yaw = damping[3]
        measured = in_yaw.rate(estimate.yaw_rate) * estimate.yaw_rate
        planned = in_yaw.rate(yaw_rate) * yaw_rate
        drift = [*estimate.drift[:3], estimate.drift[3] + (measured - planned)]
        result = np.zeros(6)
        for k, axis in enumerate(AXES):
            if self._commanded[k]:
                acceleration = feedforward[k] + bandwidth * nu_error[k] - drift[k]
                result[axis] = damping[k].inertia * acceleration
        if self._dives:
            pitch_error = self._pitch_rate_error(estimate, velocity)
            result[4] = estimate.pitch_inertia * (bandwidth * pitch_error - estimate.pitch_drift)
        if self._has_rudders:
            # The force of rudders grows with the square of the speed.
            missing_share = max(1.0 - (u / CRUISE) ** 2, -RUDDER_GAIN_MAX)
            self._wrench_bound = self._max_wrench - missing_share * self._wrench_of_rudders
        self._wrench = np.minimum(np.maximum(result, -self._wrench_bound), self._wrench_bound)
        return self._wrench

    def ahead(self, setpoints: Sequence[Setpoint]) -> Array:
        """Returns the wrenches that will be asked for: the last one, and what the path will take
        more than now.

        Args:
            setpoints: K + 1 of them, a period apart, the first that of now.

        Returns:
            Wrenches (K, 6) at those after the first [N, N m].
        """
        current = (0.0, 0.0) if self.estimate is None else self.estimate.current
        # Turning is looked ahead to more cautiously: in a current it is steep where the robot
        # hardly moves through the water, and there the estimated current decides it.
        along = self._observer.wrenches_along(setpoints, current, 2.0 * SLOW)
        expected = self._wrench + along[1:] - along[0]
        bound = self._wrench_bound
        return np.asarray(np.minimum(np.maximum(expected, -bound), bound))

    def _velocity(self, estimate: MotionEstimate, setpoint: Setpoint) -> Vector3:
        """The path loop: the desired velocity over ground in the world [m/s]."""
        x_wanted, y_wanted, z_wanted = setpoint.position.tolist()
        x, y, z = estimate.position
        error = (x_wanted - x, y_wanted - y, z_wanted - z)
        if self._path_error is None:
            self._path_error = error
        else:
            gain = self._path_filter_gain
            ex, ey, ez = self._path_error
            self._path_error = (
                ex + (error[0] - ex) * gain,
                ey + (error[1] - ey) * gain,
                ez + (error[2] - ez) * gain,
            )
        ex, ey, ez = self._path_error
        path = self.gains.path
        path_x, path_y, path_z = setpoint.velocity.tolist()
        vx = path_x + path * ex
        vy = path_y + path * ey
        vz = path_z + path * ez
        speed = math.sqrt(vx * vx + vy * vy + vz * vz)
        share = min(1.0, self.gains.max_speed / max(speed, 1e-9))
        return vx * share, vy * share, vz * share

    def _pitch_rate_error(self, estimate: MotionEstimate, velocity: Vector3) -> float:
        """How much faster to turn in pitch, nose down, for a vertical speed [rad/s].

        Counts with the vertical slip that there is, by a filter of `SLIP_FILTER_S`.

        Args:
            estimate: of now.
            velocity: desired, over ground in the world [m/s].
        """
        u, _, w = estimate.velocity
        speed = max(u, SLOW)
        slip = math.atan(w / speed)
        self._vertical_slip += self.period_s / SLIP_FILTER_S * (slip - self._vertical_slip)
        climb = math.asin(min(max(velocity[2] / speed, -CLIMB_MAX), CLIMB_MAX))
        rate = self.gains.heading * (self._vertical_slip - climb - estimate.pitch)
        return min(max(rate, -TURN_RATE_MAX), TURN_RATE_MAX) - estimate.pitch_rate

    def _surge_and_turn(
        self, estimate: MotionEstimate, velocity: Vector3, setpoint: Setpoint
    ) -> tuple[float, float]:
        """The heading loop: what surge and yaw bring the robot to a velocity.

        Args:
            estimate: of now.
            velocity: desired, over ground in the world [m/s].
            setpoint: of now.

        Returns:
            Surge speed over ground [m/s] and yaw rate [rad/s].
        """
        cosine = math.cos(estimate.yaw)
        sine = math.sin(estimate.yaw)
        current_x, current_y = (0.0, 0.0) if self._sways else estimate.current
        vx, vy, _ = velocity
        u, v, _ = estimate.velocity
        # Desired velocity through the water, and the path's.
        x = vx - current_x
        y = vy - current_y
        speed = math.hypot(x, y)
        path_vx, path_vy, _ = setpoint.velocity.tolist()
        path_x = path_vx - current_x
        path_y = path_vy - current_y
        ax, ay, _ = setpoint.acceleration.tolist()
        path_speed_squared = path_x * path_x + path_y * path_y
        path_turn_rate = (path_x * ay - path_y * ax) / max(path_speed_squared, SLOW**2)
        surge_in_water = u - (cosine * current_x + sine * current_y)
        sway_in_water = v - (cosine * current_y - sine * current_x)
        # Slip that comes from turning otherwise than the path does: to head against it would ring.
        excess_turn_rate = estimate.yaw_rate - path_turn_rate
        self._transient_sway = self._observer.sway_after(
            self._transient_sway, surge_in_water, excess_turn_rate
        )
        slip_sine = (sway_in_water - self._transient_sway) / max(speed, SLOW)
        slip = 0.0 if self._sways else math.asin(min(max(slip_sine, -SLIP_MAX), SLIP_MAX))
        surge = cosine * vx + sine * vy
        if self._dives:  # rudders need steerage way
            surge = max(surge, STEERAGE_SHARE * math.hypot(vx, vy))
        elif speed >= SLOW:
            surge = max(surge, cosine * current_x + sine * current_y)
        # At rest it turns to where the path goes on, or stays as it is; a bit off its place it
        # rather backs than turns about.
        onward = estimate.yaw if math.isnan(setpoint.onward) else setpoint.onward
        missing_speed = max(SLOW - speed, 0.0)
        toward_x = x + missing_speed * math.cos(onward)
        toward_y = y + missing_speed * math.sin(onward)
        heading = math.atan2(toward_y, toward_x) - slip
        yaw_rate = path_turn_rate + self.gains.heading * wrapped_angle(heading - estimate.yaw)
        return surge, min(max(yaw_rate, -TURN_RATE_MAX), TURN_RATE_MAX)
