"""Power of robots whose foils stall, beside what SciPy's SLSQP finds on the commands."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.arrays import Array
from finlab.layout.load import parse_layout
from tests.core.internal_functions import Robot, in_the_core
from tests.random_robots import random_flow, random_robot

STARTS = 20
"""Random commands at which SLSQP begins."""
SLACK = 1e-3
"""Share of the least power found by which the core may take more."""
MISS = 1e-6
"""Scaled wrench by which commands may miss the target."""


@cache
def stalling_robot(number: int) -> Robot:
    """A robot whose rudders turn far beyond stall, in a flow."""
    mapping = random_robot("rudders", number, 71)
    for one in mapping["actuators"]:
        if one["type"] == "rudder":
            one["deflection_deg"] = [-50.0, 40.0]
    return in_the_core(parse_layout(mapping), random_flow("rudders", number, 71))


def least_power(robot: Robot, wrench: Array, starts: list[Array]) -> float:
    """The least power [W] that SLSQP finds for a wrench (6,) from commands (n, 3)."""
    plant = robot.plant
    scale = robot.head["wrench_scale"]
    used = plant.width > 0.0

    def command_of(share: Array) -> Array:
        command = plant.lower.copy()
        command[used] += share * plant.width[used]
        return command

    def power(share: Array) -> tuple[float, Array]:
        command = command_of(share)
        gradient = plant.power_gradient(command)[used] * plant.width[used]
        return float(plant.power(command).sum()), gradient

    def miss(share: Array) -> Array:
        return np.asarray((plant.wrench(command_of(share)) - wrench) / scale)

    def slope(share: Array) -> Array:
        _, jacobian = plant.linearize(command_of(share))
        by_command = jacobian.reshape(6, *plant.width.shape)[:, used]
        return np.asarray(by_command * plant.width[used] / scale[:, None])

    least = np.inf
    for start in starts:
        share = (start[used] - plant.lower[used]) / plant.width[used]
        optimum = minimize(
            power,
            share,
            jac=True,
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(share),
            constraints={"type": "eq", "fun": miss, "jac": slope},
            options={"maxiter": 60, "ftol": 1e-8},
        )
        within = np.clip(optimum.x, 0.0, 1.0)
        if np.linalg.norm(miss(within)) <= MISS:
            least = min(least, power(within)[0])
    return least


@pytest.mark.parametrize("number", range(6))
def test_robots_with_stalled_foils_take_no_more_than_slsqp_finds(number: int) -> None:
    robot = stalling_robot(number)
    rng = np.random.default_rng([5, number])
    command = robot.plant.sample(rng, (1,))[0]
    wrench = robot.plant.wrench(command)
    answer = robot.answer(wrench)
    found = np.ascontiguousarray(answer["command"][: robot.n])
    wrench_of_command = robot.plant.wrench(found)
    assert np.linalg.norm((wrench_of_command - wrench) / robot.head["wrench_scale"]) <= 3e-5
    starts = [found, command, *robot.plant.sample(rng, (STARTS,))]
    least = least_power(robot, wrench, starts)
    assert np.isfinite(least)
    assert robot.plant.power(found).sum() <= least * (1.0 + SLACK)
