"""The yardsticks of the networks: wrenches over their standard deviations, commands between their limits."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array, Values


class Normalization(NamedTuple):
    """Mean and standard deviation of the wrench over a data set, each of shape (6,) [N, N m]."""

    mean: Array
    std: Array
    """Per-axis standard deviation; `sigma` in the error measure."""

    @classmethod
    def parse(cls, values: Any) -> Normalization:
        """The statistics under the keys `mean` and `std`; a `ValueError` where there are none."""
        try:
            mean, std = (np.asarray(values[name], dtype=np.float64) for name in cls._fields)
        except (KeyError, TypeError, ValueError):
            mean = std = np.empty(0)
        if mean.shape != (6,) or std.shape != (6,) or not (np.isfinite(mean).all() and (std > 0.0).all()):
            raise ValueError("normalization must be six means and six standard deviations above 0")
        return cls(mean, std)


def to_normalized(command: Values, lower: Values, upper: Values) -> Values:
    """Commands (..., 3) between limits (..., 3) to [-1, 1]; a range of no width maps to 0."""
    half = 0.5 * (upper - lower)
    return (command - lower - half) / half.clip(1e-9)


def to_command(x: Values, lower: Values, upper: Values) -> Values:
    """Inverse of `to_normalized`; not clamped."""
    half = 0.5 * (upper - lower)
    return lower + half + x * half
