"""Velocity and depth control after the paper's section on the velocity controller: surge, heave, yaw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finlab.control.controller import Measurement, Setpoint
from finlab.control.filters import LowPass, Pid
from finlab.control.gains import VelocityGains, load_gains

Array = NDArray[np.float64]


class VelocityController:
    """Surge PID on the filtered DVL speed, depth PID on pressure, damping of the yaw rate, saturation."""

    name = "velocity"
    axes: tuple[str, ...] = ("Fx", "Fz", "Tz")
    lead_s = 0.0

    def __init__(self, gains: VelocityGains | None = None) -> None:
        """Takes gains; the shipped file `velocity` by default."""
        self.gains = load_gains(VelocityGains, "velocity") if gains is None else gains
        self.period_s = self.gains.period_s
        self._speed = LowPass(self.gains.velocity_filter_s, self.period_s)
        self._surge = Pid(self.gains.surge, self.gains.max_surge, self.period_s)
        self._depth = Pid(self.gains.depth, self.gains.max_heave, self.period_s)

    def reset(self) -> None:
        """Forget filters and integrals."""
        for part in (self._speed, self._surge, self._depth):
            part.reset()

    def wrench(self, measurement: Measurement, setpoint: Setpoint) -> Array:
        """Returns the wrench (6,) towards the speed and depth asked for [N, N m]."""
        g = self.gains
        surge = self._surge.step(setpoint.surge - self._speed.step(float(measurement.velocity[0])))
        heave = self._depth.step(float(setpoint.position[2]) + measurement.depth)
        yaw = min(max(-g.yaw_damping * float(measurement.rates[2]), -g.max_yaw), g.max_yaw)
        return np.array([surge, 0.0, heave, 0.0, 0.0, yaw])
