"""The nearest wrench that a robot can deliver, exactly: a convex problem in the planar forces of its fins.

Each fin gives a force y_i within a disc, or within a sector of it where its zero direction has stops. Of all
sums of such forces, the one closest to the target w,

    min 1/2 sum_j (w - sum_i B_i y_i)_j^2 / c_j,

is found through its dual, which has six unknowns l and no constraints,

    min sum_i h_i(B_i^T l) + 1/2 sum_j c_j l_j^2 - w . l,

h_i being how far fin i can push along a pull. Where h_i has a kink it is rounded, less and less. An axis with
a large c_j hardly counts, one with a tiny c_j must be met: policies are choices of c (see `aims`).
A sector wider than half a turn is not convex; its halves are tried.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.force_space import PlanarProblem
from finlab.allocation.policy import largest_share

Array = NDArray[Any]

HELD = 1e-8
"""c of an axis that must be met."""
MISSED = 1e-5
"""Normalized error from which a group of axes counts as not served whole."""
SPOILED = 1e-3
"""Normalized error by which a later group may at most spoil earlier ones."""
UNFELT = 1e-6
"""Share of the largest pull that a fin could feel below which it feels none."""
STAGES = (
    *((3.0, 1.0), (0.3, 0.1), (0.03, 1e-2), (3e-3, 1e-3)),
    *((1e-4, 1e-4), (1e-5, 1e-5), (1e-6, 1e-6), (1e-6, HELD)),
)
"""Roundings of the kinks, as shares of the target's size (at least one), and the least c, one after the
other: the last problem is hard to solve from afar."""
STEPS = 15
"""Most Newton steps for each rounding."""
CUTS = 16
"""Most times that a step is cut; where a pull passes between two stops, only a tiny part of it is good."""
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


class _Sets(NamedTuple):
    """What R rows of fins can push."""

    columns: Array
    """(R, n, 2, 6) or (1, n, 2, 6)."""
    radius: Array
    """(n,)."""
    middle: Array
    """(R, n)."""
    half: Array
    """(R, n), pi for a full circle, else at most half of that."""


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
    sets = _Sets(
        columns, problem.curves.maximum, *(arc.reshape(n_parts * rows, -1) for arc in (middle, half))
    )
    repeated = np.tile(wanted, (n_parts, 1))
    force, multiplier = _minimize(sets, repeated, c_)
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
    size = float(np.linalg.norm(target))
    flat = problem.columns.reshape(-1, 6)
    beside = target - flat.T @ np.linalg.lstsq(flat.T, target, rcond=1e-9)[0]
    if size < 1e-12 or np.linalg.norm(beside) > SPOILED * size:
        return nearest(problem, np.zeros((1, 6)))  # fins of another direction can give nothing of it alone
    # A reflection that turns the target onto the first axis; the other five must vanish.
    mirror = target / size
    mirror = mirror + np.copysign(1.0, mirror[0]) * np.eye(6)[0]
    turn = np.eye(6) - 2.0 * np.outer(mirror, mirror) / (mirror @ mirror)
    turned = problem._replace(columns=problem.columns @ turn)
    found = nearest(turned, (turn @ target)[None], np.array([1.0, *(HELD,) * 5]))
    wrench = found.wrench @ turn
    if np.linalg.norm(wrench[0] - target * (wrench[0] @ target) / size**2) > SPOILED:
        # Very rarely Newton's steps end early; then the share is found by trying.
        def reached(shares: Array) -> NDArray[np.bool_]:
            wanted = shares[:, None] * target
            near: NDArray[np.bool_] = (
                np.linalg.norm(nearest(problem, wanted).wrench - wanted, axis=1) < SPOILED
            )
            return near

        return nearest(problem, largest_share(reached) * target[None])
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
        force, _ = _minimize(_Sets(columns, problem.curves.maximum, middle, free), wanted, c)
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


def _minimize(sets: _Sets, wanted: Array, of: Array) -> tuple[Array, Array]:
    """The forces (R, n, 2) that answer the dual's minimum, and the multiplier (R, 6) there."""
    rows = len(wanted)
    multiplier = np.zeros((rows, 6))
    size = np.maximum(np.linalg.norm(wanted, axis=-1), 1.0)
    capacity = 1.0 + float((np.sqrt((sets.columns**2).sum((-1, -2))) * sets.radius).sum())
    for rounding, least in STAGES:
        c = np.maximum(of, least)
        soft = (rounding * size)[:, None]
        for _ in range(STEPS):
            value, slope, bend = _dual(sets, wanted, c, multiplier, soft)
            off = np.abs(slope).max(-1)
            if (off < (1e-8 if (rounding, least) == STAGES[-1] else 1e-2) * capacity).all():
                break
            bend.reshape(rows, 36)[:, ::7] += 1e-13 * np.trace(bend, axis1=1, axis2=2)[:, None] + 1e-300
            step = -np.linalg.solve(bend, slope[..., None])[..., 0]
            descent = (step * slope).sum(-1)
            length = np.ones(rows)
            for _ in range(CUTS):
                trial = _value(sets, wanted, c, multiplier + length[:, None] * step, soft)
                long = trial > value + 1e-4 * length * descent + 1e-13 * np.abs(value)
                if not long.any():
                    break
                length = np.where(long, 0.3 * length, length)
            multiplier = multiplier + length[:, None] * step
    pull, _ = _seen(sets, multiplier)
    force: Array = (sets.radius / np.sqrt((pull * pull).sum(-1) + soft * soft))[..., None] * pull
    return force, multiplier


def _value(sets: _Sets, wanted: Array, c: Array, multiplier: Array, soft: Array) -> Array:
    pull, _ = _seen(sets, multiplier)
    pushed = (sets.radius * np.sqrt((pull * pull).sum(-1) + soft * soft)).sum(-1)
    value: Array = pushed + ((0.5 * c * multiplier - wanted) * multiplier).sum(-1)
    return value


def _dual(sets: _Sets, wanted: Array, c: Array, multiplier: Array, soft: Array) -> tuple[Array, Array, Array]:
    """The rounded dual (R,), its gradient (R, 6) and its Hessian (R, 6, 6)."""
    rows, n = len(wanted), len(sets.radius)
    pull, slope = _seen(sets, multiplier)
    length = np.sqrt((pull * pull).sum(-1) + soft * soft)
    share = sets.radius / length
    value = (sets.radius * length).sum(-1) + ((0.5 * c * multiplier - wanted) * multiplier).sum(-1)
    force = share[..., None] * pull
    gradient = wrench_of(sets.columns, force) + c * multiplier - wanted
    unit = pull / length[..., None]
    bent = share[..., None, None] * (slope - unit[..., :, None] * unit[..., None, :])
    flat = sets.columns.reshape(2 * n, 6)
    hessian = flat.T @ (bent @ sets.columns).reshape(rows, 2 * n, 6) + np.diag(c)
    return value, gradient, hessian


def _seen(sets: _Sets, multiplier: Array) -> tuple[Array, Array]:
    """What each fin feels of a multiplier within its stops (R, n, 2), and the slope (R, n, 2, 2) of that."""
    n = len(sets.radius)
    pull = (multiplier @ sets.columns.reshape(2 * n, 6).T).reshape(-1, n, 2)
    slope = np.broadcast_to(np.eye(2), (*pull.shape, 2))
    if (sets.half >= np.pi - 1e-6).all():
        return pull, slope
    offset = np.arctan2(pull[..., 1], pull[..., 0]) - sets.middle
    offset -= 2 * np.pi * np.rint(offset / (2 * np.pi))
    outside = (np.abs(offset) > sets.half) & (sets.half < np.pi - 1e-6)
    stop = sets.middle + np.copysign(sets.half, offset)
    edge = np.stack([np.cos(stop), np.sin(stop)], axis=-1)
    along = np.maximum((pull * edge).sum(-1), 0.0)
    on_edge = np.where((along > 0.0)[..., None, None], edge[..., :, None] * edge[..., None, :], 0.0)
    return (
        np.where(outside[..., None], along[..., None] * edge, pull),
        np.where(outside[..., None, None], on_edge, slope),
    )
