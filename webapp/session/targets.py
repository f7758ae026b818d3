"""Target wrenches to start from, and how much of each axis a layout can give."""

import math
from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.forces.fin_sets import SCALE, fin_sets
from finlab.layout import Layout

PRESETS: dict[str, tuple[float, float, float, float, float, float]] = {
    "Cruise": (2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "Turn": (1.2, 0.0, 0.0, 0.0, 0.0, 0.25),
    "Dive": (0.8, 0.0, -1.5, 0.0, 0.0, 0.0),
    "Sway": (0.0, 0.8, 0.0, 0.0, 0.0, 0.0),
    "Zero": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
"""Wrenches by name [N, N m]."""

FIRST = PRESETS["Turn"]
"""What a new session asks for: gently forward, turning left."""


@lru_cache(maxsize=64)
def axis_reach(layout: Layout, failed: tuple[str, ...] = ()) -> Array:
    """Largest size of each wrench component (6,) [N, N m] that the working fins give with the others free."""
    sets = fin_sets(layout, failed)
    both = sets.tile(12).farthest(np.concatenate([np.eye(6), -np.eye(6)]))[0]
    return np.asarray(both.reshape(2, 6).max(axis=0) * SCALE)


@lru_cache(maxsize=64)
def full_thrust(layout: Layout) -> Array:
    """Mean thrust (n,) of each fin at its largest amplitude and frequency [N]."""
    return np.asarray(fin_sets(layout).radius[0])


def slider_end(reach: float) -> float:
    """Where a slider ends: a quarter beyond the reach, to two digits; 1 where there is no reach at all."""
    return float(f"{1.25 * reach:.1e}") if reach > 1e-6 else 1.0


def nice_limit(value: float) -> float:
    """The next of 1, 2, 5, 10, ... above 1.2 times `value`: a scale's end."""
    if value < 1e-6:
        return 1.0
    power = 10.0 ** math.floor(math.log10(1.2 * value))
    return next((factor * power for factor in (1.0, 2.0, 5.0) if factor * power >= 1.2 * value), 10.0 * power)
