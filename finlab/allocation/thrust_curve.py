"""The cheapest way for one fin to give a thrust: amplitude and frequency as functions of thrust.

For a given direction, many pairs of amplitude and frequency give the same thrust and one of them has
the least energy. Knowing that pair turns allocation from three commands per fin into the choice of
one planar force per fin, in which the wrench is linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.energy import DEFAULT_WEIGHTS, energy_scale
from finlab.allocation.learned_fin import LearnedFin

Array = NDArray[np.float64]

KNOTS = 128
"""Thrust levels per curve, evenly spaced in the fourth root of thrust, in which both commands are
nearly straight lines."""


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
    """Curves of fins with limits (n, 3).

    Least energy for a thrust means that the gradients of energy and thrust by (amplitude, frequency)
    are parallel. With normalized a and g and thrust elasticities alpha = dlnT/dlna, beta = dlnT/dlng
    this is (2 w_a a + w g) a / ((2 w_g g + w a) g) = alpha / beta: a quadratic for the ratio g / a.
    Thrust is nearly (a g)^2, so the elasticities hardly vary along the way and two sweeps settle them.
    Where the ray of that ratio leaves the limits, the best point is the ray clipped to them.
    """
    scale = energy_scale(upper)
    direction = np.clip(0.0, lower[:, 2], upper[:, 2])[:, None]
    w = DEFAULT_WEIGHTS
    ratio = np.ones((len(lower), KNOTS))
    for sweep in range(3):
        # s runs along the ray until both commands are at their upper limits.
        last = np.maximum(upper[:, 0] / scale[:, 0], upper[:, 1] / (scale[:, 1] * ratio.min(1)))
        s = np.linspace(0.0, 1.0, KNOTS) * last[:, None]
        amplitude = np.clip(s * scale[:, :1], lower[:, :1], upper[:, :1])
        frequency = np.clip(s * ratio * scale[:, 1:2], lower[:, 1:2], upper[:, 1:2])
        command = np.stack([amplitude, frequency, np.broadcast_to(direction, s.shape)], axis=-1)
        force, slope = fin.force_and_jacobian(command)
        thrust = np.sqrt((force[..., 1:] ** 2).sum(-1)) + 1e-15
        if sweep < 2:
            by = (force[..., 1:, None] * slope[..., 1:, :2]).sum(-2) / thrust[..., None]
            kappa = np.clip((by[..., 0] * amplitude) / np.maximum(by[..., 1] * frequency, 1e-12), 0.1, 10.0)
            # 2 w_g kappa r^2 + w (kappa - 1) r - 2 w_a = 0
            b = w.product * (kappa - 1.0)
            ratio = (np.sqrt(b * b + 16.0 * w.frequency * w.amplitude * kappa) - b) / (4.0 * w.frequency * kappa)
    thrust = np.maximum.accumulate(thrust, axis=1)
    minimum, maximum = thrust[:, 0], thrust[:, -1]
    a, f = amplitude / scale[:, :1], frequency / scale[:, 1:2]
    energy = w.amplitude * a * a + w.frequency * f * f + w.product * a * f
    along = np.stack([amplitude, frequency, energy], axis=-1)
    table = np.empty_like(along)
    for i in range(len(lower)):
        level = ((thrust[i] - minimum[i]) / max(maximum[i] - minimum[i], 1e-15)) ** 0.25
        for column in range(3):
            table[i, :, column] = np.interp(np.linspace(0.0, 1.0, KNOTS), level, along[i, :, column])
    return ThrustCurves(minimum, maximum, table)
