"""The paper's energy proxy `J_en`, a sum of squares and one product of normalized commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class EnergyWeights:
    """Weights of the terms of `J_en` (paper, inference section)."""

    amplitude: float = 1.0
    """Weight of the squared normalized amplitude."""
    frequency: float = 1.0
    """Weight of the squared normalized frequency."""
    zero_direction: float = 0.1
    """Weight of the squared normalized zero direction."""
    product: float = 1.0
    """Weight of normalized amplitude times normalized frequency."""


DEFAULT_WEIGHTS = EnergyWeights()


def energy_scale(upper: NDArray[np.floating]) -> NDArray[np.float64]:
    """What each command is divided by: its own fin's upper limit.

    A fin whose upper limit is zero or negative (an arc of zero directions below zero, say) would
    blow up or change sign, so the magnitude is taken and floored.

    Args:
        upper: upper limits (..., 3).
    """
    return np.maximum(np.abs(np.asarray(upper, np.float64)), 1e-3)


def fin_energy(
    command: NDArray[np.floating],
    upper: NDArray[np.floating],
    weights: EnergyWeights = DEFAULT_WEIGHTS,
) -> NDArray[np.float64]:
    """Energy of each fin, shape (...,): the summand of the paper's `J_en`."""
    amplitude, frequency, direction = np.moveaxis(np.asarray(command, np.float64) / energy_scale(upper), -1, 0)
    return (
        weights.amplitude * amplitude**2
        + weights.frequency * frequency**2
        + weights.zero_direction * direction**2
        + weights.product * amplitude * frequency
    )


def command_energy(
    command: NDArray[np.floating],
    upper: NDArray[np.floating],
    weights: EnergyWeights = DEFAULT_WEIGHTS,
) -> NDArray[np.float64]:
    """`J_en` of whole robots: commands (..., n, 3) to energies (...,). Failed fins (NaN) count nothing."""
    return np.nansum(fin_energy(command, upper, weights), axis=-1)
