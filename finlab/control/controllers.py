"""The paper's controller of waypoints, and odometry."""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.control.filters import LowPass
from finlab.control.gains import WaypointGains
from finlab.control.measurement import NO_WRENCH, Measurement, Setpoint
from finlab.layout.angles import wrapped
from finlab.vehicle.attitude import in_world


class WaypointController:
    """Heads for a waypoint: Fx = k d max(0, cos e), Fz = k dz, Tz = k e, with e the wrapped yaw error.

    To the paper's law we add damping of the climb and of the yaw rate; both gains are zero in
    `PAPER_WAYPOINT_GAINS`. Pose and climb come from `Odometry`.
    """

    name = "waypoint"
    axes: tuple[str, ...] = ("Fx", "Fz", "Tz")
    free: tuple[str, ...] = ()
    needs_given = False

    def __init__(self, gains: WaypointGains | None = None) -> None:
        """Takes gains; those for U-CAT by default."""
        self.gains = WaypointGains() if gains is None else gains
        self.lead_s = self.gains.lead_s
        self.period_s = self.gains.period_s
        self.reset()

    def reset(self) -> None:
        """Forget the pose."""
        self._odometry = Odometry(self.gains.odometry_filter_s, self.gains.climb_filter_s, self.period_s)

    def wrench(self, measurement: Measurement, setpoint: Setpoint, given: Array = NO_WRENCH) -> Array:
        """Returns the wrench (6,) towards the waypoint [N, N m]."""
        g = self.gains
        position, heading, climb = self._odometry.step(measurement)
        dx, dy, dz = (setpoint.position - position).tolist()
        distance = math.hypot(dx, dy)
        yaw_error = float(wrapped(math.atan2(dy, dx) - heading))
        nearness = min(1.0, distance / g.near_m) if g.near_m > 0.0 else 1.0
        surge = g.surge * distance * max(0.0, math.cos(yaw_error))
        heave = g.heave * dz - g.heave_damping * climb
        yaw = g.yaw * nearness * yaw_error - g.yaw_damping * float(measurement.rates[2])
        most = np.array([g.max_surge, 0.0, g.max_heave, 0.0, 0.0, g.max_yaw])
        return np.array([surge, 0.0, heave, 0.0, 0.0, yaw]).clip(-most, most)


class Pose(NamedTuple):
    """The estimate."""

    position: Array
    """Position (3,) in the world [m]."""
    yaw: float
    """Heading [rad], wrapped."""
    climb: float
    """Speed along the world's z [m/s], low-passed."""


class Odometry:
    """Complementary filter: the DVL and the gyro carry the pose on, markers and pressure correct it.

    The first measurement is taken as it is. The correction has one time constant; what is faster comes from
    the velocities, so steady motion is followed without lag.
    """

    def __init__(self, correction_s: float, climb_filter_s: float, period_s: float) -> None:
        """Takes the time constants of correction and climb filter, and the time between calls [s]."""
        self.period_s = period_s
        self._share = LowPass(correction_s, period_s).share
        self._climb = LowPass(climb_filter_s, period_s)
        self._pose: Pose | None = None

    def step(self, measurement: Measurement) -> Pose:
        """Takes a measurement and returns the pose."""
        seen = np.array([measurement.position[0], measurement.position[1], -measurement.depth])
        if self._pose is None:
            position, yaw = seen, measurement.yaw
        else:
            turned = self._pose.yaw + float(measurement.rates[2]) * self.period_s
            yaw = turned + self._share * float(wrapped(measurement.yaw - turned))
            moved = self._pose.position + _over_ground(measurement, yaw) * self.period_s
            position = moved + self._share * (seen - moved)
        climb = self._climb.step(float(_over_ground(measurement, yaw)[2]))
        self._pose = Pose(position, float(wrapped(yaw)), climb)
        return self._pose


def _over_ground(measurement: Measurement, yaw: float) -> Array:
    """The measured velocity (3,) in the world [m/s], for a heading [rad]."""
    return in_world(measurement.velocity, measurement.roll, measurement.pitch, yaw)
