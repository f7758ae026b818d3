"""The least energy for a wrench, from the fins' own laws; no checkpoint is asked.

Energy is the paper's proxy `J_en`. Each fin gives its thrust by the cheapest pair of amplitude and frequency.
That cost grows about like the square root of thrust: it is concave, so it pays to let some fins rest, and
there are many local optima. From each of many starts the search goes downhill by touching the cost from above
with a quadratic, solving the convex problem that results exactly, and touching again. Starts rest every fin
and every pair of fins in turn, and some are random. Where a fin's arc is wider than half a turn, each half is
tried. The small cost of the zero direction is left out of the search and counted in the result.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.forces.answers import cheap
from finlab.forces.dual import Dual, minimize_dual
from finlab.forces.fin_sets import SCALE, FinSets, convex_parts, fin_sets
from finlab.forces.reach import max_wrench_along
from finlab.forces.thrust_law import thrust_laws
from finlab.layout import Layout, stack_layouts
from finlab.physics.energy import DEFAULT_WEIGHTS, energy_scale

Array = NDArray[np.float64]

REST = 1e-4
"""Share of its largest thrust below which a fin counts as resting: it may still come back."""
N_RANDOM = 8
"""Random starts."""
N_TOUCHES = 12
"""Times that the cost is touched anew."""
MAX_ROWS = 2048
"""Most searches that are run side by side; more would not fit the caches."""
OFF = 1e-6
"""Scaled wrench [N] by which an answer may miss."""


def least_energy(
    layout: Layout, wrenches: ArrayLike, *, failed: Collection[str] = (), n_random: int = N_RANDOM
) -> Array:
    """Returns the least energy found for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6) / SCALE
    sets = fin_sets(layout, failed)
    robots = convex_parts(sets).repeat(len(wanted))
    target = np.tile(wanted, (len(robots.radius) // max(len(wanted), 1), 1))
    seeds = starts(sets.radius[0], n_random)
    energy = np.full(len(target), np.nan)
    able = np.flatnonzero(within_reach(robots, target))
    for some in np.array_split(able, -(-len(able) * len(seeds) // MAX_ROWS)) if len(able) else ():
        each = np.repeat(some, len(seeds))
        force, good = descend(robots.take(each), target[each], np.tile(seeds, (len(some), 1)))
        cost = np.where(good, planar_energy(layout, failed, force), np.inf)
        best = cost.reshape(len(some), len(seeds)).min(axis=1)
        energy[some] = np.where(np.isfinite(best), best, np.nan)
    return np.asarray(np.fmin.reduce(energy.reshape(-1, len(wanted)), axis=0))


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
        share[row, list(fins)] = REST
    drawn = np.random.default_rng(0).uniform(size=(n_random, n)) ** 2
    return np.concatenate([share, drawn]) * radius


def descend(rows: FinSets, target: Array, thrust: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns the local optima (S, n, 2) [N] next to thrusts (S, n) [N], and which give the target (S, 6)."""
    basis = np.broadcast_to(np.eye(6), (len(target), 6, 6))
    origin, x = np.zeros_like(target), np.zeros_like(target)
    top = np.maximum(rows.radius, 1e-9)
    for _ in range(N_TOUCHES):
        held = np.clip(thrust, REST * top, top)
        # The slope of sqrt(T) over T, which is what a quadratic that touches there bends by.
        bend = held**-1.5 * top**-0.5
        x = minimize_dual(Dual(cheap, rows, bend, origin, basis, target), x)
        force = cheap(rows, rows.pull(x), bend)[1]
        thrust = np.linalg.norm(force, axis=-1)
    return force, np.abs(rows.wrench(force) - target).max(-1) <= OFF


def planar_energy(layout: Layout, failed: Collection[str], force: Array) -> Array:
    """Returns `J_en` (S,) of planar forces (S, n, 2) [N], each given by its fin's cheapest command."""
    limits = stack_layouts([layout])
    lower, upper = limits.lower[0], limits.upper[0]
    thrust = np.linalg.norm(force, axis=-1)
    angle = np.arctan2(force[..., 1], force[..., 0])
    middle = 0.5 * (lower[:, 2] + upper[:, 2])
    angle = middle + (angle - middle + np.pi) % (2 * np.pi) - np.pi
    total = np.zeros(len(force))
    for i, (name, law) in enumerate(zip(layout.names, thrust_laws(layout), strict=True)):
        if name in failed:
            continue
        # A fin at rest points where that costs least.
        rests = thrust[:, i] <= law.minimum
        direction = np.where(rests, np.clip(0.0, lower[i, 2], upper[i, 2]), angle[:, i])
        scaled = direction / energy_scale(upper[i])[2]
        total += law.energy_at(thrust[:, i]) + DEFAULT_WEIGHTS.zero_direction * scaled**2
    return total
