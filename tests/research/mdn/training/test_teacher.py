"""What the teacher tells: exact ways, told apart, the cheapest first, with weights by their
cost."""

from itertools import chain

import numpy as np
import pytest

from finlab.layout import Layout
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.research.mdn.answers import EffortRobot, effort_robot
from finlab.research.mdn.descent import realize, wrench
from finlab.research.mdn.training import teacher
from finlab.research.random_layouts import FIN_COUNTS, WIDE, random_fin_kinds, random_fin_robot

WRENCH_SCALE = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
"""Scale of errors in the six axes [N, N m]."""


def robot_targets_and_minima() -> tuple[EffortRobot, np.ndarray, teacher.Minima]:
    """A robot, targets of it, and the local minima that the teacher finds."""
    rng = np.random.default_rng(6)
    layout = random_fin_robot(rng, random_fin_kinds(rng, 2), 6)
    robot = effort_robot(Plant(layout), WRENCH_SCALE)
    target = teacher.random_targets(rng, robot, 12)
    return robot, target, teacher.local_minima(rng, robot.forces, target)


@pytest.fixture(scope="module")
def effort() -> tuple[EffortRobot, np.ndarray, teacher.Minima]:
    return robot_targets_and_minima()


def test_ways_deliver_the_target_at_the_cost_that_is_told(
    effort: tuple[EffortRobot, np.ndarray, teacher.Minima],
) -> None:
    robot, target, ways = effort
    known = np.isfinite(ways.cost)
    assert known[:, 0].mean() > 0.8
    for row, k in np.argwhere(known):
        force = ways.force[row, k]
        assert np.linalg.norm(wrench(robot.forces, force[None])[0] - target[row]) < 0.05
        _, cost = realize(robot.forces, robot.forces.fins.project(force[None]))
        assert cost[0] == pytest.approx(ways.cost[row, k], rel=0.02)


def test_ways_differ_and_the_cheapest_comes_first(
    effort: tuple[EffortRobot, np.ndarray, teacher.Minima],
) -> None:
    robot, _, ways = effort
    root = teacher.root_share(ways.force, robot.forces.fins.maximum)
    assert np.isfinite(ways.cost[:, 1]).any()
    for row, cost in enumerate(ways.cost):
        found = np.flatnonzero(np.isfinite(cost))
        if not len(found):
            continue
        assert (np.diff(cost[found]) >= 0).all() and cost[
            found[-1]
        ] <= teacher.COST_RATIO_MAX * cost[0]
        for k in found[1:]:
            assert np.abs(root[row, k] - root[row, :k]).mean(-1).min() >= teacher.DISTINCT


def test_weights_fall_with_the_cost() -> None:
    cost = np.array([[1.0, 1.03, 1.06, np.inf], [2.0, np.inf, np.inf, np.inf], [np.inf] * 4])
    weight = teacher.minimum_weights(teacher.Minima(np.zeros((3, 4, 1), complex), cost), 0.03)
    np.testing.assert_allclose(weight[0, 1] / weight[0, 0], np.exp(-1.0))
    np.testing.assert_allclose(weight[0, 2] / weight[0, 0], np.exp(-2.0))
    np.testing.assert_allclose(weight.sum(1), [1.0, 1.0, 0.0])


def test_roots_of_shares_keep_the_direction() -> None:
    root = teacher.root_share(np.array([4j, -1.0, 0.0]), np.array([16.0, 1.0, 2.0]))
    np.testing.assert_allclose(root, [0.5j, -1.0, 0.0], atol=1e-5)


@pytest.fixture(scope="module")
def robots() -> list[Layout]:
    """Sixty robots as training draws them."""
    rng = np.random.default_rng(1)
    kinds = random_fin_kinds(rng, 3)
    return [random_fin_robot(rng, kinds, int(rng.choice(list(FIN_COUNTS)))) for _ in range(60)]


def test_robots_are_of_all_kinds(robots: list[Layout]) -> None:
    assert {robot.n_fins for robot in robots} == set(range(2, 13))
    one_kind = [len({(fin.model, fin.limits) for fin in robot.fins}) == 1 for robot in robots]
    assert any(one_kind) and not all(one_kind)
    fins = chain.from_iterable(robot.fins for robot in robots)
    assert {fin.model.type for fin in fins} == set(WIDE)
    # Some robots have a fin whose mirror image, or whose twin above it, is a fin as well.
    symmetric = 0
    for robot in robots:
        place = robot.position
        for mirror in ([1, -1, 1], [1, 1, -1]):
            twins = np.abs(place[:, None] - place * mirror).max(-1) < 1e-9
            symmetric += bool(
                (twins.any(1) & (np.abs(place * mirror - place).max(-1) > 1e-9)).any()
            )
    assert symmetric >= 5


def test_targets_are_within_reach_of_fins_that_turn_fully(robots: list[Layout]) -> None:
    rng = np.random.default_rng(2)
    for layout in robots[:12]:
        robot = effort_robot(Plant(layout), wrench_scale_of(layout))
        target = teacher.random_targets(rng, robot, 24)
        assert target.shape == (24, 6) and np.isfinite(target).all()
        if not robot.forces.fins.turns_fully:
            continue
        ways = teacher.local_minima(rng, robot.forces, target[:18])  # the last quarter are axes
        assert np.isfinite(ways.cost[:, 0]).mean() > 0.8
