"""What policies give beyond reach, beside linear and quadratic programs over the actuators'
forces."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

from finlab.allocation import Policy
from finlab.allocation.dual.compiled import core_policy
from finlab.arrays import Array
from finlab.layout.load import parse_layout
from tests.core.internal_functions import Robot, in_the_core, robot_of
from tests.core.test_actuator_response import forces_of
from tests.random_robots import random_robot

NUMBERS = range(4)
"""Of each kind of robot."""


@cache
def convex_robot(name: str, number: int) -> Robot:
    """A robot without dead bands, whose sets of forces are convex."""
    return in_the_core(parse_layout(random_robot(name, number, 71)))


def targets(robot: Robot, number: int) -> Array:
    """Wrenches (3, 6) a few times as large as those of random commands."""
    rng = np.random.default_rng([6, number])
    return np.asarray(4.0 * robot.plant.wrench(robot.plant.sample(rng, (3,))))


def served(robot: Robot, wrench: Array, policy: str) -> Array:
    """Wrench (6,) that a policy serves."""
    record = core_policy(Policy(policy))
    return np.asarray(robot.answer(wrench, policy=record.ctypes.data)["wrench_served"])


def scaled_effectiveness(robot: Robot) -> Array:
    """Scaled wrench in the basis (n, 2, 6) of a newton along each row."""
    return np.asarray(robot.actuators["effectiveness_reduced"])


def largest_share(robot: Robot, wrench: Array) -> float:
    """The largest share of a wrench (6,), at most 1, that mixtures of sampled forces give."""
    B = scaled_effectiveness(robot)
    target = robot.head["basis"].T @ (wrench / robot.head["axis_scale"])
    columns = []
    actuator = []
    for i in range(robot.n):
        force, _ = forces_of(robot, i, robot.whole_set(i))
        if not robot.is_plane(i):
            force = force[[0, -1]] * [1.0, 0.0]
        else:
            size = np.hypot(*force.T)
            force = np.vstack([force[size >= size.max() * (1.0 - 1e-9)], np.zeros((1, 2))])
        columns.append(force @ B[i])
        actuator += [i] * len(force)
    wrenches = np.concatenate(columns)
    weights_of_one = (np.array(actuator) == np.arange(robot.n)[:, None]).astype(float)
    rank = int(robot.head["rank"])
    met = np.column_stack([wrenches.T[:rank], -target[:rank]])
    sums = np.column_stack([weights_of_one, np.zeros(robot.n)])
    optimum = linprog(
        np.append(np.zeros(len(wrenches)), -1.0),
        A_eq=np.vstack([met, sums]),
        b_eq=np.append(np.zeros(rank), np.ones(robot.n)),
        bounds=[(0.0, 1.0)] * (len(wrenches) + 1),
    )
    assert optimum.success
    return float(optimum.x[-1])


@pytest.mark.parametrize("name", ["thrusters", "azimuths"])
@pytest.mark.parametrize("number", NUMBERS)
def test_direction_serves_the_largest_share_of_a_wrench(name: str, number: int) -> None:
    robot = convex_robot(name, number)
    for wrench in targets(robot, number):
        wrench_served = served(robot, wrench, "direction")
        share = float(wrench_served @ wrench / (wrench @ wrench))
        size = np.linalg.norm(wrench)
        np.testing.assert_allclose(wrench_served, share * wrench, atol=1e-6 * size)
        largest = largest_share(robot, wrench)
        # Samples of a disc lie within it, and leave out a little.
        assert largest - 1e-6 <= share <= largest * (1.0 + 2e-3) + 1e-6


@pytest.mark.parametrize("number", NUMBERS)
def test_closest_serves_the_nearest_wrench_of_bounded_forces(number: int) -> None:
    robot = convex_robot("thrusters", number)
    actuators = robot.actuators
    scale = robot.head["wrench_scale"]
    B = (scaled_effectiveness(robot)[:, 0] @ robot.head["basis"].T) * robot.head["axis_scale"]
    for wrench in targets(robot, number):
        wrench_served = served(robot, wrench, "closest")
        bounds = (actuators["force_min"], actuators["force_max"])
        nearest = lsq_linear((B / scale).T, wrench / scale, bounds, tol=1e-12)
        least = np.linalg.norm((B / scale).T @ nearest.x - wrench / scale)
        error = np.linalg.norm((wrench_served - wrench) / scale)
        assert error == pytest.approx(least, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("number", NUMBERS)
def test_priority_serves_the_first_group_with_the_least_error(number: int) -> None:
    robot = convex_robot("thrusters", number)
    actuators = robot.actuators
    scale = robot.head["wrench_scale"]
    B = (scaled_effectiveness(robot)[:, 0] @ robot.head["basis"].T) * robot.head["axis_scale"]
    first = np.array(Policy("priority").groups)[0].astype(bool)
    bounds = (actuators["force_min"], actuators["force_max"])
    for wrench in targets(robot, number):
        wrench_served = served(robot, wrench, "priority")
        by_force = (B / scale)[:, first].T
        target = (wrench / scale)[first]
        nearest = lsq_linear(by_force, target, bounds, tol=1e-12)
        least = np.linalg.norm(by_force @ nearest.x - target)
        error = np.linalg.norm(((wrench_served - wrench) / scale)[first])
        assert error == pytest.approx(least, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize(("name", "robots"), [("rudders", 6), ("all", 2)])
def test_direction_leaves_no_share_of_a_wrench_where_foils_drag(name: str, robots: int) -> None:
    """By the answers of the core itself: a hundredth more of the wrench is not attainable."""
    asked = 0
    for number in range(robots):
        robot = robot_of(name, number)
        scale = robot.head["wrench_scale"]
        for wrench in targets(robot, number):
            given = served(robot, wrench, "direction")
            ray = wrench / scale
            share = float(given / scale @ ray / (ray @ ray))
            if share > 0.999:
                continue
            assert np.linalg.norm((given - share * wrench) / scale) <= 1e-4
            assert not robot.answer(1.01 * share * wrench)["is_attainable"]
            asked += 1
    assert asked > 2 * robots
