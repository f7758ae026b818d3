"""The self-test's judgement and the graph's small parts, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.deploy.bundle import Bundle
from finlab.deploy.graph import N_SELF_TEST, _rounded, _rows, random_targets
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.self_check import Finding, self_check, worst
from finlab.errors import DataError
from finlab.physics import Plant


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


def test_good_is_up_to_the_limit_and_never_nan() -> None:
    assert Finding("q", 1.0, 1.0).good and Finding("q", 0.0, 0).good
    assert not Finding("q", np.nextafter(1.0, 2.0), 1.0).good and not Finding("q", np.nan, 1.0).good


def test_worst_is_the_largest_or_nan() -> None:
    assert worst([]) == 0.0 and worst([-2.0, -1.0]) == 0.0 and worst([0.5, 2.0, 1.0]) == 2.0
    assert np.isnan(worst([1.0, np.nan, 3.0]))


def test_random_targets_are_wrenches_of_commands_within_the_limits(robot: Robot) -> None:
    layout = robot.layout
    targets = random_targets(layout, 30)
    draws = np.random.default_rng(0).random((30, layout.n_fins, 3))
    command = layout.lower * (1 - draws) + layout.upper * draws
    np.testing.assert_allclose(targets, Plant(layout).wrench(command), atol=1e-12)


def test_rows_of_failed_fins_are_empty_and_numbers_have_nine_digits(robot: Robot) -> None:
    names = robot.layout.names
    rows = _rows(robot.layout, (names[1],), np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 1 / 3]]))
    assert rows == ((1.0, 2.0), None, (3.0, 4.0), (5.0, 0.333333333))
    assert _rounded(np.array([1234567890123.0, 1e-30 / 3])).tolist() == [1234567890000.0, 3.33333333e-31]


def test_edges_join_all_healthy_fins_once(robot: Robot) -> None:
    a, b, c, d = robot.layout.names
    graph = replace(robot.graph, failed=(b,))
    assert graph.edges == ((a, a), (a, c), (a, d), (c, c), (c, d), (d, d))
    assert len(robot.graph.edges) == 10 and len(robot.graph.self_test) == N_SELF_TEST


def finding(robot: Robot, question: str) -> Finding:
    return next(found for found in self_check(robot) if found.question.startswith(question))


def test_each_question_sees_its_own_damage(robot: Robot) -> None:
    """Every finding of a healthy robot is good; a changed number shows up as large as it is."""
    assert all(found.good for found in self_check(robot))
    first, *others = robot.graph.self_test
    assert first.features[0] is not None
    off = (first.features[0][0] + 0.25, *first.features[0][1:])
    cases = (replace(first, features=(off, *first.features[1:])), *others)
    damaged = Robot(replace(robot.graph, self_test=cases), robot.allocator)
    assert finding(damaged, "node features").value == pytest.approx(0.25, abs=1e-6)
    moved = np.array(first.predicted_wrench) + 0.5 * robot.graph.normalization.std
    cases = (replace(first, predicted_wrench=tuple(moved.tolist())), *others)
    damaged = Robot(replace(robot.graph, self_test=cases), robot.allocator)
    error = finding(damaged, "wrench of the stored commands").value
    assert error == pytest.approx(
        float(robot.graph.normalization.error(moved, first.predicted_wrench)), abs=1e-4
    )
    assert not finding(damaged, "wrench of the stored commands").good


def test_without_self_tests_there_is_nothing_to_check(robot: Robot) -> None:
    with pytest.raises(DataError, match="^the bundle has no self-tests; export it again$"):
        self_check(Robot(replace(robot.graph, self_test=()), robot.allocator))
