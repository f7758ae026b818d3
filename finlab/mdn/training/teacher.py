"""The teacher: descents from many random forces, and the different ways they find to deliver a target."""

from typing import NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.mdn.descent import EffortProblem, descend, realize, wrench
from finlab.mdn.effort_fins import Projected

STARTS = 32
"""Random forces from which each target is tried."""
STEPS = 35
"""Quadratic problems solved from every start."""
MODES = 8
"""Most ways that are distinguished."""
APART = 0.08
"""Mean difference over the fins, in roots of shares, from which two answers are two ways."""
DEAREST = 1.2
"""Cost over the cheapest one's up to which an answer is worth telling."""
EXACT = 0.01
"""Largest residual beside the target or, for small ones, a hundredth of what all fins can give."""


class Ways(NamedTuple):
    """Up to L ways to deliver each of N targets with n fins, cheapest first."""

    force: AnyArray
    """Planar forces (N, L, n) [N], complex."""
    cost: Array
    """Their costs (N, L); infinite where there are no more ways."""


def ways_to_deliver(rng: np.random.Generator, problem: EffortProblem, target: Array) -> Ways:
    """What descents find for normalized targets (N, 6)."""
    rows, maximum = len(target), problem.fins.maximum
    n = len(maximum)
    # A start's small forces are as good as at rest, so few or many fins work.
    size = rng.random((rows * STARTS, n)) ** rng.uniform(1.0, 8.0, (rows * STARTS, 1)) * maximum
    start = size * np.exp(1j * rng.uniform(-np.pi, np.pi, size.shape))
    *_, found = descend(problem, np.repeat(target, STARTS, axis=0), start, STEPS)
    return _different(*_told(problem, target, found), maximum)


def _told(problem: EffortProblem, target: Array, found: Projected) -> tuple[AnyArray, Array]:
    """Forces (N, S, n), complex, and costs (N, S), infinite where the target is missed."""
    count = len(found.size) // len(target)
    _, cost = realize(problem, found)
    missed = np.linalg.norm(np.repeat(target, count, axis=0) - wrench(problem, found.force), axis=1)
    strength = np.linalg.norm(np.repeat(problem.fins.maximum, 2)[:, None] * problem.effectiveness)
    allowed = EXACT * np.minimum(np.linalg.norm(target, axis=1) + 1e-2 * strength, strength)
    cost = np.where(missed <= np.repeat(allowed, count), cost, np.inf)
    return found.force.reshape(len(target), count, -1), cost.reshape(len(target), count)


def root_share(force: AnyArray, largest: Array) -> AnyArray:
    """Forces (..., n), complex, as roots of shares of the largest ones (n,): small ones count, too."""
    share = force / largest
    return np.asarray(share / np.sqrt(np.abs(share) + 1e-12))


def _different(force: AnyArray, cost: Array, largest: Array) -> Ways:
    """The cheapest of each group of answers that are nearly the same."""
    rows, _, n = force.shape
    place, cost = np.arange(rows), cost.copy()
    root = root_share(force, largest)
    kept, costs = np.zeros((rows, MODES, n), dtype=complex), np.full((rows, MODES), np.inf)
    limit = DEAREST * cost.min(1)
    cost[cost > limit[:, None]] = np.inf
    for k in range(MODES):
        best = cost.argmin(1)
        costs[:, k] = cost[place, best]
        kept[:, k] = force[place, best]
        near = np.abs(root - root[place, best][:, None]).mean(-1) < APART
        cost[near] = np.inf
    return Ways(kept, costs)


def shares_of_ways(ways: Ways, sharpness: float) -> Array:
    """Weights (N, L) of the ways, zero where there are none: exp(-(cost - best) / (sharpness best))."""
    best = ways.cost[:, :1]
    with np.errstate(invalid="ignore"):
        weight = np.exp(-(ways.cost / np.maximum(best, 1e-12) - 1.0) / sharpness)
    weight = np.where(np.isfinite(ways.cost), weight, 0.0)
    return np.asarray(weight / np.maximum(weight.sum(1, keepdims=True), 1e-12))
