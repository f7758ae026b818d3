"""The self-test's judgement and the graph's small parts, by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.deploy.bundle import Bundle
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.self_check import Finding, self_check
from finlab.errors import DataError


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


def finding(robot: Robot, question: str) -> Finding:
    return next(found for found in self_check(robot) if found.question.startswith(question))


def test_each_question_sees_its_own_damage(robot: Robot) -> None:
    """Every finding of a healthy robot is good; a changed number shows up as large as it is."""
    assert all(found.good for found in self_check(robot))
    first, *others = robot.graph.self_test
    moved = np.array(first.delivered_wrench) + 0.5 * robot.graph.normalization.std
    cases = (replace(first, delivered_wrench=tuple(moved.tolist())), *others)
    damaged = Robot(replace(robot.graph, self_test=cases), robot.allocator)
    error = finding(damaged, "wrench of the stored commands").value
    assert error == pytest.approx(
        float(robot.graph.normalization.error(moved, np.array(first.delivered_wrench))), abs=1e-6
    )
    assert not finding(damaged, "wrench of the stored commands").good
    # Stored answers that were better, and cheaper, than this computer's.
    away = np.array(first.wrench) + 0.1 * robot.graph.normalization.std
    cases = (
        replace(first, wrench=tuple((1e3 * away).tolist()), delivered_wrench=tuple(away.tolist())),
        *others,
    )
    assert not finding(
        Robot(replace(robot.graph, self_test=cases), robot.allocator), "own answers, judged"
    ).good
    idle = tuple(None if row is None else (0.5 * row[0], *row[1:]) for row in first.command)
    cases = (replace(first, command=idle), *others)
    damaged = Robot(replace(robot.graph, self_test=cases), robot.allocator)
    dearer = finding(damaged, "own answers, more cost")
    assert not dearer.good and dearer.value > 1.0, "half the strokes take less than half the power"
    first = replace(first, wrench=(90.0, *first.wrench[1:]), delivered_wrench=(90.0, *first.wrench[1:]))
    damaged = Robot(replace(robot.graph, self_test=(first, *others)), robot.allocator)
    assert not finding(damaged, "own answers, more error").good


def with_first(robot: Robot, **changes: Any) -> Robot:
    """The robot with its first self-test changed."""
    first, *others = robot.graph.self_test
    return Robot(replace(robot.graph, self_test=(replace(first, **changes), *others)), robot.allocator)


@pytest.mark.parametrize(("more", "good"), [(5e-5, True), (2e-4, False)])
def test_answers_may_miss_a_ten_thousandth_more_than_stored(robot: Robot, more: float, good: bool) -> None:
    """A target out of reach, of which the stored answer missed a little less."""
    target = np.array([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    answer = robot.allocate(target)
    share = 1.0 - more / answer.err_norm
    stored = with_first(
        robot, wrench=tuple(target), delivered_wrench=tuple(target - share * (target - answer.wrench))
    )
    assert answer.err_norm > 1.0
    assert finding(stored, "own answers, more error").good == good


@pytest.mark.parametrize(("more", "good"), [(0.005, True), (0.02, False)])
def test_answers_may_cost_a_hundredth_more_than_stored(robot: Robot, more: float, good: bool) -> None:
    """The power of a fin grows with the cube of its frequency."""
    answer = robot.allocate(robot.graph.self_test[0].wrench)
    cheaper = answer.command * [1.0, (1.0 + more) ** (-1.0 / 3.0), 1.0]
    stored = with_first(robot, command=tuple(map(tuple, cheaper.tolist())))
    found = finding(stored, "own answers, more cost")
    assert found.good == good
    if not good:
        assert found.value == pytest.approx(more, rel=0.05)


def test_without_self_tests_there_is_nothing_to_check(robot: Robot) -> None:
    with pytest.raises(DataError, match="^the bundle has no self-tests; export it again$"):
        self_check(Robot(replace(robot.graph, self_test=()), robot.allocator))
