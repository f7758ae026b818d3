"""The cheapest way for one fin to give a thrust: amplitude and frequency as functions of thrust.

For a given direction, many pairs of amplitude and frequency give the same thrust and one of them has
the least energy. Knowing that pair turns allocation from three commands per fin into the choice of
one planar force per fin, in which the wrench is linear. Fins' own laws and the learned one are asked alike.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.layout import FinModelSpec, Layout, Limits
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights, energy_scale
from finlab.physics.fin_law import FinLaw
from finlab.physics.fin_model import file_stamp, make_law

Array = NDArray[Any]

KNOTS = 80
"""Thrust levels per curve, evenly spaced in the fourth root of thrust, in which both commands are
nearly straight lines. Few enough that the products behind a curve stay on one thread."""
AMPLITUDE_FIRST = 0.1
"""Ratio of normalized frequency to amplitude up to the largest amplitude, where inertial power counts."""
DIRECTIONS = 25
"""Zero directions at which a fin's own law is asked for its strongest."""


@dataclass(frozen=True)
class ThrustCurves:
    """Curves of n fins on a common grid of KNOTS points in q = ((T - T_min) / (T_max - T_min))^(1/4)."""

    minimum: Array
    """Smallest thrust (n,) [N]."""
    maximum: Array
    """Largest thrust (n,) [N]."""
    spread: Array
    """How much less than `maximum` the weakest direction that was asked gives (n,) [N]."""
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
    fin: FinLaw, lower: Array, upper: Array, weights: EnergyWeights = DEFAULT_WEIGHTS
) -> ThrustCurves:
    """Curves of fins of one law with limits (n, 3), cheapest by these weights, where they point ahead."""
    limits = zip(lower.tolist(), upper.tolist(), strict=True)
    law: Any = fin  # hashable, by which its curves are kept
    return _stacked([_curve(law, weights, tuple(lo), tuple(hi), 1) for lo, hi in limits])


def plant_curves(layout: Layout) -> ThrustCurves:
    """Curves of a layout's fins by their own laws, each where it is strongest; cheapest by the usual energy.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return _stacked([_plant_curve(fin.limits, fin.model, file_stamp(fin.model)) for fin in layout.fins])


Curve = tuple[float, float, float, Array]
"""Minimum, maximum, spread and table of one fin."""


def _stacked(curves: list[Curve]) -> ThrustCurves:
    minimum, maximum, spread, table = zip(*curves, strict=True)
    return ThrustCurves(np.array(minimum), np.array(maximum), np.array(spread), np.stack(table))


@lru_cache(maxsize=256)
def _plant_curve(limits: Limits, model: FinModelSpec, stamp: tuple[int, int] | None) -> Curve:
    law: Any = make_law(model)
    return _curve(law, DEFAULT_WEIGHTS, limits.lower, limits.upper, DIRECTIONS)


@lru_cache(maxsize=1024)
def _curve(
    fin: FinLaw,
    w: EnergyWeights,
    lower: tuple[float, float, float],
    upper: tuple[float, float, float],
    n_directions: int,
) -> Curve:
    """The curve of one fin, at its strongest of some zero directions, or with one at that nearest to zero.

    Least energy for a thrust means that the gradients of energy and thrust by (amplitude, frequency)
    are parallel. With normalized a and g and thrust elasticities alpha = dlnT/dlna, beta = dlnT/dlng
    this is (2 w_a a + w g) a / ((2 w_g g + w a) g) = alpha / beta: a quadratic for the ratio g / a.
    Thrust is nearly (a g)^2, so the elasticities hardly vary along the way and two sweeps settle them.
    Where the ray of that ratio leaves the limits, the best point is the ray clipped to them; where thrust no
    longer grows, it ends. Inertial power, A^2 f^3, falls with the amplitude at a given thrust: there the
    amplitude goes first.
    """
    scale = energy_scale(np.array(upper))
    nearest = min(max(0.0, lower[2]), upper[2])
    command = np.empty((n_directions, KNOTS, 3))
    command[..., 2] = np.linspace(lower[2], upper[2], n_directions)[:, None] if n_directions > 1 else nearest
    ratio = np.full(KNOTS, AMPLITUDE_FIRST if w.inertial else 1.0)
    for sweep in range(3):
        # s runs along the ray until both commands are at their upper limits.
        s = np.linspace(0.0, max(upper[0] / scale[0], upper[1] / (scale[1] * ratio.min())), KNOTS)
        amplitude = np.clip(s * scale[0], lower[0], upper[0])
        frequency = np.clip(s * ratio * scale[1], lower[1], upper[1])
        command[..., 0], command[..., 1] = amplitude, frequency
        force, slope = fin.force_and_slopes(command)
        thrusts = np.sqrt((force[..., 1:] ** 2).sum(-1)) + 1e-15
        strongest = int(thrusts.argmax()) // KNOTS
        thrust = thrusts[strongest]
        if sweep < 2 and not w.inertial:
            by = (slope[strongest, :, :2, 1:] * force[strongest, :, None, 1:]).sum(-1) / thrust[:, None]
            kappa = np.clip(by[:, 0] * amplitude / np.maximum(by[:, 1] * frequency, 1e-12), 0.1, 10.0)
            kappa = np.where(by.max(axis=1) > 0.0, kappa, 1.0)
            # 2 w_g kappa r^2 + w (kappa - 1) r - 2 w_a = 0
            b = w.product * (kappa - 1.0)
            ratio = (np.sqrt(b * b + 16.0 * w.frequency * w.amplitude * kappa) - b) / (
                4.0 * w.frequency * kappa
            )
    thrust = np.maximum.accumulate(thrust)
    low, high = float(thrust[0]), float(thrust[-1])
    a, f = amplitude / scale[0], frequency / scale[1]
    energy = w.amplitude * a * a + w.frequency * f * f + w.product * a * f + w.inertial * (a * f) ** 2 * f
    rising = slice(int(thrust.argmax()) + 1)
    level = ((thrust[rising] - low) / max(high - low, 1e-15)) ** 0.25
    grid = np.linspace(0.0, 1.0, KNOTS)
    table = [np.interp(grid, level, values[rising]) for values in (amplitude, frequency, energy)]
    return low, high, high - float(thrusts.max(axis=1).min()), np.stack(table, axis=-1)
