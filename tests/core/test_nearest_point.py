"""Points of the attainable set near to a wrench beyond reach, and along rays: beside those that
scipy finds in the box of thrusters' forces, and by what holds of the nearest point of any convex
set."""

import ctypes
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

from finlab.arrays import Array
from tests.core.internal_functions import POINTS, REAL, Mixture, Robot, at, functions, robot_of
from tests.core.test_actuator_response import forces_of

CLOSE = 1e-9
"""Distance in weighted axes, over the wrench scale, up to which a point is the nearest one."""


def columns_of(robot: Robot, weight: Array) -> Array:
    """Wrenches (n, 2, 6) in weighted axes, over the wrench scale, per newton along the rows of each
    actuator."""
    head = robot.head
    scaled_wrench = robot.actuators["effectiveness_reduced"] @ head["basis"].T
    return np.asarray(weight * scaled_wrench * head["axis_scale"] / head["wrench_scale"])


def columns_of_thrusters(robot: Robot, weight: Array) -> Array:
    """The same (6, n) of a robot of thrusters, each with one row."""
    return columns_of(robot, weight)[:, 0].T


def weighed(robot: Robot, weight: Array) -> Any:
    """A work area of a robot whose axes have weights (6,)."""
    work = robot.work()
    functions().fl_weigh_axes(at(robot.block), work, at(weight))
    return work


def nearest(robot: Robot, work: Any, target: Array, mixture: Mixture) -> float:
    """Makes a mixture the point nearest to a target (6,), and returns the distance."""
    miss = functions().fl_nearest_point(
        at(robot.block), work, at(target), REAL(CLOSE), REAL(0.0), ctypes.byref(mixture)
    )
    return float(miss)


def point_of(mixture: Mixture) -> Array:
    """The point (6,) of a mixture: its points by their shares."""
    share = np.array(mixture.weight)[: mixture.count]
    return np.asarray(share @ np.array(mixture.point)[: mixture.count])


def mixed_forces(robot: Robot, mixture: Mixture) -> Array:
    """The forces (n, 2) [N] of a mixture."""
    force = np.zeros((robot.n, 2))
    functions().fl_mixed_forces(at(robot.block), ctypes.byref(mixture), at(force))
    return force


def targets_of(robot: Robot, weight: Array, rng: np.random.Generator) -> Array:
    """Targets (10, 6) in weighted axes, over the wrench scale, most of them beyond reach."""
    size = 10.0 ** rng.uniform(-0.5, 1.0, (10, 1))
    return np.asarray(size * weight * rng.normal(size=(10, 6)))


@pytest.mark.parametrize("number", range(3))
def test_the_point_nearest_to_a_wrench_is_that_of_a_bounded_least_squares_problem(
    number: int,
) -> None:
    rng = np.random.default_rng(number)
    robot = robot_of("thrusters", number)
    bounds = (robot.actuators["force_min"], robot.actuators["force_max"])
    beyond = 0
    for weight in (np.ones(6), 10.0 ** rng.uniform(-1.0, 0.0, 6)):
        work = weighed(robot, weight)
        columns = columns_of_thrusters(robot, weight)
        for target in targets_of(robot, weight, rng):
            mixture = Mixture()
            miss = nearest(robot, work, target, mixture)
            solution = lsq_linear(columns, target, bounds, method="bvls", tol=1e-14)
            least_miss = np.linalg.norm(columns @ solution.x - target)
            assert miss == pytest.approx(least_miss, rel=1e-6, abs=1e-6)
            # The nearest point of a convex set is unique, its forces need not be.
            np.testing.assert_allclose(point_of(mixture), columns @ solution.x, atol=1e-5)
            force = mixed_forces(robot, mixture)[:, 0]
            np.testing.assert_allclose(columns @ force, point_of(mixture), atol=1e-9)
            beyond += miss > 1e-3
    assert beyond > 5


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "wide arcs", "holes", "fins", "all"])
def test_no_force_lies_farther_along_the_miss_than_the_nearest_point(name: str) -> None:
    """That is what makes it the nearest one; and it is a mixture of points of the set."""
    rng = np.random.default_rng(7)
    robot = robot_of(name, 1)
    weight = 10.0 ** rng.uniform(-1.0, 0.0, 6)
    work = weighed(robot, weight)
    known = [forces_of(robot, i, robot.whole_set(i))[0] for i in range(robot.n)]
    columns = columns_of(robot, weight)
    for target in targets_of(robot, weight, rng)[:5]:
        mixture = Mixture()
        miss = nearest(robot, work, target, mixture)
        share = np.array(mixture.weight)[: mixture.count]
        assert share.sum() == pytest.approx(1.0, abs=1e-12) and (share >= 0.0).all()
        assert mixture.count <= POINTS
        way = target - point_of(mixture)
        assert np.linalg.norm(way) == pytest.approx(miss, abs=1e-12)
        np.testing.assert_allclose(np.array(mixture.miss), way, atol=1e-12)
        farthest = 0.0
        for i, force in enumerate(known):
            farthest += (force @ (columns[i] @ way)).max()
        # Forces are sampled densely, not all: they fall short by a share of what they give.
        scale = np.linalg.norm(way) * max(np.linalg.norm(point_of(mixture)), 1.0)
        assert farthest <= point_of(mixture) @ way + 1e-6 * scale
        assert farthest >= point_of(mixture) @ way - 1e-3 * scale


def test_a_search_that_begins_at_a_mixture_comes_to_the_same_point() -> None:
    rng = np.random.default_rng(11)
    robot = robot_of("azimuths", 1)
    work = weighed(robot, np.ones(6))
    warm = Mixture()
    for target in targets_of(robot, np.ones(6), rng):
        cold = Mixture()
        miss = nearest(robot, work, target, cold)
        assert nearest(robot, work, target, warm) == pytest.approx(miss, rel=1e-6, abs=1e-6)
        np.testing.assert_allclose(point_of(warm), point_of(cold), atol=1e-4)


@pytest.mark.parametrize("number", range(3))
def test_the_farthest_point_along_a_ray_is_that_of_a_linear_program(number: int) -> None:
    """Of rays that begin within the set and of those that miss it."""
    rng = np.random.default_rng(20 + number)
    robot = robot_of("thrusters", number)
    low = robot.actuators["force_min"]
    high = robot.actuators["force_max"]
    work = weighed(robot, np.ones(6))
    columns = columns_of_thrusters(robot, np.ones(6))
    for _ in range(8):
        begin = columns @ (low + rng.uniform(0.3, 0.7, robot.n) * (high - low))
        ray = columns @ (rng.normal(size=robot.n) * (high - low))
        mixture = Mixture()
        plane = np.zeros(6)
        limits = (REAL(0.0), REAL(1e3), REAL(CLOSE))
        size = functions().fl_farthest_along_ray(
            at(robot.block), work, at(begin), at(ray), *limits, ctypes.byref(mixture), at(plane)
        )
        program = linprog(
            np.append(np.zeros(robot.n), -1.0),
            A_eq=np.column_stack([columns, -ray]),
            b_eq=begin,
            bounds=[*zip(low, high, strict=True), (0.0, None)],
        )
        assert size == pytest.approx(-program.fun, rel=1e-6, abs=1e-7)
        np.testing.assert_allclose(point_of(mixture), begin + size * ray, atol=1e-6)
        # The plane that proves it: nothing of the set lies beyond, and the end lies on it.
        support = np.maximum(plane @ columns * low, plane @ columns * high).sum()
        assert plane @ (begin + size * ray) == pytest.approx(support, abs=1e-9)
