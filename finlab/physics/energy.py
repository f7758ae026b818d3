"""The paper's energy proxy `J_en`, a sum of squares and one product of normalized commands, or its power."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array, Values


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
    inertial: float = 0.0
    """Weight of the squared normalized amplitude times the cubed normalized frequency, to which the power
    that the paper measures, I alpha omega, is proportional."""


DEFAULT_WEIGHTS = EnergyWeights()
"""The contract's `J_en`."""


def energy_scale(upper: Values) -> Values:
    """What each command is divided by: its own fin's upper limit.

    A fin whose upper limit is zero or negative (an arc of zero directions below zero, say) would
    blow up or change sign, so the magnitude is taken and floored.

    Args:
        upper: upper limits (..., 3), an array or a tensor.
    """
    return abs(upper).clip(1e-3)


def energy_of_shares(
    amplitude: Values, frequency: Values, zero_direction: Values, weights: EnergyWeights = DEFAULT_WEIGHTS
) -> Values:
    """One fin's summand of `J_en`, from commands over their scale: arrays, tensors or symbols."""
    a, f, d, w = amplitude, frequency, zero_direction, weights
    energy = w.amplitude * a * a + w.frequency * f * f + w.zero_direction * d * d + w.product * a * f
    return energy + w.inertial * (a * f) ** 2 * f if w.inertial else energy


def fin_energy(command: Values, upper: Values, weights: EnergyWeights = DEFAULT_WEIGHTS) -> Values:
    """Energy (...,) of each fin: commands (..., 3) and upper limits (..., 3), arrays or tensors."""
    scaled = command / energy_scale(upper)
    return energy_of_shares(scaled[..., 0], scaled[..., 1], scaled[..., 2], weights)


def command_energy(
    command: NDArray[np.floating], upper: NDArray[np.floating], weights: EnergyWeights = DEFAULT_WEIGHTS
) -> AnyArray:
    """`J_en` of whole robots: commands (..., n, 3) to energies (...,). Failed fins (NaN) count nothing."""
    energy = fin_energy(command, upper, weights)
    return np.asarray(np.where(np.isnan(energy), 0.0, energy).sum(-1))


class EnergyMeter:
    """The energy proxy of one robot whose fins are all healthy, ready for many commands."""

    def __init__(self, upper: Array, weights: EnergyWeights = DEFAULT_WEIGHTS) -> None:
        """Make it for upper limits (n, 3)."""
        self.upper, self.weights = upper, weights
        squares = np.tile([weights.amplitude, weights.frequency, weights.zero_direction], len(upper))
        self._float64 = energy_scale(upper), squares
        self._float32 = energy_scale(upper).astype(np.float32), squares.astype(np.float32)

    def __call__(self, command: NDArray[np.floating]) -> AnyArray:
        """Energies (R,) of commands (R, n, 3)."""
        scale, squares = self._float32 if command.dtype == np.float32 else self._float64
        scaled = command / scale
        a, f = scaled[..., 0], scaled[..., 1]
        beats: AnyArray = np.einsum("rn,rn->r", a, f)
        beats *= self.weights.product
        if self.weights.inertial:
            beats += self.weights.inertial * ((a * f) ** 2 * f).sum(-1)
        scaled *= scaled
        beats += scaled.reshape(len(scaled), len(squares)).dot(squares)
        return beats

    def slopes(self, command: NDArray[np.floating]) -> AnyArray:
        """Derivatives (R, n, 3) of the energies by commands (R, n, 3)."""
        scale, squares = self._float32 if command.dtype == np.float32 else self._float64
        scaled = command / scale
        a, f, w = scaled[..., 0], scaled[..., 1], self.weights
        slopes: AnyArray = 2 * squares.reshape(scale.shape) * scaled
        slopes[..., 0] += w.product * f + w.inertial * 2 * a * f**3
        slopes[..., 1] += w.product * a + w.inertial * 3 * (a * f) ** 2
        slopes /= scale
        return slopes
