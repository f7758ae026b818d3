"""Filters in discrete time: low-pass and PID."""

import math

from finlab.control.gains import PidGains


class LowPass:
    """Follows its input with one time constant; the first sample is taken as it is."""

    def __init__(self, time_constant_s: float, period_s: float) -> None:
        """Takes the time constant [s] (0 passes everything) and the time between samples [s]."""
        self.share = 1.0 if time_constant_s <= 0.0 else 1.0 - math.exp(-period_s / time_constant_s)
        """Share of the difference that is closed per sample."""
        self.value: float | None = None
        """Output after the last sample; None before the first."""

    def step(self, sample: float) -> float:
        """Takes a sample and returns the filtered value."""
        self.value = sample if self.value is None else self.value + self.share * (sample - self.value)
        return self.value


class Pid:
    """u = kp e + ki integral(e) + kd de/dt, limited to +-limit, anti-windup by conditional integration.

    The rate is that of the error after a first-order filter: never steeper than noise over its time constant.
    """

    def __init__(self, gains: PidGains, limit: float, period_s: float) -> None:
        """Takes gains, the largest output [N] and the time between calls [s]."""
        self.gains = gains
        self.limit = limit
        self.period_s = period_s
        self.integral = 0.0
        """Integral part of the output [N]."""
        self._smooth = LowPass(gains.rate_filter_s, period_s)

    def step(self, error: float) -> float:
        """Returns the output for an error."""
        before = self._smooth.value
        after = self._smooth.step(error)
        rate = 0.0 if before is None else (after - before) / self.period_s
        direct = self.gains.kp * error + self.gains.kd * rate
        integral = self.integral + self.gains.ki * error * self.period_s
        output = direct + integral
        if abs(output) <= self.limit or output * error <= 0.0:
            self.integral = integral  # within the limit, or on the way back to it
        return min(max(direct + self.integral, -self.limit), self.limit)
