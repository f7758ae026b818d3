"""Per-axis statistics of the wrench, the yardstick of every error in the project."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

STD_FLOOR = 1e-6
"""Smallest standard deviation that is divided by, as in the paper (implementation details)."""


class Normalization(NamedTuple):
    """Mean and standard deviation of the wrench over a data set, each of shape (6,) [N, N m]."""

    mean: NDArray[np.float64]
    """Per-axis mean."""
    std: NDArray[np.float64]
    """Per-axis standard deviation; `sigma` in the error measure."""

    @classmethod
    def of(cls, wrenches: NDArray[np.floating]) -> Normalization:
        """Statistics of wrenches of shape (N, 6)."""
        wrenches = np.asarray(wrenches, dtype=np.float64)
        return cls(wrenches.mean(axis=0), np.maximum(wrenches.std(axis=0), STD_FLOOR))

    def error(self, wrench: NDArray[np.floating], target: NDArray[np.floating]) -> NDArray[np.float64]:
        """`err_norm = ||(wrench - target) / std||`, over the last axis."""
        scaled = (np.asarray(wrench, np.float64) - np.asarray(target, np.float64)) / self.std
        return np.asarray(np.linalg.norm(scaled, axis=-1))
