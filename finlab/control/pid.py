"""PID with a limit on its output; the integral stops where more of it would only push against the limit."""

from __future__ import annotations

from finlab.control.gains import PidGains
from finlab.control.rate import Rate


class Pid:
    """u = kp e + ki integral(e) + kd de/dt, limited to +-limit, anti-windup by conditional integration."""

    def __init__(self, gains: PidGains, limit: float, period_s: float) -> None:
        """Takes gains, the largest output [N] and the time between calls [s]."""
        self.gains = gains
        self.limit = limit
        self.period_s = period_s
        self.integral = 0.0
        """Integral part of the output [N]."""
        self._rate = Rate(gains.rate_filter_s, period_s)

    def reset(self) -> None:
        """Forget the integral and the last error."""
        self.integral = 0.0
        self._rate.reset()

    def step(self, error: float, forward: float = 0.0) -> float:
        """Returns the output for an error, with `forward` added before the limit."""
        direct = self.gains.kp * error + self.gains.kd * self._rate.step(error) + forward
        integral = self.integral + self.gains.ki * error * self.period_s
        output = direct + integral
        if abs(output) <= self.limit or output * error <= 0.0:
            self.integral = integral  # within the limit, or on the way back to it
        return min(max(direct + self.integral, -self.limit), self.limit)
