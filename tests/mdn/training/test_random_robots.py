"""Random fins and robots to learn from: what they are meant to be."""

import numpy as np
import pytest

from finlab.layout import Limits
from finlab.mdn.training.random_fins import SHARES, random_fin, random_law, varied_limits
from finlab.mdn.training.random_robots import FIN_COUNTS, FinPool, RandomRobot, random_robot, random_targets
from finlab.mdn.training.teacher import ways_to_deliver

STD = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])


@pytest.fixture(scope="module")
def pool() -> FinPool:
    return FinPool(np.random.default_rng(4), 3)


@pytest.mark.parametrize("family", SHARES)
def test_every_family_pushes_and_takes_power(family: str) -> None:
    for seed in range(5):
        law = random_law(np.random.default_rng(seed), family)
        command = np.array([[0.3, 1.2, 0.4], [0.6, 2.1, -2.0]])
        force = law.force(command)
        assert np.isfinite(force).all() and np.hypot(force[..., 1], force[..., 2]).min() > 0.0
        assert (law.power(command) > 0.0).all()


def test_a_fin_is_compiled_within_its_limits() -> None:
    rng = np.random.default_rng(0)
    fin = random_fin(rng, varied_limits(rng))
    assert fin.compiled.largest.max() > 0.0 and fin.limits != Limits()


def robots(pool: FinPool, count: int = 60) -> list[RandomRobot]:
    rng = np.random.default_rng(1)
    return [random_robot(rng, pool, int(rng.choice(list(FIN_COUNTS))), STD) for _ in range(count)]


def test_robots_are_of_all_kinds(pool: FinPool) -> None:
    made = robots(pool)
    assert {robot.layout.n_fins for robot in made} == set(range(2, 13))
    one_kind = [len(set(map(id, robot.fins))) == 1 for robot in made]
    assert any(one_kind) and not all(one_kind)
    # Some robots have a fin whose mirror image, or whose twin above it, is a fin as well.
    symmetric = 0
    for robot in made:
        place = robot.layout.position
        for mirror in ([1, -1, 1], [1, 1, -1]):
            twins = np.abs(place[:, None] - place * mirror).max(-1) < 1e-9
            symmetric += bool((twins.any(1) & (np.abs(place * mirror - place).max(-1) > 1e-9)).any())
    assert symmetric >= 5


def test_targets_are_within_reach_of_fins_that_turn_fully(pool: FinPool) -> None:
    rng = np.random.default_rng(2)
    for robot in robots(pool, 12):
        target = random_targets(rng, robot, 24)
        assert target.shape == (24, 6) and np.isfinite(target).all()
        if not robot.problem.fins.turns_fully:
            continue
        ways = ways_to_deliver(rng, robot, target[:18])  # the last quarter are axes
        assert np.isfinite(ways.cost[:, 0]).mean() > 0.8
