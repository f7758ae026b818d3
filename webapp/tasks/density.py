"""What the network proposes for each fin: densities over amplitude, frequency and zero direction."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.insight import Insight
from finlab.layout import Layout

Array = NDArray[np.float64]

POINTS = 161
"""Places at which a density is drawn."""
NARROWEST = 0.006
"""Least standard deviation drawn, in normalized commands; a narrower peak would fall between places."""


class Densities(NamedTuple):
    """Curves of one layout, each with its highest point at 1."""

    places: Array
    """Amplitude [deg], frequency [Hz] and zero direction [deg] at which the curves are known (3, POINTS)."""
    curves: Array
    """Densities (n, 3, POINTS) of all fins in the layout's order; NaN for failed ones."""


def densities(insight: Insight, layout: Layout, failed: tuple[str, ...], temperature: float) -> Densities:
    """The mixture for a target, with its variances times the temperature as the sampling has them.

    Args:
        insight: what the network makes of the target and the fins that work.
        layout: the robot.
        failed: names of failed fins.
        temperature: T of the sampling.
    """
    healthy = layout.without(failed) if failed else layout
    weight, mean, std = insight.weight, insight.mean, insight.std
    std = np.maximum(std * np.sqrt(temperature), NARROWEST)
    lower = healthy.lower
    upper = healthy.upper
    places = np.linspace(lower.min(axis=0), upper.max(axis=0), POINTS, axis=1)  # (3, P)
    width = np.maximum(upper - lower, 1e-9)
    at = 2 * (places[None] - lower[:, :, None]) / width[:, :, None] - 1  # (n, 3, P), normalized
    distance = (at[:, None] - mean[..., None]) / std[..., None]  # (n, M, 3, P)
    peaks = np.exp(-0.5 * distance**2) / std[..., None]
    inside = np.einsum("m,nmcp->ncp", weight, peaks) * (np.abs(at) <= 1 + 1e-9)
    curves = np.full((layout.n_fins, 3, POINTS), np.nan)
    rows = [i for i, name in enumerate(layout.names) if name not in failed]
    curves[rows] = inside / np.maximum(inside.max(axis=-1, keepdims=True), 1e-12)
    degrees = np.array([180 / np.pi, 1.0, 180 / np.pi])
    return Densities(places * degrees[:, None], curves)
