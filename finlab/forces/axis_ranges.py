"""How far each axis can go while the others stay as they are."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.forces.answers import strong
from finlab.forces.dual import Dual, minimize_dual
from finlab.forces.fin_sets import SCALE, fin_sets
from finlab.forces.reach import orthogonal_complement
from finlab.layout import Layout

Array = NDArray[np.float64]

SOFTNESS = (1.0, 0.1, 0.03, 0.01, 1e-3)
"""Softness of the fins' answers, in falling order: good for a mark on a scale, in a millisecond."""


class Ranges(NamedTuple):
    """What each component of a wrench may be, the other five held; NaN where those five are out of reach."""

    low: Array
    """Smallest values (6,) [N, N m]."""
    high: Array
    """Largest values (6,) [N, N m]."""


def axis_ranges(layout: Layout, wrench: ArrayLike, failed: Collection[str] = ()) -> Ranges:
    """Returns the range of each axis with the others as in a wrench, too wide by about a thousandth at most.

    Fins whose arc is wider than half a turn count with the convex hull of what they can push.

    Args:
        layout: the robot.
        wrench: components (6,) [N, N m] that the others are held at.
        failed: fins that push nothing.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    sets = fin_sets([layout], failed).take(np.zeros(12, dtype=np.intp))
    scaled = np.asarray(wrench, dtype=np.float64) / SCALE
    held = np.tile(scaled, (12, 1)) * (1.0 - np.abs(axes))
    pull = np.sqrt((sets.pull(axes) ** 2).sum(-1)).max(-1)
    unit = np.maximum(pull, 1e-6)[:, None] * np.ones(sets.radius.shape[1])
    basis = orthogonal_complement(axes)
    x = np.zeros((12, 5))
    for factor in SOFTNESS:
        dual = Dual(strong, sets, factor * unit, axes, basis, held)
        x = minimize_dual(dual, x, 1e-6 if factor == SOFTNESS[-1] else 1e-3)
    normal = dual.normal(x)
    size = sets.farthest(normal)[0] - (held * normal).sum(-1)
    low, high = -size[6:], size[:6]
    # Planes that leave nothing between them prove that the five others cannot be had together.
    there = high - low >= -1e-6
    return Ranges(*(np.where(there, value * SCALE, np.nan) + 0.0 for value in (low, high)))
