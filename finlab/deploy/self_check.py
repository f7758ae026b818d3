"""`finlab-runtime check`: does this computer answer as the desk did, and truly?

To be run on the robot before first use. Are the actuators' laws and tables the same here, do they confirm
this computer's answers, and is there an answer to the extremes.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import KINDS
from finlab.allocation.yardstick import REACHED
from finlab.arrays import Array
from finlab.deploy.robot import DeployedRobot
from finlab.errors import DataError
from finlab.layout.axes import AXES
from finlab.layout.load import Case
from finlab.physics import plant_of

N_SELF_TEST = 4
"""Self-test wrenches in a bundle: enough to notice a wrong file, few enough to read."""
SELF_TEST_TOLERANCE = 1e-6
"""Allowed normalized error between the wrench of a self-test's command and what another machine computes for
it; both are written with nine digits."""
FAR = 10.0
"""Size of an extreme target in yardsticks: beyond the reach of any robot."""


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


def self_tests(allocator: Allocator, failed: tuple[str, ...]) -> tuple[Case, ...]:
    """Targets that can be reached, wrenches of random commands, with an allocator's answers.

    They depend on the layout and the allocator alone.

    Raises:
        LayoutError: an unknown failed actuator, or none left.
        DataError: a fin's force table cannot be read.
    """
    layout = allocator.layout
    plant = plant_of(layout.without(failed) if failed else layout)
    cases = []
    for wrench in plant.wrench(plant.sample(np.random.default_rng(0), (N_SELF_TEST,))):
        target = _rounded(wrench)
        answer = _rounded(allocator.allocate(target, failed=failed).command)
        delivered = _rounded(plant.wrench(answer[~np.isnan(answer).any(axis=1)]))
        rows = [
            None if name in failed else tuple(row)
            for name, row in zip(layout.names, answer.tolist(), strict=True)
        ]
        cases.append(Case(tuple(target.tolist()), tuple(rows), tuple(delivered.tolist())))
    return tuple(cases)


def self_check(robot: DeployedRobot) -> list[Finding]:
    """Ask what the bundle knows the answers of.

    Raises:
        DataError: the bundle has no self-tests, or a force table cannot be read.
    """
    if not robot.self_test:
        raise DataError("the bundle has no self-tests; export it again")
    layout, failed = robot.layout, robot.failed
    alive = [i for i, name in enumerate(layout.names) if name not in failed]
    plant, scale = plant_of(layout.without(failed) if failed else layout), robot.allocator.scale
    differs, errors = [], []
    for case in robot.self_test:
        stored = plant.wrench(np.array([case.command[i] for i in alive], dtype=np.float64))
        differs.append(float(np.linalg.norm((stored - np.array(case.delivered_wrench)) / scale)))
        errors.append(robot.allocator.allocate(case.wrench, failed=failed).err_norm)
    return [
        Finding("wrench of the stored commands (err_norm)", float(np.max(differs)), SELF_TEST_TOLERANCE),
        Finding("own answers, judged by the actuators' own laws (err_norm)", float(np.max(errors)), REACHED),
    ]


def extremes(robot: DeployedRobot) -> Finding:
    """Ask for each axis both ways, far out of reach, by all policies, with each actuator lost in turn; the
    value is how many of these have no answer, and the question names the first of them."""
    layout, silent, n = robot.layout, [], 0
    alive = [name for name in layout.names if name not in robot.failed]
    for lost in [(), *([name] for name in alive if len(alive) > 1)]:
        for policy, i in product(KINDS, np.flatnonzero(layout.commanded)):
            for way in (-1.0, 1.0):
                target = np.zeros(6)
                target[i], n = way * FAR * robot.allocator.scale[i], n + 1
                try:
                    robot.allocate(target, failed=lost, policy=policy)
                except Exception as error:  # each is a finding
                    what = f"{policy} {'+' if way > 0.0 else '-'}{AXES[i]}, {' '.join(lost) or 'none'} lost"
                    silent.append(f"{what}: {type(error).__name__}: {error!s:.100}")
    first = f", first {silent[0]}" if silent else ""
    return Finding(f"extremes without an answer, of {n}{first}", float(len(silent)), 0.0)


def _rounded(values: Array) -> Array:
    """Nine significant digits: more than any servo has, and the same text on most machines."""
    return np.array([float(f"{value:.9g}") for value in values.flat]).reshape(values.shape)
