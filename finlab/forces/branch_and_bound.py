"""A lower bound on the cost of a wrench where cost is not convex, by branch and bound over all allocations.

All forces that give a wrench are y = y0 + N z: one set of them, and the null space of the fins' columns,
whose few coordinates z are searched. A box of z holds each fin's force within a disc. Over that disc its cost
is at least that of the smallest force in it; or, all fins' slopes added before their sizes are taken, at
least what a tangent less the cost's curvature allows. Boxes that cannot hold anything better than the answer
are dropped, the others split. From seven fins on the boxes are too many: then what is proven by the end of
the time is returned, which is little.
"""

import time
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.forces.fin_envelope import COST, DRIFT, LEAN, MOBILITY
from finlab.forces.force_space import PlanarProblem
from finlab.layout.angles import wrapped

TOLERANCE = 0.015
"""Share of the answer's cost by which it may exceed the bound; boxes this good are not split."""
TIME_LIMIT_S = 5.0
"""Processor time after which what is proven so far is returned."""
MOST_BOXES = 200_000
"""Boxes that are split at once."""
RANK_TOLERANCE = 1e-9
"""Share of the largest singular value below which another counts as none."""


class Proof(NamedTuple):
    """What branch and bound has proven."""

    bound: float
    """No allocation costs less."""
    finished: bool
    """Whether no box was left that might hold a better answer than the tolerance allows."""


def bound_by_branching(
    problem: PlanarProblem,
    target: Array,
    best: float,
    tolerance: float = TOLERANCE,
    time_limit_s: float = TIME_LIMIT_S,
) -> Proof:
    """Returns a lower bound on the cost of a normalized wrench (6,) that some answer gives at cost `best`.

    The bound holds as far as the compiled tables do: to about one part in a thousand.
    """
    end = time.thread_time() + time_limit_s
    maximum = problem.fins.maximum
    # In shares of each fin's largest force, so that all coordinates of z count alike.
    matrix = (problem.columns * np.tile(maximum, 2)[:, None]).T
    left, values, right = np.linalg.svd(matrix)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    middle = right[:rank].T @ ((left[:, :rank].T @ target) / values[:rank])
    null = right[rank:].T
    n, size = len(maximum), null.shape[1]
    widest = np.abs(null).reshape(2, n, size)
    reach = np.sqrt((widest**2).sum(0)).sum(0) if size else np.zeros(0)
    centre, half = np.zeros((1, size)), np.maximum(reach, 1e-12)[None]
    enough = best * (1.0 - tolerance)
    proven = np.inf
    spread = np.sqrt((null.reshape(2, n, size) ** 2).sum(0))  # how far each z moves each fin (n, d)
    while len(centre):
        least = _least(problem, middle, null, spread, centre, half)
        open_ = least < enough
        if size == 0 or time.thread_time() > end:
            return Proof(float(min(proven, least.min(), best)), size == 0)
        proven = min(proven, float(least[~open_].min(initial=np.inf)))
        centre, half = centre[open_], half[open_]
        if len(centre) > MOST_BOXES:
            return Proof(float(min(proven, least.min(), best)), False)
        rows = np.arange(len(centre))
        axis = (half * spread.max(0)).argmax(1)
        step = np.zeros_like(half)
        step[rows, axis] = 0.5 * half[rows, axis]
        half = half.copy()
        half[rows, axis] *= 0.5
        centre, half = np.concatenate([centre - step, centre + step]), np.concatenate([half, half])
    return Proof(float(min(proven, best)), True)


def _least(
    problem: PlanarProblem, middle: Array, null: Array, spread: Array, centre: Array, half: Array
) -> Array:
    """A lower bound (B,) on the cost within boxes around `centre` (B, d); infinite where none is possible."""
    fins, maximum = problem.fins, problem.fins.maximum
    rows, n = len(centre), len(maximum)
    force = (middle + centre @ null.T).reshape(rows, 2, n) * maximum
    radius = (half @ spread.T) * maximum
    size = np.sqrt((force * force).sum(1))
    direction = np.arctan2(force[:, 1], force[:, 0])
    rim = fins.rim(direction)
    smallest = np.maximum(size - radius, 0.0)
    out = (smallest > maximum * (1.0 + 1e-9)).any(1)
    turn = np.where(size > radius, np.arcsin(np.minimum(radius / np.maximum(size, 1e-300), 1.0)), np.pi)
    if not fins.turns_fully:
        off = np.abs(wrapped(direction - fins.middle)) - fins.half
        out |= ((off > turn) & (smallest > fins.minimum)).any(1)
    near = fins.lookup(rim, smallest)
    marginal = np.maximum(smallest, rim.smallest) / np.exp(near[..., MOBILITY])
    uneven = np.abs(near[..., DRIFT]) * marginal * turn if rim.part is not None else 0.0
    plain = (near[..., COST] - uneven).sum(1)
    # The tangent at the centre, less the curvature that the cost may have towards the origin.
    here = fins.lookup(rim, size)
    slope = size / np.exp(here[..., MOBILITY])
    unit = force / np.maximum(size, 1e-300)[:, None]
    pull = (unit * slope[:, None] * maximum).reshape(rows, 2 * n) @ null
    bend = marginal / np.maximum(smallest, 1e-300)
    curved = np.where(smallest > fins.minimum, 0.5 * bend * radius * radius, np.inf).sum(1)
    tangent = (here[..., COST] - uneven).sum(1) - (np.abs(pull) * half).sum(1) - curved
    least = np.maximum(plain, tangent)
    if not problem.turning_is_free:
        aside = np.maximum(np.abs(wrapped(direction - here[..., LEAN])) - turn, 0.0)
        aside = np.where(smallest > 2.0 * fins.minimum, aside, 0.0)
        least = least + (problem.direction_cost * aside * aside).sum(1)
    return np.where(out, np.inf, least)
