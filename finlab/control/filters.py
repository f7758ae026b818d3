"""A low-pass filter in discrete time."""

import math


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
