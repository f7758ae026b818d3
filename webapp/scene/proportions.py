"""How large things are drawn, so that small and large robots look alike; 1 stands for a U-CAT."""

import math
from functools import lru_cache

import numpy as np

from finlab.hull import hull_of
from finlab.layout import Layout

HALF_DIAGONAL, MEAN_SIZE = 0.3455, 0.35
"""Of the U-CAT's hull: half its diagonal, and the geometric mean of its three sizes [m]."""
APART = 0.12
"""Actuators of size 1 that stand so far apart [m] do not touch."""
STEPS = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0])
"""Lengths of arrows are whole numbers of something that a legend can say."""


@lru_cache(maxsize=8)
def view_size(layout: Layout) -> float:
    """How far the robot reaches, and hence how far off the camera stands."""
    hull = hull_of(layout)
    reach = np.linalg.norm(layout.position - np.array(hull.center), axis=1).max()
    return max(float(np.linalg.norm(hull.half)), float(reach)) / HALF_DIAGONAL


def arrow_size(layout: Layout) -> float:
    """How much larger arrows and rings are than for a U-CAT: one of `STEPS`."""
    return float(STEPS[np.argmin(np.abs(np.log(STEPS / view_size(layout))))])


@lru_cache(maxsize=8)
def part_size(layout: Layout) -> float:
    """Size of the actuators: after the hull, and no larger than there is room between them."""
    between = layout.position[:, None] - layout.position
    apart = np.linalg.norm(between, axis=-1)[~np.eye(layout.n, dtype=bool)]
    by_hull = 2.0 * math.prod(hull_of(layout).half) ** (1 / 3) / MEAN_SIZE
    room = float(apart.min(initial=np.inf)) / APART
    return max(min(by_hull, room), 0.15 * by_hull)
