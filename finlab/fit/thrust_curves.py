"""Thrust over amplitude beside the samples, at a few frequencies: what pictures of a fit draw."""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.fit.fin_fit import FinFit

POINTS = 60
DIRECTIONS = 8
"""Zero directions over which a thrust is averaged."""


class ThrustCurve(NamedTuple):
    """The fit at one frequency, and the samples of frequencies near it."""

    frequency: float
    """Of the curve: the middle one of its samples [Hz]."""
    band: tuple[float, float]
    """Least and largest frequency of the samples [Hz]."""
    amplitude: Array
    """Half amplitudes [rad], (m,)."""
    thrust: Array
    """Force along the thrust's mean direction, averaged over all zero directions [N], (m,)."""
    deviation: Array
    """Its standard deviation [N], (m,)."""
    samples: Array
    """Amplitude [rad] and measured thrust [N] of each sample (n, 2), moved to the curve's frequency and to
    all zero directions as the fit has it: what stands off the curve is what the fit leaves over."""


def thrust_curves(fit: FinFit, count: int) -> list[ThrustCurve]:
    """Returns `count` curves, rising with the frequency; each has as many samples as the others."""
    command = fit.measurements.command
    rest = fit.measured[:, 0] - fit.mean_thrust(command)[:, 0]
    edges = np.quantile(command[:, 1], np.linspace(0.0, 1.0, count + 1))
    line = np.linspace(0.0, fit.measurements.reach[0], POINTS)
    curves = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (command[:, 1] >= low) & (command[:, 1] <= high)
        middle = float(np.median(command[inside, 1]))
        grid = _turned(fit, np.stack([line, np.full(POINTS, middle)], axis=-1))
        found = np.array(fit.components[0].predict(fit.measurements.scaled(grid)))
        thrust, deviation = fit.largest * found.reshape(2, *grid.shape[:2]).mean(axis=2)
        own = np.interp(command[inside, 0], line, thrust)
        samples = np.stack([command[inside, 0], own + rest[inside]], axis=-1)
        curves.append(ThrustCurve(middle, (float(low), float(high)), line, thrust, deviation, samples))
    return curves


def _turned(fit: FinFit, command: Array) -> Array:
    """Commands (n, `DIRECTIONS`, 3) with these amplitudes and frequencies."""
    turn = fit.directions(DIRECTIONS)
    return np.stack(np.broadcast_arrays(command[:, None, 0], command[:, None, 1], turn), axis=-1)
