"""The one wrench within reach that a policy asks for in place of one that is out of reach."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.policy import Policy
from finlab.forces.force_space import PlanarProblem
from finlab.forces.nearest import Nearest, nearest, nearest_along, nearest_in_turn

Array = NDArray[Any]


def project_target(problem: PlanarProblem, policy: Policy, target: Array) -> Nearest:
    """The one wrench to deliver, normalized, and forces that do so.

    Args:
        problem: the layout.
        policy: what counts.
        target: the wrench (6,) that was asked for.
    """
    if policy.kind == "direction":
        return nearest_along(problem.sets, target)
    if policy.kind == "priority":
        return nearest_in_turn(problem.sets, target, policy.groups)
    weights = np.array(policy.axis_weights, np.float64)
    with np.errstate(divide="ignore"):
        return nearest(problem.sets, target[None], (weights.max() / weights) ** 2)
