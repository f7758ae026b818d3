"""How far each axis can go while the others stay as they are."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.forces.fin_sets import SCALE, convex_parts, fin_sets
from finlab.forces.reach import largest, orthogonal_complement
from finlab.layout import Layout

Array = NDArray[np.float64]

TOLERANCE = 1e-6
"""Where the solver stops: good for a mark on a scale, in a millisecond."""


NOTHING = 1e-6
"""Scaled wrench [N] by which the ends of a range may pass each other and it still is one."""


class Ranges(NamedTuple):
    """What each component of a wrench may be, the other five held; NaN where those five are out of reach."""

    low: Array
    """Smallest values (6,) [N, N m]."""
    high: Array
    """Largest values (6,) [N, N m]."""


def axis_ranges(layout: Layout, wrench: ArrayLike, failed: Collection[str] = ()) -> Ranges:
    """Returns the range of each axis with the others as in a wrench, too wide by about a millionth at most.

    Args:
        layout: the robot.
        wrench: components (6,) [N, N m] that the others are held at.
        failed: fins that push nothing.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    parts = convex_parts(fin_sets(layout, failed))
    n_parts = len(parts.radius)
    basis = orthogonal_complement(axes)
    held = (np.asarray(wrench, dtype=np.float64) / SCALE) @ basis
    found = largest(
        parts.repeat(12),
        np.tile(axes, (n_parts, 1)),
        np.tile(basis, (n_parts, 1, 1)),
        np.tile(held, (n_parts, 1)),
        TOLERANCE,
    )
    size = found.size.reshape(n_parts, 2, 6)
    # Planes that leave nothing between them prove that the five others cannot be had together.
    there = size.sum(axis=1) >= -NOTHING
    high, low = (np.where(there, size[:, k], -np.inf).max(axis=0) for k in range(2))
    return Ranges(*(np.where(there.any(axis=0), value * SCALE, np.nan) + 0.0 for value in (-low, high)))
