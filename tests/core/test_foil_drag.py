"""Power of robots whose foils stall, beside what SciPy's SLSQP finds on the commands."""

import ctypes
from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.layout import Azimuth, Layout, Thruster
from finlab.layout.load import parse_layout
from tests.core.internal_functions import REAL, Robot, Work, at, functions, in_the_core, question_of
from tests.random_robots import random_flow, random_robot
from tests.sampled_cases import sampled

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


@pytest.mark.parametrize("number", sampled(range(6), every=3))
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


def random_position(rng: np.random.Generator) -> tuple[float, float, float]:
    """Where an actuator stands [m]."""
    x, y, z = rng.uniform(-0.6, 0.6, 3).tolist()
    return x, y, z


@cache
def pods_and_rudders(number: int) -> Robot:
    """Pods that turn all round, a thruster with a dead band, and rudders that stall, in a flow."""
    rng = np.random.default_rng([9, number])

    law = PowerLaw(0.3)
    pods = [
        Azimuth(
            f"p{k}",
            random_position(rng),
            (0.0, 0.6 * (-1.0) ** k, 0.8),
            (1.0, 0.0, 0.0),
            (0.0, 30.0),
            law,
        )
        for k in range(2)
    ]
    heave = Thruster("t", random_position(rng), (0.0, 0.0, 1.0), (-30.0, 30.0), law, dead_band=3.0)
    axes = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.8, 0.6))
    rudders = [
        Rudder(f"r{k}", random_position(rng), axis, (1.0, 0.0, 0.0), 0.04, (-0.9, 0.7), 3.0)
        for k, axis in enumerate(axes)
    ]
    flow = np.array([1.5, 0.2, -0.1, 0.0, 0.0, 0.0])
    return in_the_core(Layout("both", (*pods, heave, *rudders)), flow)


@pytest.mark.parametrize("number", range(4))
def test_robots_of_foils_and_pods_take_no_more_than_slsqp_finds(number: int) -> None:
    robot = pods_and_rudders(number)
    rng = np.random.default_rng([6, number])
    for _ in range(2):
        command = robot.plant.sample(rng, (1,))[0]
        command[2, 0] = np.copysign(3.0 + abs(command[2, 0]) * 0.5, command[2, 0])
        wrench = robot.plant.wrench(command)
        answer = robot.answer(wrench)
        found = np.ascontiguousarray(answer["command"][: robot.n])
        given = robot.plant.wrench(found)
        assert np.linalg.norm((given - wrench) / robot.head["wrench_scale"]) <= 3e-5
        starts = [found, command, *robot.plant.sample(rng, (3,))]
        known = float(robot.plant.power(command).sum())
        least = min(known, least_power(robot, wrench, starts))
        assert robot.plant.power(found).sum() <= least * (1.0 + SLACK)


def ended_steps(robot: Robot, wrench: Array) -> Array | None:
    """The commands (n, 3) to which the steps of `fl_improve_commands` come from the forces of the
    dual alone, without the other starts of an answer; None where they do not give a wrench (6,)."""
    question, _kept = question_of(wrench, {})
    memory = robot.work()
    block = at(robot.block)
    address = ctypes.c_void_p(question.ctypes.data)
    assert functions().fl_prepare_question(block, memory, address) == 1
    work = Work.from_buffer(memory)
    work.wrench_wanted[:] = wrench.tolist()
    of_forces = wrench - np.array(work.span.wrench_offset)
    target_reduced = np.zeros(6)
    functions().fl_reduce_wrench(memory, at(of_forces), at(target_reduced))
    functions().fl_dual_newton(block, memory, at(target_reduced), None, 120)
    cost = REAL(1e30)
    functions().fl_improve_commands(block, memory, at(target_reduced), ctypes.byref(cost))
    if cost.value >= 1e30:
        return None
    command = np.array([list(row) for row in work.best_command[: robot.n]])
    assert cost.value == pytest.approx(float(robot.plant.power(command).sum()), rel=1e-3)
    return command


def test_steps_on_commands_end_where_no_step_of_slsqp_is_cheaper() -> None:
    """From the forces of the dual alone: other starts would hide a step that goes astray."""
    gains = []
    for number in range(6):
        robot = pods_and_rudders(number)
        rng = np.random.default_rng([8, number])
        for command_of_wrench in robot.plant.sample(rng, (12,)):
            wrench = robot.plant.wrench(command_of_wrench)
            command = ended_steps(robot, wrench)
            if command is None:
                continue
            given = robot.plant.wrench(command)
            assert np.linalg.norm((given - wrench) / robot.head["wrench_scale"]) <= 3e-5
            power = float(robot.plant.power(command).sum())
            gains.append(1.0 - least_power(robot, wrench, [command]) / power)
    assert len(gains) > 30
    # A least power nearby is not the least of all: seldom SLSQP leaves its valley for a lower one.
    assert np.mean(np.array(gains) > SLACK) <= 0.1


@cache
def many_rudders(number: int) -> Robot:
    """Nine rudders that stall, more than the lattice of starts has room for, and a thruster."""
    rng = np.random.default_rng([10, number])

    rudders = []
    for k in range(9):
        _, y, z = rng.normal(size=3)
        length = float(np.hypot(y, z))
        axis = (0.0, y / length, z / length)
        rudders.append(
            Rudder(f"r{k}", random_position(rng), axis, (1.0, 0.0, 0.0), 0.02, (-0.9, 0.7), 3.0)
        )
    surge = Thruster("t", random_position(rng), (1.0, 0.0, 0.0), (-60.0, 60.0), PowerLaw(0.3))
    flow = np.array([1.5, 0.2, -0.1, 0.0, 0.0, 0.0])
    return in_the_core(Layout("many", (surge, *rudders)), flow)


def test_wrenches_that_need_stalled_foils_are_mostly_met_and_at_no_more_power() -> None:
    """Of robots with many foils, most of which stood at an end of their angles."""
    met = 0
    asked = 0
    for number in range(6):
        robot = many_rudders(number)
        rng = np.random.default_rng([11, number])
        for _ in range(4):
            share = rng.random(robot.plant.lower.shape)
            at_an_end = rng.random(share.shape) < 0.6
            share = np.where(at_an_end, np.round(share), share)
            command = robot.plant.lower + share * robot.plant.width
            wrench = robot.plant.wrench(command)
            answer = robot.answer(wrench)
            asked += 1
            if not answer["is_attainable"]:
                continue
            met += 1
            found = np.ascontiguousarray(answer["command"][: robot.n])
            known = robot.plant.power(command).sum()
            assert robot.plant.power(found).sum() <= 1.1 * known
    assert met >= 0.7 * asked
