"""What is asked of a robot: wrenches within its reach, on the boundary, beyond it, and paths of them."""

import numpy as np

from finlab.arrays import Array
from finlab.bench.problems import KINDS
from finlab.evaluation.smooth_paths import smooth_path
from finlab.forces.envelopes import largest_forces
from finlab.forces.fin_sets import FinSets
from finlab.forces.out_of_reach import nearest_along
from finlab.layout import Layout, layout_effectiveness
from finlab.physics import plant_of

ASKED = np.repeat(np.arange(len(KINDS)), (6, 2, 1, 1, 1))
"""Kind of each target of a robot."""
FAR = 1e3
"""How many times a robot's usual wrench lies beyond its reach for certain."""
TICKS = 60
"""Wrenches of a path, ten in a second."""
NOISE = 0.02
"""Standard deviation of the noise on each fin's force along a path, as a share of the fin's largest force."""
DOMAIN = 0xBE9D
"""Leads the seed of every draw."""


def targets(layout: Layout, sets: FinSets, sigma: Array, seed: tuple[int, ...]) -> Array:
    """Wrenches (N, 6) [N, N m] of the kinds `ASKED`, of single precision.

    Args:
        layout: the robot.
        sets: what its fins can push, in wrenches over sigma.
        sigma: what errors are divided by (6,).
        seed: of the draws.
    """
    rng, plant = np.random.default_rng((DOMAIN, 0, *seed)), plant_of(layout)
    wrenches = plant.wrench(plant.sample(rng, (len(ASKED),)))
    for row in np.flatnonzero(ASKED):
        farthest = nearest_along(sets, FAR * wrenches[row] / sigma).wrench[0] * sigma
        wrenches[row] = farthest * float(KINDS[ASKED[row]].partition("beyond-")[2] or 1.0)
    return single(wrenches)


def path(layout: Layout, sigma: Array, seed: int, noisy: bool) -> Array:
    """A path (T, 6) [N, N m] that the robot can follow; with noise, the same one with noise on its forces."""
    smooth = smooth_path(layout, sigma, seed, TICKS)
    if not noisy:
        return single(smooth)
    size = NOISE * np.repeat(largest_forces(layout), 2)
    draws = np.random.default_rng((DOMAIN, 1, seed)).standard_normal((TICKS, len(size)))
    return single(smooth + (draws * size) @ layout_effectiveness(layout).T)


def single(values: Array) -> Array:
    """Values that the file, which holds wrenches with single precision, does not change."""
    return values.astype(np.float32).astype(np.float64)
