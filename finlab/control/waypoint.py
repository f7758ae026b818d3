"""Waypoint tracking after the paper's section on the trajectory tracking controller: surge, heave, yaw."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from finlab.control.controller import Measurement, Setpoint
from finlab.control.gains import WaypointGains, load_gains
from finlab.control.odometry import Odometry
from finlab.layout.angles import wrapped

Array = NDArray[np.float64]


class WaypointController:
    """Heads for a waypoint: Fx = k d max(0, cos e), Fz = k dz, Tz = k e, with e the wrapped yaw error.

    To the paper's law we add damping of the climb and of the yaw rate; both gains are zero in
    `waypoint_paper`. Pose and climb come from `Odometry`.
    """

    name = "waypoint"
    axes: tuple[str, ...] = ("Fx", "Fz", "Tz")

    def __init__(self, gains: WaypointGains | None = None) -> None:
        """Takes gains; the shipped file `waypoint` by default."""
        self.gains = load_gains(WaypointGains, "waypoint") if gains is None else gains
        self.lead_s = self.gains.lead_s
        self.period_s = self.gains.period_s
        self._odometry = Odometry(self.gains.odometry_filter_s, self.gains.climb_filter_s, self.period_s)

    def reset(self) -> None:
        """Forget the pose."""
        self._odometry.reset()

    def wrench(self, measurement: Measurement, setpoint: Setpoint) -> Array:
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
        return np.array(
            [
                min(surge, g.max_surge),
                0.0,
                min(max(heave, -g.max_heave), g.max_heave),
                0.0,
                0.0,
                min(max(yaw, -g.max_yaw), g.max_yaw),
            ]
        )
