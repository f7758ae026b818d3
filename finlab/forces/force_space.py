"""The search for the cheapest exact allocation, in the space of planar fin forces.

Each fin gives a force y_i in its thrust plane (horizontal and vertical component), so the wrench is linear:
w = sum_i B_i y_i. What a force costs, c_i(y), is known from the compiled fins. Where cost grows faster than
force, as power does, there is one cheapest allocation; where it grows more slowly, as the paper's effort
does, the cheapest allocation rests some fins and there are many local minima, each found from its own seeds.

Either way a seed is driven downhill by solving, again and again, the quadratic problem that stands for the
costs near the present forces,

    min sum_i g_i (y - y_i) + 1/2 (y - y_i) H_i (y - y_i)   s.t.   sum_i B_i y = w,

through its six multipliers l: y = a_i + M_i B_i^T l with M = H^-1 and a = y_i - M g. Along the force H is the
cost's own curvature where it is convex, else that of the quadratic about the origin that touches it; across
the force it is (dc/dT) / T. A fin that is asked for more than it can has all its mobility cut in proportion,
again and again until it holds; one at a stop of its arc can no longer turn. Last, a few semismooth Newton
steps on l remove what error is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.forces.envelopes import LEAST, Envelopes, Projected
from finlab.forces.fin_envelope import (
    AMPLITUDE,
    COST,
    DEFLECTION,
    DRIFT,
    FREQUENCY,
    MOBILITY,
    SHAFT,
    STIFFNESS,
)
from finlab.layout import Layout
from finlab.layout.angles import TURN, wrapped
from finlab.layout.arrays import own_effectiveness
from finlab.physics.objective import Objective
from finlab.small_systems import solve

RIDGE = 1e-9
"""Relative regularization of the 6 x 6 systems."""
REST = 1e-5
"""Share of the largest force below which a fin's mobility no longer shrinks; it can still come back."""
IDLE = 2e-3
"""Share of its largest force up to which a fin hardly works."""
LAST_STEPS = 2
"""Semismooth Newton steps at the end."""
HALF_STEPS = 5
"""Steps after which forces go only half the way: those that are not settled by then jump to and fro."""
SETTLED = (2e-3, 1e-5)
"""Change of every force, as a share of the row's largest, from which on another step would change the cost
in its fifth digit: of a cost that grows faster than force, and of one that grows like its root."""


class PlanarProblem(NamedTuple):
    """One layout as the planar search sees it."""

    effectiveness: Array
    """Normalized wrench per newton (2n, 6): all horizontal forces, then all vertical ones."""
    along_shaft: Array
    """Normalized wrench per newton (n, 6) of forces along the shafts."""
    products: Array
    """Outer products (3n, 36) of each fin's columns, slightly regularized: horizontal, both orders of mixed,
    vertical."""
    fins: Envelopes
    """What the fins can do, and at what cost."""
    direction_cost: Array
    """Cost per squared zero direction (n,) [1/rad^2]; no fin has any where `turning_is_free`."""
    turning_is_free: bool
    """Whether zero directions cost nothing."""
    idle_direction: Array
    """Zero direction (n,) [rad] to which a fin at rest turns: the cheapest one; NaN where it turns to where
    it would be pulled."""
    convex: bool
    """Whether cost grows faster than force."""


class Planar(NamedTuple):
    """Planar forces of R rows."""

    size: Array
    """(R, n) [N]."""
    direction: Array
    """Of the force (R, n) [rad], inside its arc."""
    row: Array
    """What the compiled fins say of it (R, n, 8)."""
    residual: Array
    """Target minus wrench, normalized (R, 6)."""
    multiplier: Array
    """What each axis of the target costs (R, 6), per unit of normalized wrench."""

    @property
    def command(self) -> Array:
        """The commands (R, n, 3) that give the forces at the least cost."""
        return np.stack(
            [self.row[..., AMPLITUDE], self.row[..., FREQUENCY], self.direction - self.row[..., DEFLECTION]],
            axis=-1,
        )


def planar_problem(layout: Layout, fins: Envelopes, scale: Array, objective: Objective) -> PlanarProblem:
    """One layout as the planar search sees it.

    Args:
        layout: n fins, all of them healthy.
        fins: these, compiled for the objective.
        scale: what a wrench is divided by (6,).
        objective: what is kept least.
    """
    effectiveness = own_effectiveness(layout) / scale
    direction_cost = objective.direction_cost(layout.upper)
    planar, products = flat_effectiveness(effectiveness[:, 1:])
    return PlanarProblem(
        effectiveness=planar,
        along_shaft=np.ascontiguousarray(effectiveness[:, 0]),
        products=products,
        fins=fins,
        direction_cost=direction_cost,
        turning_is_free=not direction_cost.any(),
        idle_direction=np.clip(0.0, layout.lower[:, 2], layout.upper[:, 2]),
        convex=objective.convex,
    )


def flat_effectiveness(effectiveness: Array) -> tuple[Array, Array]:
    """`effectiveness` and `products` of a problem from normalized columns (n, 2, 6)."""
    x, y = effectiveness[:, 0], effectiveness[:, 1]
    outer = [np.einsum("ni,nj->nij", a, b) for a, b in ((x, x), (x, y), (y, x), (y, y))]
    products = np.concatenate([outer[0], outer[1] + outer[2], outer[3]])
    # The ridge of a sum is the sum of the ridges.
    products += RIDGE * np.trace(products, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    return np.concatenate([x, y]), np.ascontiguousarray(products.reshape(-1, 36))


class _Response(NamedTuple):
    """How forces near those of now answer the multipliers: y = shift + M B^T l.

    A fin at a stop does not turn, whatever is pulled. Whether it leaves the stop is seen from how it would
    answer if there were none: `free_mobility` and `free_shift`.
    """

    along: Array
    """Mobility along the force (R, n) [N^2 per unit of cost]."""
    across: Array
    """Mobility across it (R, n); zero at a stop."""
    mobility: Array
    """M (R, 3, n): horizontal, mixed, vertical."""
    shift: Array
    """a (R, 2, n) [N]."""
    free_mobility: Array
    """M (R, 3, n) as if fins had no stops."""
    free_shift: Array
    """a (R, 2, n) [N] as if fins had no stops."""
    shaft: Array | None
    """Forces along the shafts (R, n) [N], None where no fin has any."""


def descend(
    problem: PlanarProblem, target: Array, seeds: Array, steps: int, works: Array | None = None
) -> Planar:
    """Follow each seed to a cheap, exact allocation.

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6), or one for all rows (1, 6).
        seeds: sizes of forces (R, n) [N], whose directions follow from the target; or planar forces
            (R, 2, n) [N], horizontal and vertical, to go on from.
        steps: most quadratic problems that are solved in turn, one or more; fewer where forces settle.
        works: 0 where a fin has to rest (R, n), else 1; by default every fin may work.
    """
    fins, rows, n = problem.fins, len(seeds), seeds.shape[-1]
    cut = None if works is None else works.copy()
    if seeds.ndim == 3:
        response = _quadratic(problem, fins.project(seeds, _size(seeds)), cut)
    else:
        start, nothing = np.maximum(seeds, REST * fins.maximum), np.zeros((rows, 2, n))
        mobility = np.zeros((rows, 3, n))
        mobility[:, 0] = mobility[:, 2] = start
        response = _Response(start, start, mobility, nothing, mobility, nothing, None)
    if works is not None:
        response.mobility[:] *= works[:, None]
    settled, before = SETTLED[not problem.convex], None
    for step in range(steps):
        multiplier = _multiplier(problem, target, response)
        force, size = _answer(problem, response, multiplier)
        if before is not None and step > 1:  # no seed leads to the end at once
            change = np.abs(force - before)
            if rows == 1:  # the same, without axes, in a third of the time
                done = change.max() <= settled * size.max()
            else:
                done = (change.max((1, 2)) <= settled * size.max(1)).all()
            if done:
                break
            if step >= HALF_STEPS:
                force = 0.5 * (force + before)
                size = _size(force)
        before = force
        found = fins.project(force, size)
        over = found.wanted > found.boundary.largest
        if cut is not None or over.any():
            share = found.boundary.largest / np.maximum(found.wanted, LEAST)
            cut = np.minimum(share if cut is None else cut * share, 1.0 if works is None else works)
        response = _quadratic(problem, found, cut)
    else:
        multiplier = _multiplier(problem, target, response)
        force, size = _answer(problem, response, multiplier)
    found = fins.project(force, size)
    rests = not problem.turning_is_free and (found.size <= found.boundary.smallest).any()
    if rests or found.stopped is not None or cut is not None:
        found, multiplier = _mended(problem, target, response, found, multiplier)
    row = fins.lookup(found.boundary, found.size)
    shaft = row[..., SHAFT] if fins.pushes_sideways else None
    residual = target - _wrench(problem, found.unit * found.size[:, None], shaft)
    return Planar(found.size, _direction(found), row, residual, multiplier)


def _mended(
    problem: PlanarProblem, target: Array, response: _Response, found: Projected, multiplier: Array
) -> tuple[Projected, Array]:
    """Forces after semismooth Newton steps on the multipliers (R, 6), each taken only where less is missing
    then: where fins are held, a wrench may be out of reach by what they cannot go below."""

    def missing_of(found: Projected) -> tuple[Array, Array]:
        missing = target - _wrench(problem, found.unit * found.size[:, None], response.shaft)
        return missing, np.einsum("ri,ri->r", missing, missing)

    missing, squared = missing_of(found)
    for _ in range(LAST_STEPS):
        gram = _gram(problem, _held(problem, found, response, multiplier))
        there = multiplier + _solved(gram, missing)
        tried = problem.fins.project(*_answer(problem, response, there))
        after = missing_of(tried)
        better = after[1] < squared
        if not better.any():
            break
        if not better.all():
            there = np.where(better[:, None], there, multiplier)
            tried = problem.fins.project(*_answer(problem, response, there))
            after = missing_of(tried)
        found, multiplier, (missing, squared) = tried, there, after
    return found, multiplier


def polar(problem: PlanarProblem, force: Array) -> Planar:
    """Planar forces (R, n, 2) [N] as sizes and directions within the arcs, the rest unknown."""
    turned = force.swapaxes(1, 2)
    found = problem.fins.project(turned, _size(turned))
    row = problem.fins.lookup(found.boundary, found.size)
    unknown = np.full((len(force), 6), np.nan)
    return Planar(found.size, _direction(found), row, unknown, unknown)


def realize(problem: PlanarProblem, planar: Planar, rests: float | None = None) -> tuple[Array, Array]:
    """Commands (R, n, 3) that give planar forces at the least cost, and that cost (R,).

    Args:
        problem: the layout.
        planar: the forces.
        rests: share of its largest force up to which a fin rests altogether and turns to where that costs
            least; with 0, only those that do their least turn. Refinement has to correct the little force
            that is then missing, or turned. None leaves all as they are.
    """
    fins = problem.fins
    least = fins.minimum * (1.0 + REST)
    idle = planar.size <= least + (rests or 0.0) * fins.maximum
    if rests:
        rest = fins.lookup(fins.boundary(planar.direction), np.where(idle, 0.0, planar.size))
        planar = planar._replace(row=np.where(idle[..., None], rest, planar.row))
    command, cost = planar.command, planar.row[..., COST].sum(-1)
    direction = command[..., 2]
    if rests is not None or problem.turning_is_free:
        np.copyto(direction, problem.idle_direction, where=idle & np.isfinite(problem.idle_direction))
    if not problem.turning_is_free:
        turn = np.where(fins.half >= np.pi, wrapped(direction), direction)
        cost = cost + (problem.direction_cost * turn * turn).sum(-1)
    return command, cost


def _direction(found: Projected) -> Array:
    """Directions (R, n) [rad], also where angles have not been asked for yet."""
    if found.stopped is None and found.boundary.part is None:
        return np.asarray(np.arctan2(found.unit[:, 1], found.unit[:, 0]))
    return found.direction


def _quadratic(problem: PlanarProblem, found: Projected, cut: Array | None) -> _Response:
    """The response of the quadratics that stand for the costs near the present forces, all of it `cut`."""
    row = problem.fins.lookup(found.boundary, found.size)
    across = np.exp(row[..., MOBILITY])
    softness = 1.0 / row[..., STIFFNESS]
    kept = found.size * (1.0 - softness)
    drift = None if found.boundary.part is None else row[..., DRIFT]
    if cut is not None:
        across *= cut
        kept *= cut
        drift = None if drift is None else drift * cut
    along = across * softness
    x, y = found.unit[:, 0], found.unit[:, 1]
    shift = found.unit * kept[:, None]
    if not problem.turning_is_free:
        turn = _direction(found) - row[..., DEFLECTION]
        turn -= TURN * np.rint(turn / TURN)
        size = np.maximum(found.size, LEAST)
        pull = 2.0 * problem.direction_cost * across / size
        drift = pull * turn if drift is None else drift + pull * turn
        # The weaker the force, the less of it turns the fin to where that costs nothing.
        held = 1.0 / (1.0 + pull / size)
        across = across * held
        drift = drift * held
    free_shift = shift
    if drift is not None:
        free_shift = shift + np.stack([y * drift, -x * drift], axis=1)
    free = mobility = _mobility(x, y, along, across)
    if found.stopped is None:
        shift = free_shift
    else:
        across = np.where(found.stopped, 0.0, across)
        mobility = _mobility(x, y, along, across)
        shift = np.where(found.stopped[:, None], shift, free_shift)
    shaft = row[..., SHAFT] if problem.fins.pushes_sideways else None
    return _Response(along, across, mobility, shift, free, free_shift, shaft)


def _mobility(x: Array, y: Array, along: Array, across: Array) -> Array:
    """M (R, 3, n) of mobilities along and across unit vectors (x, y)."""
    more = along - across
    mobility = np.empty((len(x), 3, x.shape[1]))
    mobility[:, 0] = across + more * x * x
    mobility[:, 1] = more * x * y
    mobility[:, 2] = across + more * y * y
    return mobility


def _held(problem: PlanarProblem, found: Projected, response: _Response, multiplier: Array) -> Array:
    """The slope (R, 3, n) of what the fins do by what is pulled: inside its limits a fin follows freely, at
    its largest or smallest force it only turns, at a stop it only pushes harder, at both it is stuck."""
    _, size = _answer(problem, response, multiplier)
    turns = found.size / size
    follows = (found.size < found.boundary.largest) & (found.size > found.boundary.smallest)
    if found.stopped is not None:
        turns = np.where(found.stopped, 0.0, turns)
    along, across = response.along * follows, response.across * turns
    return _mobility(found.unit[:, 0], found.unit[:, 1], along, across)


def _answer(problem: PlanarProblem, response: _Response, multiplier: Array) -> tuple[Array, Array]:
    """Forces (R, 2, n) that answer multipliers (R, 6), whatever the limits, and their sizes (R, n)."""
    rows, _, n = response.shift.shape
    pull = (multiplier @ problem.effectiveness.T).reshape(rows, 2, n)
    force = response.free_mobility[:, :2] * pull[:, :1]
    force += response.free_mobility[:, 1:] * pull[:, 1:]
    force += response.free_shift
    return force, _size(force)


def _size(force: Array) -> Array:
    """Sizes (R, n) [N] of forces (R, 2, n), none of them zero."""
    squared = force * force
    size: Array = np.sqrt(squared[:, 0] + squared[:, 1])
    size += LEAST
    return size


def _wrench(problem: PlanarProblem, force: Array, shaft: Array | None) -> Array:
    """Normalized wrenches (R, 6) of planar forces (R, 2, n) and of those along the shafts (R, n)."""
    wrench: Array = force.reshape(len(force), -1) @ problem.effectiveness
    return wrench if shaft is None else wrench + shaft @ problem.along_shaft


def _multiplier(problem: PlanarProblem, target: Array, response: _Response) -> Array:
    """Multipliers (R, 6) by which the responses give the target."""
    missing = target - _wrench(problem, response.shift, response.shaft)
    return _solved(_gram(problem, response.mobility), missing)


def _gram(problem: PlanarProblem, mobility: Array) -> Array:
    """sum_i B_i M_i B_i^T (R, 36), slightly regularized."""
    gram: Array = mobility.reshape(len(mobility), -1) @ problem.products
    gram[:, ::7] += LEAST  # the diagonal
    return gram


def _solved(gram: Array, right: Array) -> Array:
    """Solutions (R, 6) of systems (R, 36) with right sides (R, 6)."""
    return solve(gram.reshape(-1, 6, 6), right[..., None])[..., 0]
