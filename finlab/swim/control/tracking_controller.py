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
from finlab.axes import wrapped
from finlab.layout import Layout
from finlab.swim.control.contract import Measurement, Setpoint, axes_of
from finlab.swim.control.observer import AXES, CRUISE, Estimate, MotionObserver, strongest_wrench
from finlab.swim.vehicle.fossen import complete_body, dynamics_of

BY_FORCES, BY_RUDDERS = (1.0, 0.756, 0.38), (0.75, 0.24, 0.045)
"""Bandwidths of velocities, heading and path times the delay; a robot that rudders steer has to
turn before it goes elsewhere."""
LARGEST = 0.7
"""Share of what all actuators could do for an axis that is asked for at most."""
WAY = 0.5
"""Share of the speed that is wanted with which a robot that rudders steer goes on at least,
whatever its heading."""
SMOOTH_S = 0.3
"""Time over which the distance to the path is averaged [s]: markers jump."""
FASTEST_TURN, SLOW = 0.6, 0.08
"""Largest yaw rate that is asked for [rad/s], and velocity through the water [m/s] below which the
robot turns less and less to where it should go, which changes all the time where it keeps a place,
and more and more to where the path goes on."""
FASTEST = 3.0
"""Fastest that a robot is asked to go [m/s]."""
STEEPEST, RISE_S = 0.5, 1.0
"""Sine of the steepest climb that is asked of a robot that dives by its pitch, and the time
constant with which its slip is known [s]."""
MOST_BY_SPEED = 8.0
"""Rudders are taken to give at most this much more than at `CRUISE`, as a share of that."""
BEHIND_S = 0.2
"""Delay [s] of sensors and of a control period."""


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


def pace_of(layout: Layout) -> float:
    """Inverse of the delay of a robot's actuators, its sensors and a period [1/s]."""
    return 1.0 / (layout.delay_s + BEHIND_S)


def most_of(layout: Layout) -> Array:
    """Largest wrench (6,) that a robot is asked for [N, N m]."""
    return LARGEST * strongest_wrench(layout)


def gains_for(layout: Layout) -> TrackingGains:
    """The gains for one robot, by one rule.

    The slowest actuator and what is behind it (the sensors, the period) are a delay in every loop.
    Of the inverse of that delay, velocities close at 1.0, the heading 1.3 times slower than they,
    and the path round it twice as slow as the heading; of robots that rudders steer see
    `BY_RUDDERS`."""
    pace = pace_of(layout)
    dives = "Ty" in axes_of(layout)
    velocity, heading, path = BY_RUDDERS if dives else BY_FORCES
    most = most_of(layout)
    body = dynamics_of(complete_body(layout))
    linear = body.linear_damping[0]
    quadratic = max(body.quadratic_damping[0], 1e-9)
    steady = (math.sqrt(linear**2 + 4.0 * quadratic * float(most[0])) - linear) / (2.0 * quadratic)
    return TrackingGains(
        velocity=velocity * pace,
        heading=heading * pace,
        path=path * pace,
        max_wrench=tuple(most.tolist()),
        max_speed=min(max(steady, TrackingGains.max_speed), FASTEST),
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
        self._commanded = np.array([axis in self.axes for axis in ("Fx", "Fy", "Fz", "Tz")])
        self.free: tuple[str, ...] = () if self._sways else ("Fy", "Fz") if self._dives else ("Fy",)
        self._of_rudders = LARGEST * (strongest_wrench(layout) - strongest_wrench(layout, 0.0))
        self._most = np.array(self.gains.max_wrench)
        self.reset()

    def reset(self) -> None:
        """Forget all that was seen."""
        self._observer = MotionObserver(self.layout, self.period_s)
        self._passing = 0.0
        self._rising = 0.0
        self._away: Array | None = None
        self._smoothing = 1.0 - math.exp(-self.period_s / SMOOTH_S)
        self._wrench = np.zeros(6)
        self._bound = self._most
        self.estimate: Estimate | None = None

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) along the trajectory [N, N m]; `delivered` is that of the fins so
        far."""
        g = self.gains
        now = self.estimate = self._observer.step(measurement, delivered)
        wanted = self._velocity(now, setpoint)
        u_wanted, yaw_rate = self._surge_and_turn(now, wanted, setpoint)
        cy = math.cos(now.yaw)
        sy = math.sin(now.yaw)
        ax, ay, az = setpoint.acceleration.tolist()
        miss = np.array(
            [
                u_wanted - now.velocity[0],
                cy * wanted[1] - sy * wanted[0] - now.velocity[1],
                wanted[2] - now.world_velocity[2],
                yaw_rate - now.yaw_rate,
            ]
        )
        ahead = np.array([cy * ax + sy * ay, cy * ay - sy * ax, az, 0.0])
        drift = now.drift.copy()
        # Damping in yaw counts at the rate that is wanted: one that the body does not have would
        # spin it.
        rates = np.zeros((2, 4))
        rates[:, 3] = now.yaw_rate, yaw_rate
        measured, planned = self._observer.slowed_by(rates)[:, 3]
        drift[3] += measured - planned
        result = np.zeros(6)
        result[AXES] = (
            self._observer.inertia * (ahead + g.velocity * miss - drift) * self._commanded
        )
        if self._dives:
            result[4] = now.pitch_inertia * (
                g.velocity * self._pitch_rate(now, wanted) - now.pitch_drift
            )
        slow = max(1.0 - (float(now.velocity[0]) / CRUISE) ** 2, -MOST_BY_SPEED)
        self._bound = self._most - slow * self._of_rudders
        self._wrench = result.clip(-self._bound, self._bound)
        return self._wrench

    def ahead(self, setpoints: Sequence[Setpoint]) -> Array:
        """Wrenches (K, 6) that will be asked for at the K setpoints after the first, which is that
        of now: the last one, and what the path will take more than now."""
        current = np.zeros(2) if self.estimate is None else self.estimate.current
        # Turning is looked ahead to more cautiously: in a current it is steep where the robot
        # hardly moves through the water, and there the estimated current decides it.
        along = self._observer.wrenches_along(setpoints, current, 2.0 * SLOW)
        return np.asarray((self._wrench + along[1:] - along[0]).clip(-self._bound, self._bound))

    def _velocity(self, now: Estimate, setpoint: Setpoint) -> Array:
        """Velocity over ground (3,) to go with [m/s]."""
        away = setpoint.position - now.position
        self._away = (
            away if self._away is None else self._away + (away - self._away) * self._smoothing
        )
        wanted: Array = setpoint.velocity + self.gains.path * self._away
        speed = math.sqrt(wanted @ wanted)
        return wanted * min(1.0, self.gains.max_speed / max(speed, 1e-9))

    def _pitch_rate(self, now: Estimate, wanted: Array) -> float:
        """How much faster [rad/s] to turn in pitch, nose down, for a vertical speed with the slip
        that there is, which is taken from the last `RISE_S`."""
        speed = max(float(now.velocity[0]), SLOW)
        share = self.period_s / RISE_S
        self._rising += share * (math.atan(float(now.velocity[2]) / speed) - self._rising)
        climb = math.asin(min(max(float(wanted[2]) / speed, -STEEPEST), STEEPEST))
        rate = self.gains.heading * (self._rising - climb - now.pitch)
        return min(max(rate, -FASTEST_TURN), FASTEST_TURN) - now.pitch_rate

    def _surge_and_turn(
        self, now: Estimate, wanted: Array, setpoint: Setpoint
    ) -> tuple[float, float]:
        """Surge speed over ground [m/s] and yaw rate [rad/s] that bring the robot to a velocity
        (3,)."""
        g = self.gains
        cosine = math.cos(now.yaw)
        sine = math.sin(now.yaw)
        c, d = (0.0, 0.0) if self._sways else now.current.tolist()
        # through the water
        x = float(wanted[0]) - c
        y = float(wanted[1]) - d
        speed = math.hypot(x, y)
        vx = float(setpoint.velocity[0]) - c
        vy = float(setpoint.velocity[1]) - d
        ax, ay, _ = setpoint.acceleration.tolist()
        turning = (vx * ay - vy * ax) / max(vx * vx + vy * vy, SLOW**2)
        forward = float(now.velocity[0]) - (cosine * c + sine * d)
        sideways = float(now.velocity[1]) - (cosine * d - sine * c)
        # Slip that comes from turning otherwise than the path does: to head against it would ring.
        self._passing = self._observer.swayed(self._passing, forward, now.yaw_rate - turning)
        slip = math.asin(min(max((sideways - self._passing) / max(speed, SLOW), -0.7), 0.7))
        slip = 0.0 if self._sways else slip
        surge = cosine * float(wanted[0]) + sine * float(wanted[1])
        if self._dives:  # rudders need way
            surge = max(surge, WAY * math.hypot(float(wanted[0]), float(wanted[1])))
        elif speed >= SLOW:
            surge = max(surge, cosine * c + sine * d)
        # At rest it turns to where the path goes on, or stays as it is; a bit off its place it
        # rather backs than turns about.
        onward = now.yaw if math.isnan(setpoint.onward) else setpoint.onward
        rest = max(SLOW - speed, 0.0)
        heading = math.atan2(y + rest * math.sin(onward), x + rest * math.cos(onward)) - slip
        rate = turning + g.heading * float(wrapped(heading - now.yaw))
        return surge, min(max(rate, -FASTEST_TURN), FASTEST_TURN)
