"""The one solver of the analysis: Newton's method on the dual of a problem over the fins' forces.

Each problem asks for planar forces y_i within the fins' convex sets that add up as wanted and push far, or cost
little. Its dual has few unknowns: a direction p = origin + basis x in the space of wrenches. Given p, each fin
answers the pull B_i p alone; `finlab.analysis.answers` holds the two ways to do so, both smoothed so that the
answer is unique. The dual is then smooth and convex, and a Newton step with a line search brings the sum of the
answers to what is wanted. All rows are solved at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.answers import Answer
from finlab.analysis.fin_sets import FinSets

Array = NDArray[np.float64]

MAX_STEPS = 30
"""Most Newton steps of one call."""
MAX_HALVINGS = 12
"""Most times that a step is cut."""
LONGEST = 2.0
"""Longest step, as a multiple of the unknowns' size plus one."""


def minimize_dual(
    sets: FinSets,
    answer: Answer,
    softness: Array,
    origin: Array,
    basis: Array,
    wanted: Array,
    start: Array,
    tolerance: float = 1e-9,
) -> Array:
    """Returns the unknowns x (R, k) that minimize sum_i h_i(B_i p) - wanted . p.

    At the minimum the forces add up to `wanted` in the directions of `basis`.

    Args:
        sets: R robots of n fins.
        answer: how the fins answer; it defines h.
        softness: of the answers (R, n), positive.
        origin: (R, 6).
        basis: (R, 6, k).
        wanted: scaled wrenches (R, 6).
        start: first x (R, k).
        tolerance: share of the largest wrench by which the sum may be off.
    """
    x = start.copy()
    size = np.sqrt((sets.columns**2).sum((-1, -2)))
    # A fin that is lost has no say; one newton keeps the yardstick positive where all are.
    capacity = np.maximum((size * sets.radius).sum(-1), 1e-9)
    # Where nothing is wanted the value cannot fall below zero: a row that gets there is done.
    floor = np.where((wanted == 0.0).all(-1), 1e-11 * capacity, -np.inf)
    busy = np.arange(len(x))
    part = (sets, softness, origin, basis, wanted)
    value, slope, bend = _evaluate(answer, *part, x)
    for _ in range(MAX_STEPS):
        open_ = (np.abs(slope).max(-1) > tolerance * capacity[busy]) & (value > floor[busy])
        if not open_.any():
            break
        if not open_.all():
            busy = busy[open_]
            part = (part[0].take(open_), *(array[open_] for array in part[1:]))
            value, slope, bend = value[open_], slope[open_], bend[open_]
        step = _newton_step(slope, bend)
        # Where nothing bends the dual, a step would run away and take the digits with it.
        limit = LONGEST * (1.0 + np.abs(x[busy]).max(-1))
        step *= np.minimum(1.0, limit / (np.abs(step).max(-1) + 1e-300))[:, None]
        x[busy], value, slope, bend, moved = _search(answer, part, x[busy], value, slope, bend, step)
        if not moved.any():
            break
    return x


def _evaluate(
    answer: Answer, sets: FinSets, softness: Array, origin: Array, basis: Array, wanted: Array, x: Array
) -> tuple[Array, Array, Array]:
    """Value (R,), gradient (R, k) and Hessian (R, k, k) of the dual."""
    normal = origin + (basis @ x[..., None])[..., 0]
    each, force, follow = answer(sets, sets.pull(normal), softness)
    value = each.sum(-1) - (wanted * normal).sum(-1)
    felt = sets.columns @ basis[:, None]  # (R, n, 2, k)
    gradient = np.einsum("rnck,rnc->rk", felt, force) - np.einsum("rik,ri->rk", basis, wanted)
    rows, n, _, k = felt.shape
    hessian = felt.reshape(rows, 2 * n, k).swapaxes(1, 2) @ (follow @ felt).reshape(rows, 2 * n, k)
    return value, gradient, hessian


def _newton_step(gradient: Array, hessian: Array) -> Array:
    """Newton's step (R, k); directions that do not bend get a long but finite one."""
    k = gradient.shape[-1]
    trace = np.trace(hessian, axis1=-2, axis2=-1)
    ridge = 1e-12 * trace + 1e-9 * np.abs(gradient).max(-1) + 1e-300
    return -np.linalg.solve(hessian + ridge[:, None, None] * np.eye(k), gradient[..., None])[..., 0]


def _search(
    answer: Answer,
    part: tuple[FinSets, Array, Array, Array, Array],
    x: Array,
    value: Array,
    slope: Array,
    bend: Array,
    step: Array,
) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    """Takes the steps, each cut in half until the value falls; rows for which it never does stay."""
    descent = (slope * step).sum(-1)
    todo = np.arange(len(x))
    length, moved = 1.0, np.zeros(len(x), dtype=bool)
    x, value, slope, bend = x.copy(), value.copy(), slope.copy(), bend.copy()
    for _ in range(MAX_HALVINGS):
        sets, *rest = part if len(todo) == len(x) else (part[0].take(todo), *(a[todo] for a in part[1:]))
        trial = x[todo] + length * step[todo]
        new = _evaluate(answer, sets, *rest, trial)
        fine = new[0] <= value[todo] + 1e-4 * length * descent[todo] + 1e-13 * np.abs(value[todo])
        rows = todo[fine]
        x[rows], value[rows], slope[rows], bend[rows] = trial[fine], *(a[fine] for a in new)
        moved[rows] = True
        todo = todo[~fine]
        if not len(todo):
            break
        length *= 0.5 if length > 0.2 else 0.1
    return x, value, slope, bend, moved
