"""Random fins and robots to learn from: what they are meant to be."""

import numpy as np
import pytest

from finlab.allocation.yardstick import yardstick
from finlab.layout import Layout
from finlab.mdn.answers import effort_robot
from finlab.mdn.training.random_robots import FIN_COUNTS, NUMBERS, random_kinds, random_robot, random_targets
from finlab.mdn.training.teacher import ways_to_deliver
from finlab.physics import Plant


@pytest.fixture(scope="module")
def robots() -> list[Layout]:
    rng = np.random.default_rng(1)
    kinds = random_kinds(rng, 3)
    return [random_robot(rng, kinds, int(rng.choice(list(FIN_COUNTS)))) for _ in range(60)]


def test_robots_are_of_all_kinds(robots: list[Layout]) -> None:
    assert {robot.n_fins for robot in robots} == set(range(2, 13))
    one_kind = [len({(fin.model, fin.limits) for fin in robot.fins}) == 1 for robot in robots]
    assert any(one_kind) and not all(one_kind)
    assert {fin.model.type for robot in robots for fin in robot.fins} == set(NUMBERS)
    # Some robots have a fin whose mirror image, or whose twin above it, is a fin as well.
    symmetric = 0
    for robot in robots:
        place = robot.position
        for mirror in ([1, -1, 1], [1, 1, -1]):
            twins = np.abs(place[:, None] - place * mirror).max(-1) < 1e-9
            symmetric += bool((twins.any(1) & (np.abs(place * mirror - place).max(-1) > 1e-9)).any())
    assert symmetric >= 5


def test_targets_are_within_reach_of_fins_that_turn_fully(robots: list[Layout]) -> None:
    rng = np.random.default_rng(2)
    for layout in robots[:12]:
        robot = effort_robot(Plant(layout), yardstick(layout))
        target = random_targets(rng, robot, 24)
        assert target.shape == (24, 6) and np.isfinite(target).all()
        if not robot.forces.fins.turns_fully:
            continue
        ways = ways_to_deliver(rng, robot.forces, target[:18])  # the last quarter are axes
        assert np.isfinite(ways.cost[:, 0]).mean() > 0.8
