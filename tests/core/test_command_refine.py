"""Levenberg-Marquardt steps on commands in the core: near to commands that give a wrench they come
to others that do, as fast as Newton's method, and within limits."""

import ctypes

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.layout.load import parse_layout
from tests.core.internal_functions import (
    EITHER_WAY,
    MOST,
    Robot,
    at,
    functions,
    in_the_core,
    robot_of,
)
from tests.random_robots import random_flow, random_robot

# Their commands have no dead bands, and none of their foils stalls.
SMOOTH = ("azimuths", "fins", "fins any shaft", "fins uneven", "wide arcs", "holes")
EXACT = 1.1e-8
"""Error over the wrench scale that needs no further step, and a little."""


def wrench_of(robot: Robot, command: Array) -> Array:
    """The wrench (6,) of commands (n, 3) by the core's own laws."""
    force = np.stack([robot.force(i, np.ascontiguousarray(command[i]))[0] for i in range(robot.n)])
    force_wrench = np.einsum("na,nak->k", force, robot.actuators["effectiveness_normalized"])
    return np.asarray(force_wrench * robot.head["wrench_scale"] + robot.head["wrench_offset"])


def refined(robot: Robot, wrench: Array, start: Array, steps: int) -> tuple[float, Array]:
    """The error that so many steps leave, and the commands (n, 3)."""
    box = robot.whole_box()
    command = np.zeros((MOST, 3))
    command[: robot.n] = start
    places = robot.work(), ctypes.byref(box), at(wrench), at(command)
    error = functions().fl_refine_commands(at(robot.block), *places, steps)
    return float(error), command[: robot.n]


@pytest.mark.parametrize("name", SMOOTH)
def test_near_commands_that_give_a_wrench_a_few_steps_come_to_some(name: str) -> None:
    left = list[list[float]]()
    for number in range(3):
        robot = robot_of(name, number)
        rng = np.random.default_rng([8, number])
        lower = robot.actuators["command_min"]
        upper = robot.actuators["command_max"]
        width = upper - lower
        for _ in range(8):
            delivering = lower + (0.2 + 0.6 * rng.random((robot.n, 3))) * width
            wrench = wrench_of(robot, delivering)
            start = np.clip(
                delivering + 0.02 * rng.normal(size=delivering.shape) * width, lower, upper
            )
            errors = list[float]()
            for steps in (0, 1, 2, 3, 6):
                error, command = refined(robot, wrench, start, steps)
                errors.append(error)
                missing = (wrench_of(robot, command) - wrench) / robot.head["wrench_scale"]
                assert np.linalg.norm(missing) == pytest.approx(error, rel=1e-6, abs=1e-12)
                assert (command >= lower).all() and (command <= upper).all()
            assert errors == sorted(errors, reverse=True)
            left.append(errors)
    begun, first, second, third, last = np.array(left).T
    assert (
        np.median(first / begun) < 0.2
        and np.median(second / begun) < 2e-3
        and np.median(third) < 1e-6
    )
    assert np.mean(last <= EXACT) >= 0.9  # pods whose wrenches nearly depend take more


@pytest.mark.parametrize("name", ["azimuths", "fins", EITHER_WAY])
def test_commands_at_their_limits_are_held_where_steps_would_leave(name: str) -> None:
    """A wrench that is given with some commands at their limits is found from commands at these
    limits."""
    errors = list[float]()
    for number in range(3):
        robot = robot_of(name, number)
        rng = np.random.default_rng([9, number])
        lower = robot.actuators["command_min"]
        upper = robot.actuators["command_max"]
        width = upper - lower
        for _ in range(6):
            share = 0.25 + 0.5 * rng.random((robot.n, 3))
            at_limit = rng.random(share.shape) < 0.25
            share[at_limit] = np.round(share[at_limit])
            wrench = wrench_of(robot, lower + share * width)
            near = np.where(
                at_limit, share, np.clip(share + 0.01 * rng.normal(size=share.shape), 0.0, 1.0)
            )
            error, command = refined(robot, wrench, np.minimum(lower + near * width, upper), 12)
            assert (command >= lower).all() and (command <= upper).all()
            errors.append(error)
    assert np.median(errors) <= EXACT


@pytest.mark.parametrize("number", range(3))
def test_of_thrusters_a_step_is_exact_and_of_foils_nearly(number: int) -> None:
    """Their forces are linear in the commands, but for the drag and the curve of lift of foils."""
    for name, rest in (("thrusters", 1e-3), ("rudders", 0.05)):
        layout = parse_layout(random_robot(name, number, 71))
        robot = in_the_core(layout, random_flow(name, number, 71))
        rng = np.random.default_rng([10, number])
        width = robot.plant.width
        for _ in range(6):
            known = robot.plant.lower + (0.3 + 0.4 * rng.random(width.shape)) * width
            start = known + 0.01 * rng.uniform(-1.0, 1.0, width.shape) * width
            wrench = wrench_of(robot, known)
            begun, _ = refined(robot, wrench, start, 0)
            left, _ = refined(robot, wrench, start, 1)
            assert left <= rest * begun
