"""From commands near a target to the least effort near them, under exact tracking, by the fins' own laws.

Sequential quadratic programming: steps solve

    min g d + 1/2 d H d   s.t.   J d = what is missing,   within the limits,

with H the curvature of effort minus multipliers times wrench, a block of 3 x 3 for each fin, from differences
of the laws' slopes and made convex. Commands are counted in units of their ranges.
"""

from typing import NamedTuple

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, Refined, refine
from finlab.arrays import AnyArray, Array
from finlab.physics.effort import EffortMeter
from finlab.small_systems import Held, solve, step_within

SETTLED = 2e-3
"""Share of its effort that some row must still have to gain for another step."""
SPACING = 1e-4
"""Of the commands whose slopes are compared, in ranges."""
FLATTEST = 0.02
"""Least curvature, as a share of the mean slope of the effort."""
ROUNDING = 1e-12
"""Least share of a fin's largest curvature that another has; below, it is rounding alone."""
DAMPING = (1e-3, 0.2, 10.0)
"""Curvature added at first, as a share of the mean slope; its factors after good steps and bad ones."""
LONGEST = 0.3
"""Largest change of a command in one step, in ranges."""
PASSES = 4
"""Times that a step is solved, each time with the limits held that it would have crossed."""
RIDGE = 1e-10
"""Relative regularization of the 6 x 6 systems."""


class _Model(NamedTuple):
    """R problems near their commands."""

    missing: Array
    """Target minus wrench, normalized (R, 6)."""
    jacobian: Array
    """Change of the wrench (R, n, 3, 6)."""
    slope: Array
    """Of the effort (R, n, 3)."""
    curvature: Array
    """Of effort minus multipliers times wrench, convex (R, n, 3, 3)."""


def polish(
    problem: CommandProblem, effort: EffortMeter, target: Array, start: Refined, steps: int, each: int = 1
) -> Refined:
    """Lower the effort of commands at no loss of exactness.

    Args:
        problem: the robot.
        effort: its effort.
        target: normalized wrenches (R, 6).
        start: refined commands that come near.
        steps: most quadratic problems.
        each: number of rows that are answers to one target, side by side.
    """
    here, value = start, effort(start.command)
    damping = np.full(len(value), DAMPING[0])
    multiplier: AnyArray | None = None
    for _ in range(steps):
        model, multiplier = _model(problem, effort, target, here.command, multiplier, damping)
        step, multiplier = _step(problem, model, here.command, multiplier)
        # An error costs twice what the multipliers say, so that none is left for a gain.
        weight = 2.0 * np.sqrt(np.einsum("ri,ri->r", multiplier, multiplier))
        gain = np.abs(np.einsum("rni,rni->r", model.slope, step)) + weight * here.error
        # What cannot become the cheapest need not be followed to its end.
        best = np.repeat(value.reshape(-1, each).min(1), each)
        if ((gain <= SETTLED * value) | (value - gain > best)).all():
            break
        # Brought back onto the target, a long step is not refused for the error that its bend leaves.
        there = refine(problem, target, here.command + step * problem.width, 1)
        new_value = effort(there.command)
        better = new_value + weight * there.error < value + weight * here.error
        here = _chosen(better, there, here)
        value = np.where(better, new_value, value)
        damping = damping * np.where(better, DAMPING[1], DAMPING[2])
    return here


def _chosen(rows: Held, first: Refined, second: Refined) -> Refined:
    """Row by row the first or the second."""
    if rows.all():
        return first
    command = np.where(rows[:, None, None], first.command, second.command)
    wrench = np.where(rows[:, None], first.wrench, second.wrench)
    return Refined(command, wrench, np.where(rows, first.error, second.error))


def _model(
    problem: CommandProblem,
    effort: EffortMeter,
    target: Array,
    command: Array,
    multiplier: AnyArray | None,
    damping: Array,
) -> tuple[_Model, AnyArray]:
    """The problems near commands (R, n, 3), by their slopes there and a little to the side, and the
    multipliers (R, 6) of which their curvature is."""
    rows, n, _ = command.shape
    apart = np.where(command > problem.edges[1] - SPACING * problem.width, -SPACING, SPACING)
    points = np.repeat(command[None], 4, axis=0)
    for k in range(3):
        points[k + 1, ..., k] += apart[..., k] * problem.width[:, k]
    points = points.reshape(4 * rows, n, 3)
    force, jacobian = problem.fin.force_and_jacobian(points)
    slope = (effort.gradient(points) * problem.width).reshape(4, rows, n, 3)
    flat = problem.effectiveness.reshape(-1, 6)
    missing = target - force[:rows].reshape(rows, len(flat)) @ flat
    by_wrench = jacobian[:rows] @ problem.effectiveness * problem.width[..., None]
    if multiplier is None:
        inside = (command > problem.edges[0]) & (command < problem.edges[1])
        multiplier = _balance(by_wrench * inside[..., None], slope[0])
    pull = (multiplier @ flat.T).reshape(rows, n, -1, 1)
    pulled = (jacobian.reshape(4, rows, n, 3, -1) @ pull)[..., 0] * problem.width
    left = slope - pulled
    apart = np.moveaxis(apart, -1, 0)[..., None]
    curvature = np.moveaxis((left[1:] - left[0]) / apart, 0, 2)
    return _Model(missing, by_wrench, slope[0], _convex(curvature, slope[0], damping)), multiplier


def _balance(jacobian: Array, slope: Array) -> AnyArray:
    """Multipliers (R, 6) that come nearest to balancing the slopes of the effort."""
    flat = jacobian.reshape(len(jacobian), -1, 6)
    across = flat.swapaxes(1, 2)
    return solve(_regular(across @ flat), across @ slope.reshape(len(flat), -1, 1))[..., 0]


def _convex(curvature: Array, slope: Array, damping: Array) -> Array:
    """Curvatures (R, n, 3, 3) with no direction in which they fall, or are flat, and with the damping."""
    size, axes = np.linalg.eigh(0.5 * (curvature + curvature.swapaxes(-1, -2)))
    usual = (np.abs(slope).mean((1, 2)) + 1e-12)[:, None, None]
    size = np.abs(size)
    size = np.maximum(size, np.maximum(FLATTEST * usual, ROUNDING * size.max(-1, keepdims=True)))
    size += damping[:, None, None] * usual
    convex: Array = (axes * size[..., None, :]) @ axes.swapaxes(-1, -2)
    return convex


def _step(
    problem: CommandProblem, model: _Model, command: Array, multiplier: AnyArray
) -> tuple[Array, AnyArray]:
    """Steps (R, n, 3) in ranges, and the multipliers (R, 6) with which they are the cheapest."""
    span = np.where(problem.width > 0.0, problem.width, 1.0)
    low, high = (problem.lower - command) / span, (problem.upper - command) / span
    low[:, problem.full_turn, 2], high[:, problem.full_turn, 2] = -np.inf, np.inf
    answer = multiplier

    def free_step(fixed: Array, held: Held) -> Array:
        nonlocal answer
        free, answer = _free_step(model, fixed, held)
        return free

    step = step_within(free_step, low, high, PASSES)
    longest = np.abs(step).max((1, 2))
    return step * np.minimum(1.0, LONGEST / np.maximum(longest, 1e-12))[:, None, None], answer


def _free_step(model: _Model, fixed: Array, held: Held) -> tuple[Array, AnyArray]:
    """The cheapest steps (R, n, 3) of which some are held at what is fixed, and their multipliers (R, 6)."""
    rows, n = fixed.shape[:2]
    missing, jacobian, slope, curvature = model
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
    size = RIDGE * np.trace(gram, axis1=1, axis2=2) + 1e-14
    regular: Array = gram + size[:, None, None] * np.eye(6)
    return regular
