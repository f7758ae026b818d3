"""Answers by policy `direction`: the largest share of a target that the actuators' laws give, where
these differ from the core's tables (Eq. 14).

Method `dual` asks for it, of targets out of reach alone.
"""

from typing import NamedTuple

import numpy as np

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem, cheapest_exact, exact_commands
from finlab.arrays import NEARLY, ROUNDS, Array
from finlab.core.calls import Conditions, CoreAnswer

NONE_ALONE = "no share of the target was found that the actuators can give alone"
"""Note of an answer that is off the ray of its target."""
_LEAST_SQUARE = 1e-300
"""Least square of a target's size by which is divided."""


class RowAnswer(NamedTuple):
    """The answer to one target."""

    command: Array
    """(n, 3)."""
    wrench_served: Array
    """Wrench (6,) [N, N m] that the command gives."""
    multipliers: Array
    """Multipliers (6,) [W/N, W/(N m)]."""
    gap_power_bound: float
    """Power [W] that gaps are proved to need for that wrench, by the core's tables."""


def keep_on_rays(
    compiled: Compiled,
    problem: CommandProblem,
    conditions: Conditions,
    targets: Array,
    answer: CoreAnswer,
    command: Array,
) -> set[str]:
    """Overwrites answers that are off the rays of their targets by others that are on them.

    Args:
        compiled: the robot, in its flow.
        problem: of steps on its commands, under the conditions.
        conditions: what holds of the robot.
        targets: desired wrenches (N, 6) [N, N m], along which the answers are to lie.
        answer: of the core, to all targets; what it served, its multipliers and its bounds of gaps
            are overwritten.
        command: (N, n, 3), overwritten, too.

    Returns:
        The note where no share of a target can be given; else none.
    """
    notes = set()
    for row in np.flatnonzero(~answer.is_attainable):
        first = RowAnswer(
            command[row],
            answer.wrench_served[row],
            answer.multipliers[row],
            float(answer.gap_power_bound[row]),
        )
        on_ray = _on_ray(compiled, problem, conditions, targets[row], first)
        if on_ray is None:
            notes.add(NONE_ALONE)
            continue
        command[row] = on_ray.command
        answer.wrench_served[row] = on_ray.wrench_served
        answer.multipliers[row] = on_ray.multipliers
        answer.gap_power_bound[row] = on_ray.gap_power_bound
    return notes


def _on_ray(
    compiled: Compiled,
    problem: CommandProblem,
    conditions: Conditions,
    target: Array,
    first: RowAnswer,
) -> RowAnswer | None:
    """The answer to a target (6,) with the largest share of it that the laws give, found by
    bisection below the share of a first answer; that itself where it is on the ray already; None
    where no share can be given."""
    scale = problem.error_scale
    ray = target / scale
    size_squared = max(float(ray @ ray), _LEAST_SQUARE)
    along_ray = float(first.wrench_served / scale @ ray)
    error = problem.error(first.command[None], first.wrench_served[None] / scale)[0]
    off_ray = first.wrench_served / scale - along_ray / size_squared * ray
    if error <= NEARLY and np.abs(off_ray).max() <= NEARLY:
        return first
    if conditions.previous is not None:
        return first  # what the rates leave is the nearest to the ray already (Eq. 15)

    low = 0.0
    high = along_ray
    best: RowAnswer | None = None
    while high > low + NEARLY * size_squared:
        middle = 0.5 * (low + high)
        tried = middle / size_squared * target[None]
        answer = compiled.forces(tried, None, None, conditions)
        command = exact_commands(problem, answer)
        if problem.error(command, tried / scale)[0] > NEARLY:
            high = middle
            continue
        low = middle
        best = RowAnswer(
            command[0], tried[0], answer.multipliers[0], float(answer.gap_power_bound[0])
        )
    if best is not None:
        return best
    cancelling = _cancelling_command(problem)
    if cancelling is None:
        return None
    return RowAnswer(cancelling, np.zeros(6), np.zeros(6), 0.0)


def _cancelling_command(problem: CommandProblem) -> Array | None:
    """A command (n, 3) of actuators that cannot rest whose least forces, nearly, cancel; None
    without any."""
    lower = problem.plant.lower
    width = problem.plant.upper - lower
    share = np.random.default_rng(0).random((ROUNDS, *lower.shape))
    share[..., :-1] **= 4  # most of them near the least forces
    starts = lower + share * width
    return cheapest_exact(problem, np.zeros(6), starts)
