"""The rate of change of a noisy signal: derivative of its low-pass."""

from __future__ import annotations

from finlab.control.low_pass import LowPass


class Rate:
    """Derivative after a first-order filter: never steeper than noise over the time constant."""

    def __init__(self, time_constant_s: float, period_s: float) -> None:
        """Takes the filter's time constant [s] and the time between samples [s]."""
        self.period_s = period_s
        self._filter = LowPass(time_constant_s, period_s)

    def reset(self) -> None:
        """Forget all samples."""
        self._filter.reset()

    def step(self, sample: float) -> float:
        """Takes a sample and returns its filtered rate [1/s]; 0 at the first one."""
        before = self._filter.value
        after = self._filter.step(sample)
        return 0.0 if before is None else (after - before) / self.period_s
