"""The search for the cheapest exact allocation, in the space of planar fin forces.

Each fin gives a force y_i in its thrust plane (horizontal and vertical component), so the wrench is
linear: w = sum_i B_i y_i. The least energy for a thrust T, e_i(T), is known from the thrust curve and
grows like the square root of T: it is concave in the force, so the cheapest allocation tends to let
some fins rest, and it has many local minima. Each seed is driven to the one next to it by iterated
reweighting: e_i is replaced by the quadratic |y|^2 / (2 m_i) that touches it, with mobility
m_i = T / e_i'(T), and the resulting convex problem

    min sum_i |y_i|^2 / (2 m_i)   s.t.   sum_i B_i y_i = w,   T_min <= |y_i| <= T_max, direction in its arc

is solved through its dual: given the multiplier l in R^6, fin i answers with the projection of
m_i B_i^T l on what it can do, and a semismooth Newton step on l removes the wrench error.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.forces.fin_sets import FinSets, half_arcs
from finlab.forces.small_systems import solve
from finlab.forces.thrust_curve import ThrustCurves
from finlab.layout import Layout
from finlab.layout.arrays import force_columns
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights, energy_scale

Array = NDArray[Any]

RIDGE = 1e-9
"""Relative regularization of the 6 x 6 systems."""
LEAST = 1e-12
"""Absolute regularization of them, and of sizes that are divided by."""
REST = 1e-5
"""Share of the largest thrust below which a fin's mobility no longer shrinks; it can still come back."""


class FreeTerms(NamedTuple):
    """What stays from step to step where fins may point anywhere; forces are shares of the largest."""

    gram: Array
    """B_i B_i^T T_max^2 (n, 36) of each fin, regularized."""
    columns: Array
    """Normalized wrench (2n, 6) of each fin's largest force, all horizontal ones first."""


def free_terms(columns: Array, maximum: Array) -> FreeTerms:
    """The terms of normalized columns (n, 2, 6) and largest thrusts (n,)."""
    full = columns * maximum[:, None, None]
    gram = np.einsum("nci,ncj->nij", full, full)
    gram += RIDGE * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    return FreeTerms(gram.reshape(-1, 36), full.swapaxes(0, 1).reshape(-1, 6))


class PlanarProblem(NamedTuple):
    """One layout as the planar search sees it."""

    columns: Array
    """Normalized wrench per newton (n, 2, 6) of each fin's horizontal and vertical force."""
    products: Array
    """Outer products (n, 2, 2, 6, 6) of those columns."""
    curves: ThrustCurves
    """What thrust each fin can give, and at what energy."""
    middle: Array
    """Middle of the arc of zero directions (n,) [rad]."""
    half: Array
    """Half of the arc (n,) [rad]; pi and more for a full circle."""
    direction_cost: Array
    """Energy per squared zero direction (n,) [1/rad^2]."""
    idle_direction: Array
    """Zero direction (n,) [rad] of a fin at rest: the cheapest one."""
    turns_fully: bool
    """Whether every fin may point anywhere."""
    free: FreeTerms
    """What is computed ahead for fins that may point anywhere."""
    growth: float = 0.5
    """Exponent with which a fin's energy grows with its thrust: below 1 some fins rest, above 1 all work."""

    @property
    def sets(self) -> FinSets:
        """What the fins can push, as one robot of a batch."""
        return FinSets(self.columns[None], self.curves.maximum[None], self.middle[None], self.half[None])

    def like(self, columns: Array, middle: Array, half: Array) -> PlanarProblem:
        """The same fins elsewhere on the robot, or in parts of their arcs."""
        return self._replace(
            columns=columns,
            products=_products(columns),
            middle=middle,
            half=half,
            turns_fully=bool((half >= np.pi).all()),
            free=free_terms(columns, self.curves.maximum),
        )


class Planar(NamedTuple):
    """Planar forces of R rows."""

    thrust: Array
    """(R, n) [N]."""
    direction: Array
    """Zero direction (R, n) [rad], inside its arc."""
    residual: Array
    """Target minus wrench, normalized (R, 6)."""


def planar_problem(
    layout: Layout, curves: ThrustCurves, scale: Array, weights: EnergyWeights = DEFAULT_WEIGHTS
) -> PlanarProblem:
    """One layout as the planar search sees it.

    Args:
        layout: n fins, all of them healthy.
        curves: what their thrusts cost by the same weights.
        scale: what a wrench is divided by (6,).
        weights: of the energy.
    """
    lower, upper = layout.lower[:, 2], layout.upper[:, 2]
    half = half_arcs(lower, upper)
    columns = np.ascontiguousarray(force_columns(layout.position, layout.mounting_angle)[:, 1:] / scale)
    return PlanarProblem(
        columns=columns,
        products=_products(columns),
        curves=curves,
        middle=0.5 * (lower + upper),
        half=half,
        direction_cost=weights.zero_direction / energy_scale(layout.upper)[:, 2] ** 2,
        idle_direction=np.clip(0.0, lower, upper),
        turns_fully=bool((half >= np.pi).all()),
        free=free_terms(columns, curves.maximum),
        growth=1.5 if weights.inertial else 0.5,
    )


def _products(columns: Array) -> Array:
    return np.asarray(np.einsum("nci,ndj->ncdij", columns, columns))


def mobility(problem: PlanarProblem, thrust: Array) -> Array:
    """m = T / e'(T) up to a constant, for thrusts (R, n): e grows like (T / T_max)^growth."""
    top = problem.curves.maximum
    kept = np.maximum(thrust, REST * top)
    if problem.growth == 0.5:  # the usual weights, and quicker than a power
        root = kept * top
        kept *= np.sqrt(root, out=root)
        return kept
    return kept * kept * (top / kept) ** problem.growth


def descend(problem: PlanarProblem, target: Array, thrust: Array, steps: int) -> Planar:
    """Follow each seed to a cheap, exact allocation.

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        thrust: seeds (R, n) [N]; only the sizes matter, directions follow from the target.
        steps: reweighting steps; where some fins cannot turn fully, two more remove what error is left.
    """
    if problem.turns_fully:
        return _descend_freely(problem, target, thrust, steps)
    return _newton(problem, target, mobility(problem, thrust), steps, 2)


def polar(problem: PlanarProblem, force: Array) -> Planar:
    """Planar forces (R, n, 2) [N] as thrusts and zero directions within the arcs; without a residual."""
    angle = np.arctan2(force[..., 1], force[..., 0]) - problem.middle
    offset = np.clip(angle - 2 * np.pi * np.rint(angle / (2 * np.pi)), -problem.half, problem.half)
    thrust = np.clip(np.linalg.norm(force, axis=-1), problem.curves.minimum, problem.curves.maximum)
    return Planar(thrust, problem.middle + offset, np.full((len(force), 6), np.nan))


def _newton(problem: PlanarProblem, target: Array, weight: Array, reweighted: int, plain: int) -> Planar:
    """Semismooth Newton steps on the multiplier, the first of them followed by a new weight."""
    multiplier = solve(_gram(problem, weight), target[..., None])[..., 0]
    for step in range(reweighted + plain):
        wanted = _answer(problem, weight, multiplier)
        planar, slope = _project(problem, wanted, target)
        gram = _gram(problem, weight, slope)
        multiplier = multiplier + solve(gram, planar.residual[..., None])[..., 0]
        if step < reweighted:
            free = _answer(problem, weight, multiplier)
            size = np.sqrt(np.einsum("rnc,rnc->rn", free, free))
            weight = mobility(problem, np.minimum(size, problem.curves.maximum))
    return _project(problem, _answer(problem, weight, multiplier), target)[0]


def _descend_freely(problem: PlanarProblem, target: Array, thrust: Array, steps: int) -> Planar:
    """`descend` where every fin may point anywhere: directions are free and thrust limits are met by weights.

    A fin asked for more than it has gets its mobility cut in proportion, again and again until it
    holds: the fixed point is the multiplier of its limit.
    """
    top, columns = problem.curves.maximum, problem.free.columns
    n, rows = len(top), len(thrust)
    weight = _share_mobility(thrust / top, problem.growth)
    cut = np.ones_like(weight)
    right = target[..., None]
    for step in range(steps + 1):
        weight *= cut
        gram = weight.dot(problem.free.gram)
        gram[:, ::7] += LEAST
        multiplier = solve(gram.reshape(rows, 6, 6), right).reshape(rows, 6)
        wanted = multiplier.dot(columns.T).reshape(rows, 2, n)
        wanted *= weight[:, None]
        squared = wanted * wanted
        size = squared[:, 0] + squared[:, 1]
        np.sqrt(size, out=size)
        if step < steps:
            cut /= size + LEAST
            np.minimum(cut, 1.0, out=cut)
            weight = _share_mobility(np.minimum(size, 1.0), problem.growth)
    direction = np.arctan2(wanted[:, 1], wanted[:, 0])
    held = np.minimum(np.maximum(size * top, problem.curves.minimum), top)
    size += LEAST
    size *= top
    wanted *= (held / size)[:, None]
    reached = wanted.reshape(rows, 2 * n).dot(columns)
    return Planar(held, direction, target - reached)


def _share_mobility(share: Array, growth: float) -> Array:
    """`mobility` over the squared largest thrust, for thrusts (R, n) as shares of the largest; in place."""
    kept = np.maximum(share, REST, out=share)
    if growth == 0.5:  # the usual weights, and quicker than a power
        kept *= np.sqrt(kept)
        return kept
    return kept ** (2.0 - growth)


def realize(problem: PlanarProblem, planar: Planar) -> tuple[Array, Array]:
    """Commands (R, n, 3) that give planar forces at the least energy, and that energy (R,)."""
    looked_up = problem.curves.lookup(planar.thrust)
    # A fin at rest points where that costs least.
    resting = planar.thrust <= problem.curves.minimum * (1.0 + 1e-6)
    direction = np.where(resting, problem.idle_direction, planar.direction)
    energy = np.add.reduce(looked_up[..., 2] + problem.direction_cost * direction * direction, axis=-1)
    looked_up[..., 2] = direction
    return looked_up, energy


def _answer(problem: PlanarProblem, weight: Array, multiplier: Array) -> Array:
    """Each fin's unconstrained answer m_i B_i^T l: (R, n, 2)."""
    n = problem.columns.shape[0]
    pull = multiplier @ problem.columns.reshape(2 * n, 6).T
    return pull.reshape(len(multiplier), n, 2) * weight[..., None]


def _gram(problem: PlanarProblem, weight: Array, slope: Array | None = None) -> Array:
    """sum_i m_i B_i D_i B_i^T (R, 6, 6), slightly regularized; D_i (R, n, 2, 2) is the projection's slope."""
    n = len(problem.products)
    if slope is None:
        gram = weight @ (problem.products[:, 0, 0] + problem.products[:, 1, 1]).reshape(n, 36)
    else:
        weighted = (weight[..., None, None] * slope).reshape(len(weight), n * 4)
        gram = weighted @ problem.products.reshape(n * 4, 36)
    # Every seventh entry of the flattened matrix is on the diagonal.
    diagonal = gram[:, ::7]
    diagonal += RIDGE * diagonal.sum(1, keepdims=True) + LEAST
    regularized: Array = gram.reshape(-1, 6, 6)
    return regularized


def _project(problem: PlanarProblem, wanted: Array, target: Array) -> tuple[Planar, Array]:
    """What the fins can do nearest to `wanted` (R, n, 2), and the slope (R, n, 2, 2) of that projection."""
    low, high = problem.curves.minimum, problem.curves.maximum
    x, y = wanted[..., 0], wanted[..., 1]
    size = np.sqrt(x * x + y * y)
    size += LEAST
    unit = wanted / size[..., None]
    direction = np.arctan2(y, x)
    along = size
    outside = np.zeros(size.shape, dtype=bool)
    if not problem.turns_fully:
        offset = np.mod(direction - problem.middle + np.pi, 2 * np.pi)
        offset -= np.pi
        inside = np.minimum(np.maximum(offset, -problem.half), problem.half)
        outside = inside != offset
        direction = np.where(outside | (problem.half < np.pi - 1e-6), problem.middle + inside, direction)
        if outside.any():
            excess = np.abs(offset - inside)
            along = size * np.where(excess < np.pi / 2, np.cos(excess), 0.0)
            np.cos(direction, out=unit[..., 0], where=outside)
            np.sin(direction, out=unit[..., 1], where=outside)
    thrust = np.minimum(np.maximum(along, low), high)
    force = unit * thrust[..., None]
    n = wanted.shape[1]
    reached = force.reshape(len(force), 2 * n).dot(problem.columns.reshape(2 * n, 6))
    # Inside its limits a fin follows freely; at a thrust limit it only turns; at an end of its arc it
    # only pushes harder; at both it is stuck.
    turn = np.where(outside, 0.0, thrust / size)
    push = (along == thrust) - turn
    slope = unit[..., :, None] * unit[..., None, :]
    slope *= push[..., None, None]
    slope[..., 0, 0] += turn
    slope[..., 1, 1] += turn
    return Planar(thrust, direction, target - reached), slope
