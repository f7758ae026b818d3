"""Newton's method on the dual: its gradient is that of its value, and it takes few steps, whatever
the robot, beyond reach and from tick to tick."""

import ctypes
from typing import Any, NamedTuple

import numpy as np
import pytest

from finlab.allocation import Policy
from finlab.allocation.dual.compiled import core_policy
from finlab.arrays import Array
from tests.core.internal_functions import (
    ROBOTS,
    Robot,
    Set,
    Work,
    at,
    dual_function,
    functions,
    question_of,
    robot_of,
)
from tests.core.test_feasible_set import commands_before

ROBOT_NUMBERS = range(2)
"""Numbers of the random robots of each kind."""


class NewtonSteps(NamedTuple):
    """Steps of Newton's method that all questions of one kind of robot take together."""

    within_reach: int
    """Eight wrenches that commands give."""
    beyond_reach: int
    """Four wrenches three times as large, by each policy."""
    in_ticks: int
    """Eight wrenches in ticks that follow on each other."""


MOST_STEPS = {
    "thrusters": NewtonSteps(119, 718, 80),
    "azimuths": NewtonSteps(82, 543, 34),
    "fins": NewtonSteps(99, 888, 145),
    "fins any shaft": NewtonSteps(67, 938, 22),
    "fins uneven": NewtonSteps(80, 1015, 29),
    "wide arcs": NewtonSteps(257, 1853, 68),
    "holes": NewtonSteps(507, 2549, 37),
    "rudders": NewtonSteps(765, 2775, 351),
    "mixed": NewtonSteps(132, 2118, 77),
    "all": NewtonSteps(123, 1532, 117),
    "pods either way": NewtonSteps(464, 3713, 332),
    "slipstreams": NewtonSteps(1324, 4125, 1135),
}
"""Most steps of each kind of robot: the sum that `newton_steps` counted over its two robots, and a
tenth more. Robots and wrenches come from seeds, so that the sum changes with the code alone, or by
a step or two with the rounding of another compiler.

More steps than that are a slower answer, and mostly a fault: a derivative of a response that is
slightly wrong gives the same forces, and shows in nothing but steps that are refused. Who needs the
steps for a better answer counts them anew."""


def wrenches(robot: Robot, number: int, times: float, count: int) -> Array:
    """Wrenches (count, 6) of random commands, some times as large."""
    rng = np.random.default_rng([7, number])
    return np.asarray(times * robot.plant.wrench(robot.plant.sample(rng, (count,))))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_gradient_of_the_dual_is_what_is_left_of_the_wrench(name: str) -> None:
    for number in ROBOT_NUMBERS:
        robot = robot_of(name, number)
        rng = np.random.default_rng([3, number])
        rank = int(robot.head["rank"])
        for wrench in wrenches(robot, number, 1.0, 4):
            answer = robot.answer(wrench)
            lambda_reduced: Array = answer["lambda_reduced"].copy()
            size = np.abs(lambda_reduced).max()
            lambda_reduced[:rank] += 0.3 * size * rng.normal(size=rank)
            force, _ = dual_function(robot.block, wrench, lambda_reduced)
            target = robot.head["basis"].T @ (wrench / robot.head["axis_scale"])
            residual = target - np.einsum(
                "nr,nrj->j", force, robot.actuators["effectiveness_reduced"]
            )
            for j in range(rank):
                step = 1e-5 * size
                change = step * np.eye(6)[j]
                _, value_above = dual_function(robot.block, wrench, lambda_reduced + change)
                _, value_below = dual_function(robot.block, wrench, lambda_reduced - change)
                slope = (value_above - value_below) / (2.0 * step)
                assert slope == pytest.approx(residual[j], abs=2e-3 * np.linalg.norm(target))


def newton_steps(name: str) -> NewtonSteps:
    """Steps that all robots of a kind take."""
    within_reach = 0
    beyond_reach = 0
    in_ticks = 0
    for number in ROBOT_NUMBERS:
        robot = robot_of(name, number)
        for wrench in wrenches(robot, number, 1.0, 8):
            within_reach += int(robot.answer(wrench)["newton_steps"])
        for kind in ("closest", "direction", "priority"):
            record = core_policy(Policy(kind))
            for wrench in wrenches(robot, number, 3.0, 4):
                answer = robot.answer(wrench, policy=record.ctypes.data)
                beyond_reach += int(answer["newton_steps"])
        fields_of_tick: dict[str, Any] = {}
        for wrench in wrenches(robot, number, 1.0, 8):
            answer = robot.answer(wrench, **fields_of_tick)
            in_ticks += int(answer["newton_steps"])
            fields_of_tick = {"previous": answer["command"][: robot.n].copy(), "calm": 2.0}
    return NewtonSteps(within_reach, beyond_reach, in_ticks)


@pytest.mark.parametrize("name", ROBOTS)
def test_answers_take_few_steps(name: str) -> None:
    steps = newton_steps(name)
    most = MOST_STEPS[name]
    assert steps.within_reach <= most.within_reach
    assert steps.beyond_reach <= most.beyond_reach
    assert steps.in_ticks <= most.in_ticks


@pytest.mark.parametrize("name", ["azimuths", "fins", "fins any shaft", "fins uneven"])
def test_from_the_multipliers_of_an_answer_nothing_is_left_to_do(name: str) -> None:
    for number in ROBOT_NUMBERS:
        robot = robot_of(name, number)
        for wrench in wrenches(robot, number, 1.0, 6):
            first = robot.answer(wrench)
            again = robot.answer(wrench, multipliers=first["multipliers"].copy())
            assert again["newton_steps"] <= 1
            near = robot.answer(1.001 * wrench, multipliers=first["multipliers"].copy())
            assert near["newton_steps"] <= max(4, first["newton_steps"])


def prepared_question(robot: Robot, **question: Any) -> tuple[list[Set], Any]:
    """Sets of a question, and the work area `fl_work` that it prepares."""
    record, _arrays = question_of(np.zeros(6), question)
    work = robot.work()
    place = ctypes.c_void_p(record.ctypes.data)
    assert functions().fl_prepare_question(at(robot.block), work, place)
    sets = [Set.from_buffer_copy(one) for one in Work.from_buffer(work).set[: robot.n]]
    return sets, Work.from_buffer(work)


def largest_power(robot: Robot, i: int, limits: Set) -> float:
    """Power of the dearest force of a set [W], by a scan of its sizes either way."""
    ahead = -1.0 if limits.is_flipped else 1.0
    size = np.linspace(limits.force_min, limits.force_max, 41)
    power = [robot.power(i, ahead * one) for one in size]
    if limits.force_max_reverse > 0.0:
        reverse = np.linspace(0.0, limits.force_max_reverse, 41)
        power.extend(robot.power(i, -one) for one in reverse)
    return max(power)


def largest_turn_cost(limits: Set) -> float:
    """What turning to the farthest angle of a set costs [W], by a scan of its arc."""
    half = limits.sector_half_angle
    angle = limits.sector_center + half * np.linspace(-1.0, 1.0, 20_001)
    turn = np.abs(np.angle(np.exp(1j * (angle - limits.turn_origin))))
    return float(limits.turn_cost / 2.0 * turn.max() ** 2)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_largest_cost_is_that_of_the_dearest_forces_and_angles(name: str) -> None:
    for number in ROBOT_NUMBERS:
        robot = robot_of(name, number)
        rng = np.random.default_rng([4, number])
        lost = np.arange(robot.n) == rng.integers(robot.n)
        origins = rng.uniform(-3.0, 3.0, robot.n)
        questions: list[dict[str, Any]] = [
            {},
            {"lost": lost.astype(np.uint8)},
            {"previous": commands_before(robot, rng), "calm": 2.0},
            {
                "previous": commands_before(robot, rng),
                "calm": 2.0,
                "ticks": 4,
                "angles_wanted": origins,
                "lost": lost.astype(np.uint8),
            },
            {"lost": (robot.actuators["flow_speed"] > 0.0).astype(np.uint8)},
        ]
        foils = robot.actuators["flow_speed"] > 0.0
        for question in questions:
            sets, work = prepared_question(robot, **question)
            works = question.get("lost", np.zeros(robot.n)) == 0
            dearest = 0.0
            for i in np.flatnonzero(works).tolist():
                dearest += largest_power(robot, i, sets[i])
                dearest += largest_turn_cost(sets[i])
            # Eq. 13 needs an upper bound; a scan is a little below it.
            assert work.power_cost_max >= dearest * (1.0 - 1e-12)
            assert work.power_cost_max <= dearest * (1.0 + 1e-3)
            has_turn_cost = any(limits.turn_cost > 0.0 for limits in sets)
            has_forks = any(limits.is_forked or limits.force_max_reverse > 0.0 for limits in sets)
            has_drag = bool((foils & works).any())
            has_bands = bool((robot.actuators["dead_band"] > 0.0).any())
            assert bool(work.has_turn_cost) == has_turn_cost
            assert bool(work.has_forks) == has_forks
            assert bool(work.has_drag) == has_drag
            assert bool(work.is_convex) == (
                not (has_turn_cost or has_forks or has_drag or has_bands)
            )
