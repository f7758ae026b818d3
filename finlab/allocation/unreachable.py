"""As close as the robot comes to a wrench it cannot deliver, under weights and priorities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import CommandProblem, refine

Array = NDArray[np.float64]

STEPS = 40
"""Levenberg-Marquardt steps for each group of axes."""


def serve_in_turn(
    problem: CommandProblem,
    target: Array,
    stages: Sequence[tuple[Array, NDArray[np.bool_]]],
    starts: Array,
) -> Array:
    """The command (n, 3) that serves one stage after the other.

    Args:
        problem: the layout.
        target: normalized wrench (6,).
        stages: for each, weights (6,) of the error, and the axes (6,) that later stages must keep
            where this one brought them.
        starts: commands (R, n, 3) to start from; the best of all ends counts.
    """
    goal = target
    command = starts
    for weights, settled in stages:
        repeated = np.broadcast_to(goal, (len(command), 6))
        refined = refine(problem, repeated, command, STEPS, weights=weights)
        order = np.argsort(refined.error)
        command = refined.command[order]
        reached = problem.wrench(command[:1])[0]
        goal = np.where(settled, reached, target)
    best: Array = command[0]
    return best
