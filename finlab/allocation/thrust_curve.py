"""The cheapest way for one fin to give a thrust: amplitude and frequency as functions of thrust.

For a given direction, many pairs of amplitude and frequency give the same thrust and one of them has
the least energy. Knowing that pair turns allocation from three commands per fin into the choice of
one planar force per fin, in which the wrench is linear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.energy import DEFAULT_WEIGHTS, energy_scale
from finlab.allocation.learned_fin import LearnedFin

Array = NDArray[np.float64]

KNOTS = 96
"""Thrust levels per curve, evenly spaced in the fourth root of thrust, in which both commands are
nearly straight lines."""
_AMPLITUDES = 161
"""Amplitudes that are tried for each thrust level."""


@dataclass(frozen=True)
class ThrustCurves:
    """Curves of n fins on a common grid of KNOTS points in q = ((T - T_min) / (T_max - T_min))^(1/4)."""

    minimum: Array
    """Smallest thrust (n,) [N]."""
    maximum: Array
    """Largest thrust (n,) [N]."""
    table: Array
    """Amplitude [rad], frequency [Hz] and energy (without zero direction) (n, KNOTS, 3)."""

    def lookup(self, thrust: Array) -> Array:
        """Amplitude, frequency, energy (..., n, 3) of thrusts (..., n), clamped to what each fin can."""
        span = np.maximum(self.maximum - self.minimum, 1e-12)
        q = np.sqrt(np.sqrt(np.clip((thrust - self.minimum) / span, 0.0, 1.0))) * (KNOTS - 1)
        index = np.minimum(q.astype(np.int64), KNOTS - 2)
        part = (q - index)[..., None]
        fin = np.arange(len(self.minimum))
        return self.table[fin, index] * (1.0 - part) + self.table[fin, index + 1] * part


def thrust_curves(fin: LearnedFin, lower: Array, upper: Array) -> ThrustCurves:
    """Curves of fins with limits (n, 3)."""
    curves = [_curve(fin, tuple(lo), tuple(hi)) for lo, hi in zip(lower.tolist(), upper.tolist(), strict=True)]
    return ThrustCurves(
        np.array([c[0] for c in curves]), np.array([c[1] for c in curves]), np.stack([c[2] for c in curves])
    )


@lru_cache(maxsize=4096)
def _curve(
    fin: LearnedFin, lower: tuple[float, float, float], upper: tuple[float, float, float]
) -> tuple[float, float, Array]:
    """Smallest and largest thrust, and the table (KNOTS, 3), of one set of limits."""
    direction = min(max(0.0, lower[2]), upper[2])

    def thrust(amplitude: Array, frequency: Array) -> Array:
        command = np.stack(np.broadcast_arrays(amplitude, frequency, direction), axis=-1).astype(np.float64)
        return np.linalg.norm(fin.force(command)[..., 1:], axis=-1)

    ends = thrust(np.array([lower[0], upper[0]]), np.array([lower[1], upper[1]]))
    low, high = float(ends[0]), float(max(ends[1], ends[0]))
    level = low + (high - low) * np.linspace(0.0, 1.0, KNOTS) ** 4
    # Thrust is nearly (A f)^2 times a constant: two fixed-point steps find the frequency of a thrust.
    amplitude = np.linspace(lower[0], upper[0], _AMPLITUDES)[:, None]
    frequency = np.broadcast_to(np.array(upper[1]), (_AMPLITUDES, KNOTS))
    for _ in range(3):
        frequency = frequency * np.sqrt(level / np.maximum(thrust(amplitude, frequency), 1e-12))
    slack = 1e-6 + 1e-4 * (upper[1] - lower[1])
    possible = (frequency >= lower[1] - slack) & (frequency <= upper[1] + slack)
    scale = energy_scale(np.array(upper))
    a, f = amplitude / scale[0], frequency / scale[1]
    w = DEFAULT_WEIGHTS
    cost = np.where(possible, w.amplitude * a * a + w.frequency * f * f + w.product * a * f, np.inf)
    # At the ends of the range no sampled amplitude may be possible; the nearest frequency serves.
    gap = np.maximum(lower[1] - frequency, frequency - upper[1])
    cost = np.where(possible.any(0), cost, 1e3 + gap)
    best = cost.argmin(0)
    chosen = np.stack([amplitude[best, 0], np.clip(frequency[best, np.arange(KNOTS)], lower[1], upper[1])], axis=-1)
    a, f = chosen[:, 0] / scale[0], chosen[:, 1] / scale[1]
    energy = w.amplitude * a * a + w.frequency * f * f + w.product * a * f
    table = np.concatenate([chosen, energy[:, None]], axis=-1)
    return low, high, table
