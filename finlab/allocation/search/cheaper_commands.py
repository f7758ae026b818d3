"""Cheaper commands near those of a search in force space, where that stops short of the minimum.

The cost of a measured fin rises and falls with the noise of its table; the search sees it smoothed. For the
effort of many fins the cheapest way often has some at their largest force and others at rest, where the
search hardly moves. From where it leads, sequential quadratic programming by the fins' own laws goes on to
the next minimum under exact tracking: steps solve

    min g d + 1/2 d H d   s.t.   J d = what is missing,   within the limits,

with H the curvature of cost minus multipliers times wrench, a block of 3 x 3 for each fin, from differences
of the laws' slopes and made convex. Commands are counted in units of their ranges.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.arrays import AnyArray, Array
from finlab.physics.objective import CostMeter
from finlab.small_systems import Held, solve, step_within


@dataclass(frozen=True)
class DescentNumbers:
    """How steps to cheaper commands are chosen."""

    most_problems: int = 6
    """Most quadratic problems solved in turn."""
    settled: float = 2e-3
    """Share of its cost that some row must still have to gain for another step."""
    lm_steps: tuple[int, int, int] = (1, 1, 1)
    """Levenberg-Marquardt steps that bring commands onto the target: first, after each step, in the end."""
    spacing: float = 1e-4
    """Of the commands whose slopes are compared, in ranges."""
    flattest: float = 0.02
    """Least curvature, as a share of the mean slope of the cost."""
    damping: tuple[float, float, float] = (1e-3, 0.2, 10.0)
    """Curvature added at first, as such a share; its factors after steps that help and that do not."""
    longest: float = 0.3
    """Largest change of a command in one step, in ranges."""
    passes: int = 4
    """Times that a step is solved, each time with the limits held that it would have crossed."""
    ridge: float = 1e-10
    """Relative regularization of the 6 x 6 systems."""
    rounding: float = 1e-12
    """Least share of a fin's largest curvature that another has; below, it differs from nothing by rounding
    alone."""
    hopeless: float = 1.0
    """Normalized error from which on no steps are taken: none of these would end at the target."""


DESCENT = DescentNumbers()
"""What every descent uses."""


class _Model(NamedTuple):
    """R problems near their commands."""

    missing: Array
    """Target minus wrench, normalized (R, 6)."""
    jacobian: Array
    """Change of the wrench (R, n, 3, 6)."""
    slope: Array
    """Of the cost (R, n, 3)."""
    by_force: Array
    """Second derivatives (R, n, 3, 3, 6) of the wrench."""
    by_cost: Array
    """Second derivatives (R, n, 3, 3) of the cost."""


def cheaper_commands(
    problem: CommandProblem, cost: CostMeter, target: Array, command: Array, exact_error: float
) -> Array:
    """Returns commands (R, n, 3) that cost no more than those given once these are refined.

    Args:
        problem: the layout.
        cost: what is kept least.
        target: normalized wrenches (R, 6), or one for all rows (1, 6).
        command: where to start (R, n, 3).
        exact_error: normalized error up to which commands are exact.
    """
    first_steps, steps_between, last_steps = DESCENT.lm_steps
    target = np.broadcast_to(target, (len(command), 6))
    start = refine(problem, target, command, first_steps)
    near = start.error <= DESCENT.hopeless
    if not near.all():  # what is far out of reach would only drive the multipliers out of bounds
        mixed: Array = start.command.copy()
        if near.any():
            mixed[near] = cheaper_commands(problem, cost, target[near], mixed[near], exact_error)
        return mixed
    here, value, error = start.command, cost(start.command), start.error
    damping = np.full(len(here), DESCENT.damping[0])
    multiplier: AnyArray | None = None
    for _ in range(DESCENT.most_problems):
        model = _model(problem, cost, target, here)
        if multiplier is None:
            multiplier = _balance(model)
        step, multiplier = _step(problem, model, here, multiplier, damping)
        # An error costs twice what the multipliers say, so that none is left for a gain.
        weight = 2.0 * np.linalg.norm(multiplier, axis=-1)
        gain = np.abs((model.slope * step).sum((1, 2))) + weight * error
        if (gain <= DESCENT.settled * value).all():
            break
        # Brought back onto the target, a long step is not refused for the error that its bend leaves.
        there, _, new_error = refine(problem, target, here + step * problem.width, steps_between)
        new_value = cost(there)
        better = new_value + weight * new_error < value + weight * error
        here = np.where(better[:, None, None], there, here)
        value, error = np.where(better, new_value, value), np.where(better, new_error, error)
        damping = np.where(better, damping * DESCENT.damping[1], damping * DESCENT.damping[2])
    if here is start.command:
        return here
    found = refine(problem, target, here, last_steps)
    value = cost(start.command)
    keep = (found.error > exact_error) | ((cost(found.command) > value) & (start.error <= exact_error))
    return np.where(keep[:, None, None], start.command, found.command)


def _model(problem: CommandProblem, cost: CostMeter, target: Array, command: Array) -> _Model:
    """The problems near commands (R, n, 3), by their slopes there and a little to the side."""
    rows, n, _ = command.shape
    high = problem.edges[1] - DESCENT.spacing * problem.width
    apart = np.where(command > high, -DESCENT.spacing, DESCENT.spacing)
    points = np.repeat(command[None], 4, axis=0)
    for k in range(3):
        points[k + 1, ..., k] += (apart * problem.width)[..., k]
    points = points.reshape(4 * rows, n, 3)
    force, gradient = problem.fin.force_and_jacobian(points)
    jacobian = (gradient @ problem.effectiveness * problem.width[..., None]).reshape(4, rows, n, 3, 6)
    slope = (cost.gradient(points) * problem.width).reshape(4, rows, n, 3)
    effectiveness = problem.effectiveness.reshape(-1, 6)
    wrench = force[:rows].reshape(rows, len(effectiveness)) @ effectiveness
    apart = np.moveaxis(apart, -1, 0)[..., None]
    by_force = np.moveaxis((jacobian[1:] - jacobian[0]) / apart[..., None], 0, 2)
    by_cost = np.moveaxis((slope[1:] - slope[0]) / apart, 0, 2)
    return _Model(target - wrench, jacobian[0], slope[0], by_force, by_cost)


def _balance(model: _Model) -> AnyArray:
    """Multipliers (R, 6) that come nearest to balancing the slopes of the cost."""
    jacobian = model.jacobian.reshape(len(model.jacobian), -1, 6)
    transposed = jacobian.swapaxes(1, 2)
    pull = transposed @ model.slope.reshape(len(jacobian), -1, 1)
    return solve(_regular(transposed @ jacobian), pull)[..., 0]


def _step(
    problem: CommandProblem, model: _Model, command: Array, multiplier: AnyArray, damping: Array
) -> tuple[Array, Array]:
    """Steps (R, n, 3) in ranges, and the multipliers (R, 6) with which they are the cheapest."""
    curvature = model.by_cost - (model.by_force @ multiplier[:, None, None, :, None])[..., 0]
    size, axes = np.linalg.eigh(0.5 * (curvature + curvature.swapaxes(-1, -2)))
    usual = (np.abs(model.slope).mean((1, 2)) + 1e-12)[:, None, None]
    size = np.abs(size)
    least = np.maximum(DESCENT.flattest * usual, DESCENT.rounding * size.max(-1, keepdims=True))
    size = np.maximum(size, least)
    size += damping[:, None, None] * usual
    curvature = (axes * size[..., None, :]) @ axes.swapaxes(-1, -2)
    span = np.where(problem.width > 0.0, problem.width, 1.0)
    low, high = (problem.lower - command) / span, (problem.upper - command) / span
    low[:, problem.full_turn, 2], high[:, problem.full_turn, 2] = -np.inf, np.inf
    answer = multiplier

    def free_step(fixed: Array, held: Held) -> Array:
        nonlocal answer
        free, answer = _free_step(model, curvature, fixed, held)
        return free

    step = step_within(free_step, low, high, DESCENT.passes)
    longest = np.abs(step).max((1, 2))
    return step * np.minimum(1.0, DESCENT.longest / np.maximum(longest, 1e-12))[:, None, None], answer


def _free_step(model: _Model, curvature: Array, fixed: Array, held: AnyArray) -> tuple[Array, Array]:
    """The cheapest steps (R, n, 3) of which some are held at what is fixed, and their multipliers (R, 6)."""
    rows, n = fixed.shape[:2]
    missing, slope, jacobian = model.missing, model.slope, model.jacobian
    if held.any():
        missing = missing - _wrench_of(jacobian, fixed)
        slope = np.where(held, 0.0, slope + (curvature @ fixed[..., None])[..., 0])
        jacobian = np.where(held[..., None], 0.0, jacobian)
        curvature = np.where(held[..., None] | held[..., None, :], np.eye(3), curvature)
    # Both at once: how the commands answer the multipliers, and what they do without them.
    answer = solve(curvature, np.concatenate([jacobian, slope[..., None]], axis=-1))
    pulled, drift = answer[..., :6], answer[..., 6]
    gram = jacobian.reshape(rows, 3 * n, 6).swapaxes(1, 2) @ pulled.reshape(rows, 3 * n, 6)
    right = missing + _wrench_of(jacobian, drift)
    multiplier = solve(_regular(gram), right[..., None])[..., 0]
    step = (pulled @ multiplier[:, None, :, None])[..., 0] - drift
    return np.where(held, fixed, step), multiplier


def _wrench_of(jacobian: Array, step: Array) -> Array:
    """What steps (R, n, 3) change of the wrench (R, 6), by its derivatives (R, n, 3, 6)."""
    rows, n, _ = step.shape
    wrench: Array = (step.reshape(rows, 1, 3 * n) @ jacobian.reshape(rows, 3 * n, 6))[:, 0]
    return wrench


def _regular(gram: Array) -> Array:
    """Matrices (R, 6, 6), slightly regularized."""
    size = DESCENT.ridge * np.trace(gram, axis1=1, axis2=2) + 1e-14
    regular: Array = gram + size[:, None, None] * np.eye(6)
    return regular
