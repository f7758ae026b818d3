"""The self-test's judgement and the graph's small parts, by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.bundle_files import CHECKSUMS, checksums
from finlab.deploy.bundle import COMPILED, Bundle
from finlab.deploy.graph import N_SELF_TEST, _rounded, build_graph, random_targets
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.self_check import Finding, self_check, worst
from finlab.errors import DataError
from finlab.forces.compiled_fins import compiled_bytes, parse_compiled
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
    graph = build_graph(robot.layout, robot.allocator, (names[1],))
    for case in graph.self_test:
        assert [row is None for row in case.command] == [name == names[1] for name in names]
        values = [*case.wrench, *case.delivered_wrench, *(v for row in case.command for v in row or ())]
        assert values == [float(f"{value:.9g}") for value in values]
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


@pytest.mark.parametrize(("share", "good"), [(5e-4, True), (2e-3, False)])
def test_compiled_fins_may_differ_by_a_thousandth(
    robot: Robot, bundle: Bundle, share: float, good: bool
) -> None:
    known = parse_compiled(bundle.files[COMPILED], COMPILED)
    forged = {key: replace(fin, largest=(1.0 + share) * fin.largest) for key, fin in known.items()}
    files = {**bundle.files, COMPILED: compiled_bytes(forged)}
    files[CHECKSUMS] = checksums({name: files[name] for name in files if name != CHECKSUMS})
    found = finding(parse_robot(files), "compiled fins")
    assert found.good == good and found.value == pytest.approx(share, rel=1e-2)


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
