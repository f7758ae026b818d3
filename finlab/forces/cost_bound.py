"""A lower bound on what a wrench costs, by the convex dual: what no allocation whatever can undercut.

For any multipliers l the cheapest allocation costs at least

    l w + sum_i min_y [ c_i(y) - l B_i y ],

each minimum taken over all that fin i can do, which is what its compiled table holds. Where the cost is
convex, as power is, the multipliers that the search ends with nearly close the gap; an ascent on l closes it
further. The bound is as good as the tables: about one part in a thousand.
"""

import numpy as np

from finlab.arrays import Array
from finlab.forces.fin_envelope import COST, LEVELS, SHAFT, levels
from finlab.forces.force_space import PlanarProblem

ROUNDS = 80
"""Most steps of the ascent."""
CLOSED = 1e-5
"""Step, as a share of the bound, from which on the ascent ends."""


class CostDual:
    """The dual of one layout: multipliers (6,) to a lower bound, for one normalized wrench (6,)."""

    def __init__(self, problem: PlanarProblem, target: Array) -> None:
        fins = problem.fins
        n, count = fins.largest.shape
        self._problem, self._target = problem, target
        table = fins.table.reshape(n, count, LEVELS, -1)
        self._cost, self._shaft = table[..., COST], table[..., SHAFT]
        smallest, largest = fins.smallest[..., None], fins.largest[..., None]
        self._size = smallest + (largest - smallest) * levels()
        share = np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
        self._direction = fins.domain[0][:, None] + fins.domain[1][:, None] * share
        self._uniform = count == 1

    def __call__(self, multiplier: Array) -> tuple[float, Array]:
        """Returns the bound, and its derivative (6,) by the multipliers."""
        problem, fin = self._problem, np.arange(len(self._size))
        pull = (problem.effectiveness @ multiplier).reshape(2, -1).T
        direction = self._direction
        if self._uniform:
            ahead = np.arctan2(pull[:, 1], pull[:, 0]) - problem.fins.middle
            held = np.clip(
                ahead - 2.0 * np.pi * np.rint(ahead / (2.0 * np.pi)), -problem.fins.half, problem.fins.half
            )
            direction = (problem.fins.middle + held)[:, None]
        along = pull[:, :1] * np.cos(direction) + pull[:, 1:] * np.sin(direction)
        sideways = (problem.along_shaft @ multiplier)[:, None, None] * self._shaft
        value = self._cost - along[..., None] * self._size - sideways
        place = value.reshape(len(value), -1).argmin(1)
        k, level = np.divmod(place, LEVELS)
        best = value[fin, k, level]
        # Between the entries of the table it is a little less: a parabola through the neighbours.
        lower = np.clip(level - 1, 0, LEVELS - 3)
        best = best - _dip(
            value[fin, k, lower], value[fin, k, lower + 1], value[fin, k, lower + 2], level - lower
        )
        if not self._uniform:
            first = np.clip(k - 1, 0, value.shape[1] - 3)
            best = best - _dip(
                value[fin, first, level],
                value[fin, first + 1, level],
                value[fin, first + 2, level],
                k - first,
            )
        size, shaft = self._size[fin, k, level], self._shaft[fin, k, level]
        angle = direction[fin, k]
        force = np.concatenate([size * np.cos(angle), size * np.sin(angle)])
        slope = self._target - force @ problem.effectiveness - shaft @ problem.along_shaft
        return float(multiplier @ self._target + best.sum()), slope


def _dip(before: Array, at: Array, after: Array, place: Array) -> Array:
    """How far (n,) the parabola through three entries dips below the middle one, where that is the least."""
    hessian = before - 2.0 * at + after
    dip: Array = np.divide(
        (after - before) ** 2, 8.0 * hessian, out=np.zeros_like(at), where=(hessian > 0.0) & (place == 1)
    )
    return dip


def cost_bound(problem: PlanarProblem, target: Array, multiplier: Array) -> float:
    """Returns a lower bound on the cost of a normalized wrench (6,), from multipliers (6,) of the search on.

    The ascent is a quasi-Newton one (BFGS) with steps halved until the bound rises.
    """
    dual = CostDual(problem, target)
    # With nothing to pay for a wrench, fins cost what they cost at least; no bound need be below that.
    least = dual(np.zeros(6))[0]
    with np.errstate(over="ignore", invalid="ignore"):
        return max(least, _ascent(dual, multiplier))


def _ascent(dual: CostDual, multiplier: Array) -> float:
    """The highest bound on the way up from multipliers (6,)."""
    here, (value, slope) = multiplier, dual(multiplier)
    # The bound rises fastest, to first order, along the wrench that is missing over what it costs per square.
    inverse = np.eye(6) * float(here @ here) / max(abs(value), 1e-12)
    for _ in range(ROUNDS):
        step = inverse @ slope
        for _ in range(20):
            there = here + step
            new_value, new_slope = dual(there)
            if new_value > value:
                break
            step = 0.3 * step
        else:
            break
        inverse = _updated(inverse, there - here, slope - new_slope)
        gain, here, value, slope = new_value - value, there, new_value, new_slope
        if gain <= CLOSED * abs(value):
            break
    return value


def _updated(inverse: Array, change: Array, hessian: Array) -> Array:
    """The inverse curvature (6, 6) after a step that changed the multipliers and the slopes so."""
    scale = float(change @ hessian)
    if not scale > 1e-14:
        return inverse
    shear = np.eye(6) - np.outer(change, hessian) / scale
    return np.asarray(shear @ inverse @ shear.T + np.outer(change, change) / scale)
