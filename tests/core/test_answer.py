"""Answers of the core to one question: what is refused, what the multipliers say, what settings
bound, and robots that push nothing."""

import ctypes
from typing import Any

import numpy as np
import pytest

from finlab.actuators.rudder import Rudder
from finlab.allocation import Policy
from finlab.allocation.dual.compiled import core_policy
from finlab.arrays import Array
from finlab.core.fields import constant, struct
from finlab.layout import Layout
from tests.core.internal_functions import (
    ROBOTS,
    Robot,
    at,
    functions,
    in_the_core,
    prepared_work,
    question_of,
    robot_of,
)

OK = constant("FL_OK")
BAD_ARGUMENT = constant("FL_BAD_ARGUMENT")
LARGEST = 1e12
"""Largest number of a question."""


def code_of(robot: Robot, wrench: Array, **asked: Any) -> int:
    """The code that a question returns."""
    question, _arrays = question_of(wrench, asked)
    answer = np.zeros(1, struct("fl_answer"))
    places = ctypes.c_void_p(question.ctypes.data), ctypes.c_void_p(answer.ctypes.data)
    return int(functions().fl_answer_one(at(robot.block), prepared_work(robot.block), *places))


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "fins"])
def test_each_number_of_a_question_is_looked_at(name: str) -> None:
    robot = robot_of(name)
    calm_robot = np.zeros(6)
    for axis in range(6):
        for bad in (2.0 * LARGEST, -2.0 * LARGEST, np.nan, np.inf):
            wrench = np.zeros(6)
            wrench[axis] = bad
            assert code_of(robot, wrench) == BAD_ARGUMENT
    previous = np.ascontiguousarray(robot.plant.sample(np.random.default_rng(1), ()))
    assert code_of(robot, calm_robot, previous=previous) == OK
    for place in range(previous.size):
        for bad, code in ((2.0 * LARGEST, BAD_ARGUMENT), (-np.inf, BAD_ARGUMENT), (np.nan, OK)):
            other = previous.copy()
            other.ravel()[place] = bad
            assert code_of(robot, calm_robot, previous=other) == code, place
    for place in range(robot.n):
        for bad, code in ((2.0 * LARGEST, BAD_ARGUMENT), (np.nan, OK), (1.0, OK)):
            angles = np.zeros(robot.n)
            angles[place] = bad
            asked = {"previous": previous, "calm": 2.0, "angles_wanted": angles}
            assert code_of(robot, calm_robot, **asked) == code
    for calm, code in ((0.0, OK), (1000.0, OK), (1001.0, BAD_ARGUMENT), (-0.1, BAD_ARGUMENT)):
        assert code_of(robot, calm_robot, previous=previous, calm=calm) == code
    for ticks, code in ((0, OK), (9, OK), (-1, BAD_ARGUMENT)):
        assert code_of(robot, calm_robot, previous=previous, ticks=ticks) == code


@pytest.mark.parametrize(
    ("kind", "field", "values"),
    [
        ("closest", "kind", {-1: False, 0: True, 1: True, 3: False}),
        ("priority", "group_count", {-1: False, 0: True, 6: True, 7: False}),
        ("direction", "group_count", {-1: True, 7: True}),  # which it does not read
    ],
)
def test_a_policy_that_is_none_is_refused(kind: Any, field: str, values: dict[int, bool]) -> None:
    robot = robot_of("thrusters")
    for value, passes in values.items():
        record = core_policy(Policy(kind)).copy()
        record[field] = value
        code = code_of(robot, np.zeros(6), policy=record.ctypes.data)
        assert code == (OK if passes else BAD_ARGUMENT)


@pytest.mark.parametrize("axis", range(6))
def test_a_weight_of_an_axis_is_at_most_one(axis: int) -> None:
    robot = robot_of("thrusters")
    for kind, passes in (("closest", False), ("direction", True)):
        record = core_policy(Policy(kind)).copy()  # type: ignore[arg-type]
        record["axis_weight"][0, axis] = 1.5
        code = code_of(robot, np.zeros(6), policy=record.ctypes.data)
        assert code == (OK if passes else BAD_ARGUMENT)


@pytest.mark.parametrize("name", ["thrusters", "azimuths", "fins", "fins any shaft"])
def test_multipliers_are_what_one_more_unit_of_the_wrench_costs(name: str) -> None:
    """The derivatives of the least power by the wrench, along what the robot drives."""
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([2, number])
        wrench = 0.4 * robot.plant.wrench(robot.plant.sample(rng, ()))
        answer = robot.answer(wrench)
        if not answer["is_attainable"] or answer["gap_power_bound"] > 0.0:
            continue
        scale = robot.head["axis_scale"]
        basis = robot.head["basis"][:, : int(robot.head["rank"])]
        for direction in basis.T:
            step = 1e-4 * scale * direction * np.linalg.norm(wrench / scale)
            ahead, back = (dual_value(robot, wrench + change) for change in (step, -step))
            assert answer["multipliers"] @ step == pytest.approx(
                (ahead - back) / 2.0,
                rel=0.02,
                abs=1e-3 * np.abs(answer["multipliers"] * step).sum(),
            )


def dual_value(robot: Robot, wrench: Array) -> float:
    """The dual value [W] of the answer to a wrench, which is its power."""
    answer = robot.answer(wrench)
    force = np.zeros((robot.n, 2))
    inner: Array = answer["lambda_reduced"].copy()
    value = functions().fl_dual_value(
        at(robot.block),
        prepared_work(robot.block),
        at(wrench - robot.head["wrench_offset"]),
        at(inner),
        at(force),
    )
    return float(value)


@pytest.mark.parametrize("name", ROBOTS)
def test_an_answer_gives_the_wrench_that_it_says_it_serves(name: str) -> None:
    robot = robot_of(name, 1)
    rng = np.random.default_rng(3)
    head = robot.head
    for share in (0.3, 4.0):
        for policy in ("closest", "direction", "priority"):
            record = core_policy(Policy(policy))  # type: ignore[arg-type]
            wrench = share * robot.plant.wrench(robot.plant.sample(rng, ()))
            answer = robot.answer(wrench, policy=record.ctypes.data)
            command = np.ascontiguousarray(answer["command"][: robot.n])
            given = robot.plant.wrench(command)
            off = np.linalg.norm((given - answer["wrench_served"]) / head["wrench_scale"])
            # By the grids of the laws, which are as near to the plant as that.
            assert off == pytest.approx(float(answer["error"]), abs=2e-3)
            if answer["is_attainable"]:
                np.testing.assert_allclose(answer["wrench_served"], wrench)
            assert (command >= robot.plant.lower).all()
            assert (command <= robot.plant.upper).all()


@pytest.mark.parametrize("field", ["most_parts", "tick_parts", "command_steps"])
def test_settings_below_zero_are_refused_and_zero_is_taken(field: str) -> None:
    robot = robot_of("thrusters")
    settings = np.zeros(1, struct("fl_settings"))
    functions().fl_usual_settings(ctypes.c_void_p(settings.ctypes.data))
    assert all(value > 0 for value in settings[0])
    work = prepared_work(robot.block)
    for value, code in ((-1, BAD_ARGUMENT), (0, OK), (5, OK)):
        settings[field] = value
        place = ctypes.c_void_p(settings.ctypes.data)
        assert functions().fl_use_settings(work, place) == code


def test_foils_at_rest_give_no_wrench_and_no_other() -> None:
    rudder = Rudder("r", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0)
    robot = in_the_core(Layout("tail", (rudder,)))
    assert robot.head["rank"] == 0.0
    nothing = robot.answer(np.zeros(6))
    assert nothing["is_attainable"] and not nothing["wrench_served"].any()
    for axis in range(6):
        wrench = np.zeros(6)
        wrench[axis] = -1.0
        some = robot.answer(wrench)
        assert not some["is_attainable"] and not some["wrench_served"].any()
