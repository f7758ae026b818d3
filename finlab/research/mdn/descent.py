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

from finlab.arrays import AnyArray, Array, solve_or_nan
from finlab.axes import wrapped
from finlab.research.mdn import effort_fins

RIDGE = 1e-9
"""Relative regularization of the 6 x 6 systems."""
FULL_STEPS = 5
"""Steps after which steps are halved: forces that have not converged by then oscillate."""


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
    """Follows forces to cheap ones that give a target.

    Each step solves B M B^T l = w - B shift for the multipliers l, and takes y = shift + M B^T l.

    Args:
        problem: the robot.
        target: normalized targets w (R, 6).
        force: to begin with (R, n), complex [N].
        steps: number of quadratic problems.

    Yields:
        What fins can give of the forces, at first and after each step.
    """
    fins = problem.fins
    projected = fins.project(force)
    yield projected
    mobility_factor = np.ones(force.shape)
    before = projected.force
    coefficients = np.empty((len(force), len(problem.products)))
    for step in range(steps):
        shift, a, b = _respond(problem, projected, mobility_factor)
        residual = target - wrench(problem, shift)
        np.concatenate([a, b.real, b.imag], axis=1, out=coefficients)
        BMB = coefficients @ problem.products
        BMB[:, ::7] += effort_fins.LEAST  # the diagonal
        multiplier = solve_or_nan(BMB.reshape(-1, 6, 6), residual[..., None])[..., 0]
        p = (multiplier @ problem.effectiveness.T).view(complex)  # B^T l
        y = shift + a * p + b * p.conj()
        if step >= FULL_STEPS:
            y = 0.5 * (y + before)
        before = y
        projected = fins.project(y)
        largest = fins.largest if fins.gauge is None else fins.largest * projected.gauge
        unbounded = np.maximum(projected.wanted, effort_fins.LEAST)
        mobility_factor = np.minimum(mobility_factor * largest / unbounded, 1.0)
        yield projected


def wrench(problem: EffortProblem, force: AnyArray) -> Array:
    """Normalized wrenches (R, 6) of planar forces (R, n), complex."""
    return np.ascontiguousarray(force).view(float) @ problem.effectiveness


def realize(problem: EffortProblem, projected: effort_fins.Projected) -> tuple[Array, Array]:
    """Returns commands (R, n, 3) that give forces with the least effort, and that effort (R,)."""
    row = problem.fins.lookup(projected.size / projected.gauge)
    direction = projected.direction
    turn = wrapped(direction - problem.fins.deflection(direction))
    command = np.stack(
        [row[..., effort_fins.AMPLITUDE], row[..., effort_fins.FREQUENCY], turn], axis=-1
    )
    effort = row[..., effort_fins.EFFORT] + problem.direction_cost * turn * turn
    return command, effort.sum(-1)


def _respond(
    problem: EffortProblem, projected: effort_fins.Projected, mobility_factor: Array
) -> tuple[AnyArray, Array, AnyArray]:
    """How fins respond to p = B_i^T l by the quadratics that touch the efforts at the present
    forces.

    Args:
        problem: the robot.
        projected: the present forces.
        mobility_factor: by which M is cut (R, n).

    Returns:
        shift, a and b of y = shift + a p + b conj(p), each (R, n).
    """
    fins = problem.fins
    is_even = fins.gauge is None
    scaled = projected.size if is_even else projected.size / projected.gauge
    log_mobility, stiffness = fins.response(scaled)
    # M across and along the force. The same command gives less in weaker directions, so a newton
    # more costs more there.
    across = np.exp(log_mobility)
    if not is_even:
        across *= projected.gauge**2
    across *= mobility_factor
    softness = 1.0 / stiffness
    along = across * softness
    direction = projected.direction
    turn = wrapped(direction if fins.is_straight else direction - fins.deflection(direction))
    size = np.maximum(projected.size, effort_fins.LEAST)
    # Turning towards where that costs nothing: the weaker the force, the less of it does.
    restoring = 2.0 * problem.direction_cost * across / size
    turn_factor = 1.0 / (1.0 + restoring / size)
    across *= turn_factor
    unit = projected.unit
    # Along the force and across it, then turned to where it points.
    shift = np.empty(unit.shape, complex)
    shift.real = projected.size * (1.0 - softness) * mobility_factor
    shift.imag = -restoring * turn * turn_factor
    shift *= unit
    a = 0.5 * (along + across)
    b = 0.5 * (along - across) * unit * unit
    return shift, a, b
