"""The cheapest way for one fin to give a thrust: amplitude and frequency as functions of thrust.

For a given direction, many pairs of amplitude and frequency give the same thrust and one of them has
the least energy. Knowing that pair turns allocation from three commands per fin into the choice of
one planar force per fin, in which the wrench is linear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.inference.learned_fin import LearnedFin
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights, energy_scale

Array = NDArray[Any]

KNOTS = 80
"""Thrust levels per curve, evenly spaced in the fourth root of thrust, in which both commands are
nearly straight lines. Few enough that the products behind a curve stay on one thread."""
AMPLITUDE_FIRST = 0.1
"""Ratio of normalized frequency to amplitude up to the largest amplitude, where inertial power counts."""


@dataclass(frozen=True)
class ThrustCurves:
    """Curves of n fins on a common grid of KNOTS points in q = ((T - T_min) / (T_max - T_min))^(1/4)."""

    minimum: Array
    """Smallest thrust (n,) [N]."""
    maximum: Array
    """Largest thrust (n,) [N]."""
    table: Array
    """Amplitude [rad], frequency [Hz] and energy (without zero direction) (n, KNOTS, 3)."""

    @cached_property
    def _rows(self) -> tuple[Array, Array, Array]:
        """Range of thrust (n,) [N], all knots (n * KNOTS, 3), and where each fin's begin (n,)."""
        span = np.maximum(self.maximum - self.minimum, 1e-12)
        return span, self.table.reshape(-1, 3), np.arange(len(span)) * KNOTS

    def lookup(self, thrust: Array) -> Array:
        """Amplitude, frequency, energy (..., n, 3) of thrusts (..., n), clamped to what each fin can."""
        span, table, first = self._rows
        q = (thrust - self.minimum) / span
        np.minimum(np.maximum(q, 0.0, out=q), 1.0, out=q)
        np.sqrt(np.sqrt(q, out=q), out=q)
        q *= KNOTS - 1
        index = q.astype(np.int64)
        np.minimum(index, KNOTS - 2, out=index)
        part = (q - index)[..., None]
        index += first
        found: Array = table.take(index, axis=0)
        found *= 1.0 - part
        index += 1
        above = table.take(index, axis=0)
        above *= part
        found += above
        return found


def thrust_curves(
    fin: LearnedFin, lower: Array, upper: Array, weights: EnergyWeights = DEFAULT_WEIGHTS
) -> ThrustCurves:
    """Curves of fins with limits (n, 3), cheapest by these weights."""
    curves = [
        _curve(fin, weights, tuple(lo), tuple(hi))
        for lo, hi in zip(lower.tolist(), upper.tolist(), strict=True)
    ]
    minimum, maximum, table = zip(*curves, strict=True)
    return ThrustCurves(np.array(minimum), np.array(maximum), np.stack(table))


@lru_cache(maxsize=1024)
def _curve(
    fin: LearnedFin, w: EnergyWeights, lower: tuple[float, float, float], upper: tuple[float, float, float]
) -> tuple[float, float, Array]:
    """Smallest and largest thrust and the table (KNOTS, 3) of one fin.

    Least energy for a thrust means that the gradients of energy and thrust by (amplitude, frequency)
    are parallel. With normalized a and g and thrust elasticities alpha = dlnT/dlna, beta = dlnT/dlng
    this is (2 w_a a + w g) a / ((2 w_g g + w a) g) = alpha / beta: a quadratic for the ratio g / a.
    Thrust is nearly (a g)^2, so the elasticities hardly vary along the way and two sweeps settle them.
    Where the ray of that ratio leaves the limits, the best point is the ray clipped to them. Inertial power,
    A^2 f^3, falls with the amplitude at a given thrust: there the amplitude goes first.
    """
    scale = energy_scale(np.array(upper))
    direction = np.full(KNOTS, min(max(0.0, lower[2]), upper[2]))
    ratio = np.full(KNOTS, AMPLITUDE_FIRST if w.inertial else 1.0)
    for sweep in range(3):
        # s runs along the ray until both commands are at their upper limits.
        s = np.linspace(0.0, max(upper[0] / scale[0], upper[1] / (scale[1] * ratio.min())), KNOTS)
        amplitude = np.clip(s * scale[0], lower[0], upper[0])
        frequency = np.clip(s * ratio * scale[1], lower[1], upper[1])
        force, slope = fin.force_and_jacobian(np.stack([amplitude, frequency, direction], axis=-1))
        thrust = np.sqrt((force[:, 1:] ** 2).sum(-1)) + 1e-15
        if sweep < 2 and not w.inertial:
            by = (force[:, 1:, None] * slope[:, 1:, :2]).sum(-2) / thrust[:, None]
            kappa = np.clip(by[:, 0] * amplitude / np.maximum(by[:, 1] * frequency, 1e-12), 0.1, 10.0)
            # 2 w_g kappa r^2 + w (kappa - 1) r - 2 w_a = 0
            b = w.product * (kappa - 1.0)
            ratio = (np.sqrt(b * b + 16.0 * w.frequency * w.amplitude * kappa) - b) / (
                4.0 * w.frequency * kappa
            )
    thrust = np.maximum.accumulate(thrust)
    low, high = float(thrust[0]), float(thrust[-1])
    a, f = amplitude / scale[0], frequency / scale[1]
    energy = w.amplitude * a * a + w.frequency * f * f + w.product * a * f + w.inertial * (a * f) ** 2 * f
    level = ((thrust - low) / max(high - low, 1e-15)) ** 0.25
    grid = np.linspace(0.0, 1.0, KNOTS)
    return (
        low,
        high,
        np.stack([np.interp(grid, level, values) for values in (amplitude, frequency, energy)], axis=-1),
    )
