"""From rough forces to the least effort near them that delivers a wrench, in the space of planar
forces.

Each fin gives a planar force y_i, so the wrench is linear: w = sum_i B_i y_i. The effort of a force
grows more slowly than the force, so the cheapest allocation rests some fins, and there are many
local minima. Each proposal is driven downhill by solving, again and again, the quadratic problem
that touches the efforts at the present forces from above,

    min sum_i g_i (y - y_i) + 1/2 (y - y_i) H_i (y - y_i)   s.t.   sum_i B_i y_i = w,

through its six multipliers l: y = shift + M B_i^T l with M = H^-1. Along a force, H is the
curvature of the quadratic about the origin that touches the effort, or the effort's own where it is
convex; across the force it is (dc/dT) / T. A fin that is asked for more than it can has all its
mobility cut in proportion, again and again until it holds.

Planar forces are complex numbers (see `effort_fins`). A symmetric 2 x 2 matrix M maps p to a p + b
conj(p), with a real.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Array, solve
from finlab.axes import wrapped
from finlab.research.mdn import effort_fins

RIDGE = 1e-9
"""Relative regularization of the 6 x 6 systems."""
HALF_STEPS = 5
"""Steps after which forces go only half the way: those that are not settled by then jump to and
fro."""


class EffortProblem(NamedTuple):
    """One robot of n fins as the descent sees it."""

    effectiveness: Array
    """Normalized wrench per newton (2n, 6), of each fin's horizontal and vertical force in turn."""
    products: Array
    """What a, real b and imaginary b of each fin's M add to B M B^T (3n, 36), slightly
    regularized."""
    fins: effort_fins.EffortFins
    """What the fins can do, and with what effort."""
    direction_cost: Array
    """Effort per squared zero direction (n,) [1/rad^2]."""
    idle_direction: Array
    """Zero direction (n,) [rad] to which a fin at rest turns."""


def effort_problem(
    effectiveness: Array, fins: effort_fins.EffortFins, direction_cost: Array, idle_direction: Array
) -> EffortProblem:
    """A problem from normalized wrenches (n, 2, 6) per newton of each fin's planar force."""
    x = effectiveness[:, 0]
    z = effectiveness[:, 1]
    xx, xz, zz = (np.einsum("ni,nj->nij", *pair) for pair in ((x, x), (x, z), (z, z)))
    products = np.concatenate([xx + zz, xx - zz, xz + xz.swapaxes(1, 2)])
    # The ridge of a sum is the sum of the ridges.
    products += RIDGE * np.trace(products, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    flat = np.ascontiguousarray(effectiveness.reshape(-1, 6))
    return EffortProblem(
        flat, np.ascontiguousarray(products.reshape(-1, 36)), fins, direction_cost, idle_direction
    )


def descend(
    problem: EffortProblem, target: Array, force: AnyArray, steps: int
) -> Iterator[effort_fins.Projected]:
    """Follow R forces (R, n) to cheap ones that give normalized targets (R, 6): what fins can give
    of them, then what each of `steps` problems makes of it."""
    fins = problem.fins
    reached = fins.project(force)
    yield reached
    cut = np.ones(force.shape)
    before = reached.force
    for step in range(steps):
        shift, a, b = _respond(problem, reached, cut)
        missing = target - wrench(problem, shift)
        matrix = np.concatenate([a, b.real, b.imag], axis=1) @ problem.products
        matrix[:, ::7] += effort_fins.LEAST  # the diagonal
        multiplier = solve(matrix.reshape(-1, 6, 6), missing[..., None])[..., 0]
        pull = (multiplier @ problem.effectiveness.T).view(complex)
        answer = shift + a * pull + b * pull.conj()
        if step >= HALF_STEPS:
            answer = 0.5 * (answer + before)
        before = answer
        reached = fins.project(answer)
        cut = np.minimum(
            cut * fins.largest * reached.gauge / np.maximum(reached.wanted, effort_fins.LEAST), 1.0
        )
        yield reached


def wrench(problem: EffortProblem, force: AnyArray) -> Array:
    """Normalized wrenches (R, 6) of planar forces (R, n), complex."""
    return np.ascontiguousarray(force).view(float) @ problem.effectiveness


def realize(problem: EffortProblem, reached: effort_fins.Projected) -> tuple[Array, Array]:
    """Commands (R, n, 3) that give forces with the least effort, and that effort (R,)."""
    row = problem.fins.lookup(reached.size / reached.gauge)
    direction = reached.direction
    turn = wrapped(direction - problem.fins.deflection(direction))
    command = np.stack(
        [row[..., effort_fins.AMPLITUDE], row[..., effort_fins.FREQUENCY], turn], axis=-1
    )
    effort = row[..., effort_fins.EFFORT] + problem.direction_cost * turn * turn
    return command, effort.sum(-1)


def _respond(
    problem: EffortProblem, reached: effort_fins.Projected, cut: Array
) -> tuple[AnyArray, Array, AnyArray]:
    """How fins answer a pull p, all of it `cut`: shift + a p + b conj(p), three arrays (R, n), by
    the quadratics that touch the efforts at the present forces."""
    row = problem.fins.lookup(reached.size / reached.gauge)
    direction = reached.direction
    # The same command gives less in weaker directions, so a newton more costs more there.
    across = np.exp(row[..., effort_fins.MOBILITY]) * reached.gauge**2 * cut
    softness = 1.0 / row[..., effort_fins.STIFFNESS]
    along = across * softness
    turn = wrapped(direction - problem.fins.deflection(direction))
    size = np.maximum(reached.size, effort_fins.LEAST)
    # Turning towards where that costs nothing: the weaker the force, the less of it does.
    pull = 2.0 * problem.direction_cost * across / size
    held = 1.0 / (1.0 + pull / size)
    across = across * held
    unit = reached.unit
    shift = (reached.size * (1.0 - softness) * cut - 1j * pull * turn * held) * unit
    return shift, 0.5 * (along + across), 0.5 * (along - across) * unit * unit
