"""Robots with rudders that move: exact with the drag, and cheapest with its price."""

import numpy as np

import finlab
from finlab.layout.layout import Layout
from finlab.layout.rudder import Rudder
from finlab.physics.plant import Plant
from tests.mixed_robots import load, random_flow, random_plant, random_robot, within


def test_answers_of_robots_with_rudders_are_exact_and_above_a_bound_that_is_met() -> None:
    gaps = []
    for number in (0, 2, 5):
        robot = load(random_robot("rudders", number, 7))
        flow, own = random_flow("rudders", number, 7), random_plant("rudders", number, 7)
        allocator = finlab.Allocator(robot)
        rng = np.random.default_rng(number)
        for _ in range(4):
            wrench = within(own, rng)
            answer = allocator.allocate(wrench, flow=flow)
            assert answer.err_norm <= 1e-6
            np.testing.assert_allclose(Plant(robot).wrench(answer.command, flow=flow), wrench, atol=1e-4)
            assert answer.bound is not None
            gaps.append(1.0 - answer.bound / answer.power)
    assert min(gaps) > -1e-5
    assert np.median(gaps) < 1e-3


def test_rudders_alone_give_nothing_at_rest_and_something_in_a_flow() -> None:
    rudder = Rudder("r", (-0.5, 0, 0), (0, 0, 1), (1, 0, 0), 0.01, (-0.3, 0.3), 2.0, lift_slope=3.0)
    allocator = finlab.Allocator(Layout("rudder", (rudder,)))
    rest = allocator.allocate([0, 1, 0, 0, 0, -0.5])
    assert not rest.wrench.any() and rest.power == 0.0
    moving = allocator.allocate([0, 1, 0, 0, 0, -0.5], flow=[1.5, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(moving.wrench[[1, 5]], [1, -0.5], rtol=0.05)


def test_rudders_at_rest_turn_back_no_faster_than_their_drives() -> None:
    rudder = Rudder("r", (-0.5, 0, 0), (0, 0, 1), (1, 0, 0), 0.01, (-0.3, 0.3), 2.0, lift_slope=3.0, rate=0.5)
    result = finlab.Allocator(Layout("rudder", (rudder,))).allocate(
        [0, 1, 0, 0, 0, -0.5], previous=[[0.3, 0.0, 0.0]]
    )
    assert 0.25 - 1e-12 <= result.command[0, 0] <= 0.3


def test_many_wrenches_at_once_are_answered_as_one_by_one() -> None:
    robot = load(random_robot("rudders", 1, 7))
    flow, own = random_flow("rudders", 1, 7), random_plant("rudders", 1, 7)
    rng = np.random.default_rng(0)
    wrenches = np.array([within(own, rng) for _ in range(3)])
    allocator = finlab.Allocator(robot)
    together = allocator.allocate_batch(wrenches, flow=flow)
    alone = [allocator.allocate(wrench, flow=flow).power for wrench in wrenches]
    np.testing.assert_allclose(together.power, alone, rtol=1e-9)
