"""The nearest wrench that a robot can deliver, exactly: a convex problem in the planar forces of its fins.

Of all sums of forces that the fins can give, the one closest to the target w,

    min 1/2 sum_j (w - sum_i B_i y_i)_j^2 / c_j.

An axis with a large c_j hardly counts, one with a tiny c_j must be met: policies are choices of c. A sector
wider than half a turn is not convex; its halves are tried.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.forces.fin_sets import MAX_CUT, FinSets, convex_parts, wide_fins
from finlab.forces.interior_point import Optimum, minimize
from finlab.forces.reach import orthogonal_complement

HELD = 1e-9
"""c of an axis that must be met."""
MISSED = 1e-5
"""Normalized error from which a group of axes counts as not served whole."""
SPOILED = 1e-3
"""Normalized error by which a later group may at most spoil earlier ones."""
TINY = 1e-12
"""Largest force [N] of a fin that is not there."""
UNFELT = 1e-6
"""Share of the largest pull that a fin could feel below which it feels none."""


class Nearest(NamedTuple):
    """What the fins can do nearest to R targets."""

    force: Array
    """Planar forces (R, n, 2) [N]."""
    wrench: Array
    """Normalized wrench (R, 6) of these forces."""
    multiplier: Array
    """What each axis would gain (R, 6): the dual's unknowns."""


def nearest(sets: FinSets, target: Array, c: Array | None = None, hessian: float = 0.0) -> Nearest:
    """Forces whose wrench is nearest to each target.

    Args:
        sets: one robot.
        target: normalized wrenches (R, 6).
        c: what each axis' squared error is divided by (6,), by default one; infinite for one that is ignored.
        bend: what squared forces count beside that, as shares of the fins' largest, a squared error being
            one as large as the strongest fin's wrench. A little of it makes small forces the answer where
            many are as near.
    """
    scale = np.ones(6) if c is None else np.asarray(c, np.float64)
    counts = np.isfinite(scale)
    robots = sets.tile(len(target))
    seen = robots._replace(effectiveness=robots.effectiveness[..., counts])
    found = _best_part(seen, target[:, counts], scale[counts], hessian)
    multiplier = np.zeros(target.shape)
    multiplier[:, counts] = found.multiplier
    return Nearest(found.force, robots.wrench(found.force), multiplier)


def nearest_in_turn(sets: FinSets, target: Array, groups: list[NDArray[np.bool_]]) -> Nearest:
    """Forces that serve groups of axes in order, for one target (6,): each as far as those before allow.

    Args:
        sets: one robot.
        target: normalized wrench (6,).
        groups: masks of axes (6,), most important first, every axis in one of them.
    """
    goal, c = target.copy(), np.full(6, np.inf)
    n = sets.radius.shape[1]
    force, settled = np.zeros((1, n, 2)), np.zeros(n, dtype=bool)
    for group in groups:
        c = np.where(group, 1.0, c)
        rest = sets._replace(radius=np.where(settled, 0.0, sets.radius))
        kept = np.where(settled[:, None], force, 0.0)
        found = nearest(rest, goal - sets.wrench(kept), c)
        served = np.where(settled[:, None], force, found.force)
        wrench = sets.wrench(served)[0]
        if np.linalg.norm((goal - wrench)[c == HELD]) > SPOILED:
            break  # at a corner of its limits a robot has nothing left to give to later groups
        force = served
        if np.linalg.norm((goal - wrench)[group]) > MISSED:
            # All who could lessen what is missing give their all: only one force of theirs does so.
            pull = np.linalg.norm(sets.pull(found.multiplier)[0], axis=-1)
            felt = np.linalg.norm(found.multiplier) * np.sqrt((sets.effectiveness[0] ** 2).sum((1, 2)))
            settled |= pull > UNFELT * felt
        goal, c = np.where(group, wrench, goal), np.where(group, HELD, c)
    return Nearest(force, sets.wrench(force), found.multiplier)


def nearest_along(sets: FinSets, target: Array) -> Nearest:
    """Forces that give the largest share of one target (6,), up to all of it, and nothing beside it."""
    n = sets.radius.shape[1]
    nothing = Nearest(np.zeros((1, n, 2)), np.zeros((1, 6)), np.zeros((1, 6)))
    size = float(np.linalg.norm(target))
    flat = sets.effectiveness.reshape(-1, 6)
    beside = target - flat.T @ np.linalg.lstsq(flat.T, target, rcond=1e-9)[0]
    if size < 1e-12 or np.linalg.norm(beside) > SPOILED * size:
        return nothing  # fins of another direction can give nothing of it alone
    unit = (target / size)[None]
    frame = np.concatenate([unit[:, :, None], orthogonal_complement(unit)], axis=-1)
    seen = sets._replace(effectiveness=sets.effectiveness @ frame[:, None])
    found = _best_part(seen, np.array([[size, *(0.0,) * 5]]), np.array([1.0, *(HELD,) * 5]))
    wrench = sets.wrench(found.force)
    if wrench[0] @ target <= 0.0:  # none of it at all; what is left is rounding
        return nothing
    return Nearest(found.force, wrench, found.multiplier @ frame[0].T)


def _best_part(sets: FinSets, target: Array, c: Array, hessian: float = 0.0) -> Optimum:
    """Optima of R robots with the same arcs, each in the best of its convex parts."""
    strongest = (np.sqrt((sets.effectiveness**2).sum((-1, -2))) * sets.radius).max(-1)
    bent = hessian * (strongest[:, None] / np.maximum(sets.radius, TINY)) ** 2
    hulls = None
    if len(wide_fins(sets)) > MAX_CUT:  # of all beyond the first few, the halves that suit the hull are tried
        hulls = minimize(sets, target, c, bent).force
    parts = convex_parts(sets, hulls)
    count = len(parts.radius) // len(target)
    wanted, bent = np.tile(target, (count, 1)), np.tile(bent, (count, 1))
    found = minimize(parts, wanted, c, bent)
    missing = wanted - parts.wrench(found.force)
    cost = ((missing * missing / c).sum(-1) + (bent * (found.force**2).sum(-1)).sum(-1)).reshape(count, -1)
    best = cost.argmin(0) * len(target) + np.arange(len(target))
    return Optimum(found.force[best], found.multiplier[best])


def wrench_of(effectiveness: Array, force: Array) -> Array:
    """Normalized wrench (R, 6) of planar forces (R, n, 2); columns (2n, 6) as in a `PlanarProblem`."""
    wrench: Array = force.swapaxes(1, 2).reshape(len(force), -1) @ effectiveness
    return wrench
