"""The least energy for a wrench, from the fins' own laws; no checkpoint is asked.

Energy is the paper's proxy `J_en`. Each fin gives its thrust by the cheapest pair of amplitude and frequency.
That cost grows about like the square root of thrust: it is concave, so it pays to let some fins rest, and
there are many local optima. From each of many starts the search in force space goes downhill; what it finds
is then made exact by touching the cost from above with a quadratic and solving the convex problem that
results. Starts rest every fin and every pair of fins in turn, and some are random. Where a fin's arc is wider
than half a turn, each half is tried. The small cost of the zero direction is left out of the search and
counted in the result.
"""

from collections.abc import Collection
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.forces.fin_sets import SCALE, FinSets, convex_parts
from finlab.forces.force_space import PlanarProblem, descend, mobility, planar_problem, polar, realize
from finlab.forces.interior_point import minimize
from finlab.forces.reach import COARSE, FINE, HELD, max_wrench_along
from finlab.forces.thrust_curve import plant_curves
from finlab.layout import Layout

Array = NDArray[np.float64]

RESTING = 1e-4
"""Share of its largest thrust that a fin starts with when it rests: it may still come back."""
N_RANDOM = 16
"""Random starts."""
STEPS = 6
"""Steps of the search from each start."""
KEPT = 20
"""Starts of each wrench whose results are made exact."""
N_TOUCHES = 3
"""Times that the cost is then touched anew."""
OFF = 1e-7
"""Scaled wrench by which an answer may miss, as a share of the strongest fin's."""
MISSED = 5.0
"""What a newton of missing wrench counts when results are compared that are not exact yet."""


def least_energy(
    layout: Layout, wrenches: ArrayLike, *, failed: Collection[str] = (), n_random: int = N_RANDOM
) -> Array:
    """Returns the least energy found for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6) / SCALE
    if len(set(layout.indices(tuple(failed)))) == layout.n_fins:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    problem = plant_problem(layout.without(failed))
    energy = np.full(len(wanted), np.nan)
    able = np.flatnonzero(within_reach(problem.sets.tile(len(wanted)), wanted))
    if len(able):
        seeds = starts(problem.curves.maximum, n_random)
        energy[able] = cheapest(problem, problem.sets, wanted[None, able], seeds)[0]
    return energy


def plant_problem(layout: Layout) -> PlanarProblem:
    """Returns the search in force space over the fins' own laws, in scaled wrenches."""
    return planar_problem(layout, plant_curves(layout), SCALE)


def within_reach(sets: FinSets, target: Array) -> NDArray[np.bool_]:
    """Returns which scaled wrenches (R, 6) the robots can give, all six entries as asked."""
    size = np.linalg.norm(target, axis=-1)
    unit = np.where(size[:, None] > 0.0, target / np.maximum(size, 1e-300)[:, None], np.eye(6)[0])
    return np.asarray(size <= max_wrench_along(sets, unit).size * (1.0 - 1e-6) + 1e-12)


def starts(radius: Array, n_random: int, most_resting: int = 2) -> Array:
    """Returns thrusts (S, n) [N] to start from: up to `most_resting` fins at rest, and some random ones."""
    n = len(radius)
    resting = [fins for k in range(most_resting + 1) for fins in combinations(range(n), k)]
    share = np.ones((len(resting), n))
    for row, fins in enumerate(resting):
        share[row, list(fins)] = RESTING
    drawn = np.random.default_rng(0).uniform(size=(n_random, n)) ** 2
    return np.concatenate([share, drawn]) * radius


def cheapest(problem: PlanarProblem, robots: FinSets, targets: Array, seeds: Array) -> Array:
    """Returns the least energies (P, N) found for wrenches, NaN where none of the answers is exact.

    Args:
        problem: the fins' curves; their places do not count.
        robots: P robots of these fins.
        targets: scaled wrenches (P, N, 6).
        seeds: thrusts (S, n) [N] to start from.
    """
    n_targets, n_seeds = targets.shape[1], len(seeds)
    thrust = np.tile(seeds, (n_targets, 1))
    # Every fin may rest, as in the sets.
    free = replace(problem.curves, minimum=np.zeros_like(problem.curves.minimum))
    found = []  # of each convex part of each robot
    parts = convex_parts(robots)
    wanted = np.tile(targets, (len(parts.radius) // len(robots.radius), 1, 1))
    for columns, middle, half, target in zip(parts.columns, parts.middle, parts.half, wanted, strict=True):
        part = problem.like(columns, middle, half)
        planar = descend(part._replace(curves=free), np.repeat(target, n_seeds, axis=0), thrust, STEPS)
        score = realize(part, planar)[1] + MISSED * np.linalg.norm(planar.residual, axis=-1)
        best = score.reshape(n_targets, n_seeds).argsort(axis=1)[:, :KEPT]
        found.append(planar.thrust.reshape(n_targets, n_seeds, -1)[np.arange(n_targets)[:, None], best])
    kept = found[0].shape[1]
    rows = parts.repeat(n_targets * kept)
    goal = np.repeat(wanted.reshape(-1, 6), kept, axis=0)
    force = _exact(problem, rows, goal, np.concatenate(found).reshape(len(goal), -1))
    energy = realize(problem, polar(problem, force))[1]
    strongest = np.linalg.norm(rows.full_columns(), axis=-1).max(-1)
    missed = np.abs(rows.wrench(force) - goal).max(-1) > OFF * strongest
    energy = (
        np.where(missed, np.inf, energy).reshape(-1, len(robots.radius), n_targets, kept).min(axis=(0, 3))
    )
    return np.where(np.isfinite(energy), energy, np.nan)


def _exact(problem: PlanarProblem, rows: FinSets, target: Array, thrust: Array) -> Array:
    """The local optima (S, n, 2) [N] next to thrusts (S, n) [N] that give targets (S, 6)."""
    for touch in range(N_TOUCHES):
        last = touch == N_TOUCHES - 1
        bend = 1.0 / np.maximum(mobility(problem, np.minimum(thrust, rows.radius)), 1e-300)
        force = minimize(rows, target, np.full(6, HELD), bend, FINE if last else COARSE).force
        thrust = np.linalg.norm(force, axis=-1)
    return force
