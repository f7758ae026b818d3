"""What is asked of a robot: wrenches within its reach, on the boundary, beyond it, and paths of them."""

import numpy as np

from finlab.arrays import Array
from finlab.bench.problems import KINDS
from finlab.evaluation.experiments.steadiness import smooth_path
from finlab.forces.envelopes import largest_forces
from finlab.forces.fin_sets import FinSets
from finlab.forces.nearest import nearest, nearest_along
from finlab.layout import Layout, layout_effectiveness
from finlab.physics import plant_of

INSIDE, BOUNDARY = 6, 2
"""Targets of these kinds on each robot; of each further kind there is one."""
FAR = 1e3
"""How many times a robot's usual wrench lies beyond its reach for certain."""
TICKS = 60
"""Wrenches of a path, ten in a second."""
NOISE = 0.02
"""Standard deviation of the noise on each fin's force along a path, as a share of the fin's largest force."""
DOMAIN = 0xBE9D
"""Leads the seed of every draw."""


def targets(layout: Layout, sets: FinSets, sigma: Array, seed: tuple[int, ...]) -> tuple[list[int], Array]:
    """Places in `KINDS` (N,) and wrenches (N, 6) [N, N m].

    Args:
        layout: the robot.
        sets: what its fins can push, in wrenches over sigma.
        sigma: per-axis yardstick (6,).
        seed: of the draws.
    """
    rng, plant = np.random.default_rng((DOMAIN, 0, *seed)), plant_of(layout)
    count = INSIDE + BOUNDARY + len(KINDS) - 2
    usual = plant.wrench(plant.sample(rng, (count,)))
    kinds = [0] * INSIDE + [1] * BOUNDARY + list(range(2, len(KINDS)))
    wrenches = usual.copy()
    for row in range(INSIDE, count):
        farthest = nearest_along(sets, FAR * usual[row] / sigma).wrench[0] * sigma
        kind = KINDS[kinds[row]]
        wrenches[row] = farthest * (1.0 if kind == "boundary" else float(kind.removeprefix("beyond-")))
    return kinds, wrenches


def error_bound(sets: FinSets, wrench: Array, sigma: Array) -> float:
    """Normalized error of a wrench (6,) [N, N m] that no command of the fins undercuts."""
    wanted = wrench / sigma
    found = nearest(sets, wanted[None])
    missing = wanted - found.wrench[0]
    size = float(np.linalg.norm(missing))
    if size < 1e-9:
        return 0.0
    # The plane across what is missing proves it, however well the problem was solved.
    normal = missing / size
    return max(0.0, float(normal @ wanted - sets.farthest(normal[None])[0][0]))


def path(layout: Layout, sigma: Array, seed: int, noisy: bool) -> Array:
    """A path (T, 6) [N, N m] that the robot can follow; with noise, the same one with noise on its forces."""
    smooth = smooth_path(layout, sigma, seed, TICKS)
    if not noisy:
        return smooth
    size = NOISE * np.repeat(largest_forces(layout), 2)
    draws = np.random.default_rng((DOMAIN, 1, seed)).standard_normal((TICKS, len(size)))
    return np.asarray(smooth + (draws * size) @ layout_effectiveness(layout).T)
