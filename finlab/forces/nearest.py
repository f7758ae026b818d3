"""The nearest wrench that a robot can deliver, exactly: a convex problem in the planar forces of its fins.

Each fin gives a force y_i within a disc, or within a sector of it where its zero direction has stops. Of all
sums of such forces, the one closest to the target w,

    min 1/2 sum_j (w - sum_i B_i y_i)_j^2 / c_j,

is found by an interior-point method. An axis with a large c_j hardly counts, one with a tiny c_j must be met:
policies are choices of c. A sector wider than half a turn is not convex; its halves are tried.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.forces.force_space import PlanarProblem
from finlab.forces.interior_point import Discs, minimize

Array = NDArray[Any]

HELD = 1e-9
"""c of an axis that must be met."""
MISSED = 1e-5
"""Normalized error from which a group of axes counts as not served whole."""
SPOILED = 1e-3
"""Normalized error by which a later group may at most spoil earlier ones."""
UNFELT = 1e-6
"""Share of the largest pull that a fin could feel below which it feels none."""
MAX_WIDE = 3
"""Most fins with wide sectors whose halves are all tried; of further ones the half is kept to which they
point when nothing holds them."""


class Nearest(NamedTuple):
    """What the fins can do nearest to R targets."""

    force: Array
    """Planar forces (R, n, 2) [N]."""
    wrench: Array
    """Normalized wrench (R, 6) of these forces."""
    multiplier: Array
    """What each axis would gain (R, 6): the dual's unknowns."""


def nearest(problem: PlanarProblem, target: Array, c: Array | None = None) -> Nearest:
    """Forces whose wrench is nearest to each target.

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        c: what each axis' squared error is divided by (6,), by default one; infinite for one that is ignored.
    """
    scale = np.ones(6) if c is None else np.asarray(c, np.float64)
    counts = np.isfinite(scale)
    columns = np.where(counts, problem.columns, 0.0)
    wanted, c_ = np.where(counts, target, 0.0), np.where(counts, scale, 1.0)
    middle, half = _convex_parts(problem, columns, wanted, c_)
    n_parts, rows, _ = middle.shape
    # All parts of all targets are solved together; of each target the best part counts.
    arcs = (arc.reshape(n_parts * rows, -1) for arc in (middle, half))
    repeated, radius = np.tile(wanted, (n_parts, 1)), problem.curves.maximum[:, None]
    share, multiplier = minimize(Discs(columns * radius[..., None], *arcs), repeated, c_)
    force = share * radius
    missing = repeated - wrench_of(columns, force)
    cost = (missing * missing / c_).sum(-1).reshape(n_parts, rows)
    best = cost.argmin(0) * rows + np.arange(rows)
    return Nearest(force[best], wrench_of(problem.columns, force[best]), multiplier[best])


def nearest_in_turn(problem: PlanarProblem, target: Array, groups: list[NDArray[np.bool_]]) -> Nearest:
    """Forces that serve groups of axes in order, for one target (6,): each as far as those before allow.

    Args:
        problem: the layout.
        target: normalized wrench (6,).
        groups: masks of axes (6,), most important first, every axis in one of them.
    """
    goal, c = target.copy(), np.full(6, np.inf)
    force = np.zeros((len(problem.columns), 2))
    settled = np.zeros(len(force), dtype=bool)
    for group in groups:
        c = np.where(group, 1.0, c)
        radius = np.where(settled, 0.0, problem.curves.maximum)
        rest = problem._replace(curves=replace(problem.curves, maximum=radius))
        found = nearest(
            rest, (goal - wrench_of(problem.columns, (force * settled[:, None])[None])[0])[None], c
        )
        served = np.where(settled[:, None], force, found.force[0])
        wrench = wrench_of(problem.columns, served[None])[0]
        if np.linalg.norm((goal - wrench)[c == HELD]) > SPOILED:
            break  # at a corner of its limits a robot has nothing left to give to later groups
        force = served
        if np.linalg.norm((goal - wrench)[group]) > MISSED:
            # All who could lessen what is missing give their all: only one force of theirs does so.
            pull = problem.columns @ found.multiplier[0]
            felt = np.linalg.norm(found.multiplier[0]) * np.sqrt((problem.columns**2).sum((1, 2)))
            settled |= np.linalg.norm(pull, axis=-1) > UNFELT * felt
        goal, c = np.where(group, wrench, goal), np.where(group, HELD, c)
    return Nearest(force[None], wrench_of(problem.columns, force[None]), found.multiplier)


def nearest_along(problem: PlanarProblem, target: Array) -> Nearest:
    """Forces that give the largest share of one target (6,), up to all of it, and nothing beside it."""
    nothing = Nearest(np.zeros((1, len(problem.columns), 2)), np.zeros((1, 6)), np.zeros((1, 6)))
    size = float(np.linalg.norm(target))
    flat = problem.columns.reshape(-1, 6)
    beside = target - flat.T @ np.linalg.lstsq(flat.T, target, rcond=1e-9)[0]
    if size < 1e-12 or np.linalg.norm(beside) > SPOILED * size:
        return nothing  # fins of another direction can give nothing of it alone
    # A reflection that turns the target onto the first axis; the other five must vanish.
    mirror = target / size
    mirror = mirror + np.copysign(1.0, mirror[0]) * np.eye(6)[0]
    turn = np.eye(6) - 2.0 * np.outer(mirror, mirror) / (mirror @ mirror)
    turned = problem._replace(columns=problem.columns @ turn)
    found = nearest(turned, (turn @ target)[None], np.array([1.0, *(HELD,) * 5]))
    wrench = found.wrench @ turn
    if wrench[0] @ target <= 0.0:  # none of it at all; what is left is rounding
        return nothing
    return Nearest(found.force, wrench, found.multiplier @ turn)


def _convex_parts(problem: PlanarProblem, columns: Array, wanted: Array, c: Array) -> tuple[Array, Array]:
    """Arcs, as middle and half (P, R, n), whose sectors are convex and together are what the fins have."""
    rows = len(wanted)
    middle = np.broadcast_to(problem.middle, (rows, len(problem.middle))).copy()
    half = np.broadcast_to(np.minimum(problem.half, np.pi), middle.shape).copy()
    wide = np.flatnonzero((problem.half > np.pi / 2 + 1e-9) & (problem.half < np.pi - 1e-6))
    if len(wide) > MAX_WIDE:
        free = half.copy()
        free[:, wide] = np.pi
        force, _ = minimize(Discs(columns * problem.curves.maximum[:, None, None], middle, free), wanted, c)
        angle = np.arctan2(force[..., 1], force[..., 0]) - middle
        for i in wide[MAX_WIDE:]:
            half[:, i] *= 0.5
            middle[:, i] += np.where(np.sin(angle[:, i]) >= 0.0, 1.0, -1.0) * half[:, i]
        wide = wide[:MAX_WIDE]
    signs = np.array(list(product((-0.5, 0.5), repeat=len(wide))))
    middle, half = (np.repeat(arc[None], len(signs), axis=0) for arc in (middle, half))
    middle[..., wide] += signs[:, None] * half[..., wide]
    half[..., wide] *= 0.5
    return middle, half


def wrench_of(columns: Array, force: Array) -> Array:
    """Normalized wrench (R, 6) of planar forces (R, n, 2)."""
    n = force.shape[1]
    wrench: Array = force.reshape(-1, 2 * n) @ columns.reshape(2 * n, 6)
    return wrench
