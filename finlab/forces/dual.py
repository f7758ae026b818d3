"""The one solver of the analysis: Newton's method on the dual of a problem over the fins' forces.

Each problem asks for planar forces y_i within the fins' convex sets that add up as wanted and push far, or
cost little. Its dual has few unknowns: a direction p = origin + basis x in the space of wrenches. Given p,
each fin answers the pull B_i p alone; `finlab.forces.answers` holds the two ways to do so, both such that
the answer is unique. The dual is then smooth and convex, and a Newton step with a line search brings the sum
of the answers to what is wanted. All rows are solved at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.forces.answers import Answer
from finlab.forces.fin_sets import FinSets

Array = NDArray[np.float64]

MAX_STEPS = 30
"""Most Newton steps of one call."""
MAX_CUTS = 12
"""Most times that a step is cut."""
LONGEST = 2.0
"""Longest step, as a multiple of the unknowns' size plus one."""


class Dual(NamedTuple):
    """R problems: minimize sum_i h_i(B_i p) - wanted . p over x, where p = origin + basis x."""

    answer: Answer
    """How the fins answer; it defines h."""
    sets: FinSets
    """R robots of n fins."""
    softness: Array
    """Of the answers (R, n), positive."""
    origin: Array
    """(R, 6)."""
    basis: Array
    """(R, 6, k)."""
    wanted: Array
    """Scaled wrenches (R, 6); at the minimum the answers add up to them, as seen along the basis."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Dual:
        """Returns some of the problems."""
        return Dual(self.answer, self.sets.take(rows), *(field[rows] for field in self[2:]))

    def normal(self, x: Array) -> Array:
        """Returns p (R, 6) of unknowns (R, k)."""
        return self.origin + (self.basis @ x[..., None])[..., 0]

    def at(self, x: Array) -> Point:
        """Returns value, gradient and Hessian at unknowns (R, k)."""
        normal = self.normal(x)
        each, force, follow = self.answer(self.sets, self.sets.pull(normal), self.softness)
        value = each.sum(-1) - (self.wanted * normal).sum(-1)
        rows, n, k = len(x), force.shape[1], self.basis.shape[-1]
        felt = self.sets.columns.reshape(rows, 2 * n, 6) @ self.basis
        missing = (self.sets.wrench(force) - self.wanted)[:, None]
        bent = (follow @ felt.reshape(rows, n, 2, k)).reshape(rows, 2 * n, k)
        return Point(x, value, (missing @ self.basis)[:, 0], felt.swapaxes(1, 2) @ bent)


class Point(NamedTuple):
    """R places on the way."""

    x: Array
    """Unknowns (R, k)."""
    value: Array
    """The dual (R,)."""
    slope: Array
    """Its gradient (R, k)."""
    bend: Array
    """Its Hessian (R, k, k)."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Point:
        """Returns some of the places."""
        return Point(*(field[rows] for field in self))

    def put(self, rows: NDArray[np.intp], other: Point) -> None:
        """Moves some of the places."""
        for own, new in zip(self, other, strict=True):
            own[rows] = new


def minimize_dual(dual: Dual, start: Array, tolerance: float = 1e-9) -> Array:
    """Returns the unknowns (R, k) at the minimum.

    Args:
        dual: R problems.
        start: first unknowns (R, k).
        tolerance: share of the largest wrench by which the answers' sum may be off.
    """
    x = start.copy()
    sets = dual.sets
    size = np.sqrt((sets.columns**2).sum((-1, -2)))
    # One newton keeps the yardstick positive where all fins are lost.
    capacity = np.maximum((size * sets.radius).sum(-1), 1e-9)
    # Where nothing is wanted the value cannot fall below zero: a row that gets there is done.
    floor = np.where((dual.wanted == 0.0).all(-1), 1e-11 * capacity, -np.inf)
    busy = np.arange(len(x))
    point = dual.at(x)
    for _ in range(MAX_STEPS):
        off = np.abs(point.slope).max(-1)
        open_ = (off > tolerance * capacity[busy]) & (point.value > floor[busy])
        if not open_.any():
            break
        if not open_.all():
            busy, dual, point = busy[open_], dual.take(open_), point.take(open_)
        moved = _advance(dual, point, _newton_step(point))
        x[busy] = point.x
        if not moved:
            break
    return x


def _newton_step(point: Point) -> Array:
    """Newton's step (R, k), of bounded length: where nothing bends the dual it would run away."""
    k = point.slope.shape[-1]
    trace = np.trace(point.bend, axis1=-2, axis2=-1)
    ridge = 1e-12 * trace + 1e-9 * np.abs(point.slope).max(-1) + 1e-300
    step = -np.linalg.solve(point.bend + ridge[:, None, None] * np.eye(k), point.slope[..., None])[..., 0]
    limit = LONGEST * (1.0 + np.abs(point.x).max(-1))
    return np.asarray(step * np.minimum(1.0, limit / (np.abs(step).max(-1) + 1e-300))[:, None])


def _advance(dual: Dual, point: Point, step: Array) -> bool:
    """Moves the places by steps (R, k), each cut until the value falls; says whether any has moved."""
    descent = (point.slope * step).sum(-1)
    start, value = point.x.copy(), point.value.copy()
    todo, length, moved = np.arange(len(step)), 1.0, False
    for _ in range(MAX_CUTS):
        part = dual if len(todo) == len(step) else dual.take(todo)
        trial = part.at(start[todo] + length * step[todo])
        slack = 1e-13 * np.abs(value[todo])
        fine = trial.value <= value[todo] + 1e-4 * length * descent[todo] + slack
        point.put(todo[fine], trial.take(fine))
        moved = moved or bool(fine.any())
        todo = todo[~fine]
        if not len(todo):
            break
        length *= 0.5 if length > 0.2 else 0.1
    return moved
