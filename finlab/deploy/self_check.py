"""`finlab-runtime check`: does this computer answer as the desk did, and truly?

To be run on the robot before first use. Are the fins' laws and tables the same here, do the fins' own models
confirm this computer's answers, and are these as good as the stored ones.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from finlab.allocation.evaluate import REACHED
from finlab.deploy.graph import SELF_TEST_TOLERANCE
from finlab.deploy.robot import DeployedRobot
from finlab.errors import DataError
from finlab.physics import plant_of

ERROR_TOLERANCE = 1e-5
"""Normalized error by which an answer may be worse than the stored one."""
COST_TOLERANCE = 0.01
"""Largest share by which an answer may cost more than the stored one."""


class Finding(NamedTuple):
    """One question and its answer."""

    question: str
    """What was compared."""
    value: float
    """Largest difference found; NaN where an answer was no number."""
    limit: float
    """Largest difference allowed."""

    @property
    def good(self) -> bool:
        """Whether the robot may be trusted in this respect; NaN is never good."""
        return self.value <= self.limit


def self_check(robot: DeployedRobot) -> list[Finding]:
    """Ask everything.

    Raises:
        DataError: the bundle has no self-tests, or a force table cannot be read.
    """
    cases, layout, failed = robot.graph.self_test, robot.layout, robot.graph.failed
    if not cases:
        raise DataError("the bundle has no self-tests; export it again")
    alive = [i for i, name in enumerate(layout.names) if name not in failed]
    plant, scale = plant_of(robot.graph.healthy), robot.allocator.scale
    cost = robot.objective.meter(plant)

    differs, errors, worse, dearer = [], [], [], []
    for case in cases:
        stored = np.array([case.command[i] for i in alive], dtype=np.float64)
        target, delivered = np.array(case.wrench), np.array(case.delivered_wrench)
        answer = robot.allocator.allocate(case.wrench, failed=failed)
        differs.append(float(np.linalg.norm((plant.wrench(stored) - delivered) / scale)))
        errors.append(answer.err_norm)
        worse.append(answer.err_norm - float(np.linalg.norm((delivered - target) / scale)))
        prices = cost(np.stack([answer.command[alive], stored]))
        dearer.append(float(prices[0] / max(prices[1], 1e-9)) - 1.0)
    return [
        Finding("wrench of the stored commands (err_norm)", worst(differs), SELF_TEST_TOLERANCE),
        Finding("own answers, judged by the fins' own models (err_norm)", worst(errors), REACHED),
        Finding("own answers, more error than stored (err_norm)", worst(worse), ERROR_TOLERANCE),
        Finding("own answers, more cost than stored (share)", worst(dearer), COST_TOLERANCE),
    ]


def worst(values: Iterable[float]) -> float:
    """The largest value, not below 0; NaN if any value is NaN."""
    return float(np.max([0.0, *values]))
