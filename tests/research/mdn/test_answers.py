"""From proposals to answers: descents end at the target, and what is left is made exact."""

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.layout import FinModelSpec, Layout
from finlab.physics import plant_of
from finlab.research.mdn.answers import (
    EffortRobot,
    RefinedAnswers,
    Steps,
    effort_robot,
    follow,
    ranked,
    refined,
    traced,
)
from finlab.research.mdn.descent import descend, wrench
from finlab.research.random_layouts import random_layout

WRENCH_SCALE = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
"""Scale of errors in the six axes [N, N m]."""


def robot_of(n: int, limits: str = "nominal") -> EffortRobot:
    """A random robot of n fins, one of which is uneven."""
    layout = random_layout(np.random.default_rng(n), n_fins=n, limits=limits)  # type: ignore[arg-type]
    uneven = FinModelSpec("soft", (("e", 0.2), ("d", 0.1)))
    return effort_robot(plant_of(layout.replace_actuator("fin_1", model=uneven)), WRENCH_SCALE)


def targets_of(robot: EffortRobot, count: int) -> tuple[Array, Array]:
    """Normalized targets (N, 6), and needlessly dear commands (N, n, 3) that give them."""
    command = robot.plant.sample(np.random.default_rng(1), (count,))
    return robot.commands.wrench(command), command


def random_forces(robot: EffortRobot, rows: int) -> Array:
    """Forces (rows, ...) of a robot within its limits, as complex numbers."""
    rng = np.random.default_rng(2)
    largest = robot.forces.fins.maximum
    shape = rows, len(largest)
    return np.asarray(
        rng.random(shape) ** 3 * largest * np.exp(1j * rng.uniform(-np.pi, np.pi, shape))
    )


@pytest.mark.parametrize(("n", "limits"), [(4, "nominal"), (8, "nominal"), (6, "varied")])
def test_descents_end_near_the_target_with_less_effort_than_at_first(n: int, limits: str) -> None:
    robot = robot_of(n, limits)
    target, _ = targets_of(robot, 40)
    *_, found = descend(robot.forces, target, random_forces(robot, 40), 30)
    missed = np.linalg.norm(wrench(robot.forces, found.force) - target, axis=1)
    assert np.median(missed) < 2e-3 and (missed < 0.05).mean() > (
        0.9 if limits == "nominal" else 0.6
    )


def test_answers_are_exact_and_the_cheapest_comes_first() -> None:
    robot = robot_of(6)
    target, _ = targets_of(robot, 3)
    found = follow(robot, target, random_forces(robot, 72).reshape(3, 24, 6), 5, Steps())
    assert found.command.shape == (3, 5, 6, 3) and (found.error[:, 0] <= robot.exact).all()
    given = robot.commands.wrench(found.command.reshape(-1, 6, 3)).reshape(3, 5, 6)
    np.testing.assert_allclose(given, found.wrench, atol=1e-12)
    for error, effort in zip(found.error, found.effort, strict=True):
        assert (np.diff(effort[error <= robot.exact]) >= 0.0).all()
    # Each of a batch is answered as if it were alone.
    alone = follow(robot, target[1:2], random_forces(robot, 72).reshape(3, 24, 6)[1:2], 5, Steps())
    np.testing.assert_allclose(alone.effort[0, 0], found.effort[1, 0], rtol=5e-3)


def test_where_none_is_exact_the_cheapest_of_the_nearest_is_first() -> None:
    robot = robot_of(4)
    error = np.array([[0.1, 0.10003, 0.3], [0.0, 0.0, 1e-3]])
    effort = np.array([[3.0, 2.0, 1.0], [2.0, 1.99, 1.0]])
    given = RefinedAnswers(
        np.zeros((2, 3, 4, 3)), np.zeros((2, 3, 6)), error, effort, np.arange(6).reshape(2, 3)
    )
    assert ranked(robot, given).origin.tolist() == [[1, 0, 2], [4, 3, 5]]
    assert ranked(robot, given, bonus=0.01).origin[1].tolist() == [3, 4, 5], "a switch must pay"


def test_hopeless_targets_are_left_where_they_are_nearest() -> None:
    robot = robot_of(4)
    target, command = targets_of(robot, 2)
    far = refined(robot, 50.0 * target, command[:, None], np.zeros((2, 1), int), Steps(commands=10))
    assert np.isfinite(far.command).all() and (far.error > 1.0).all()


def test_robots_of_one_layout_see_the_same(layout_a: Layout) -> None:
    one, other = (effort_robot(plant_of(layout_a), s) for s in (WRENCH_SCALE, 3.0 * WRENCH_SCALE))
    np.testing.assert_allclose(one.view.static, other.view.static)
    np.testing.assert_allclose(one.view.solver, other.view.solver / 3.0, rtol=1e-9)


def test_a_trace_begins_at_the_proposals_and_ends_at_exact_answers_of_less_effort() -> None:
    robot = robot_of(5)
    target, _ = targets_of(robot, 1)
    force = random_forces(robot, 30).astype(complex)
    ways = traced(robot, target[0], force, Steps(descent=16, commands=4))
    assert {way.shape for way in ways} == {(30, 5, 3)} and len(ways) == 21
    given = wrench(robot.forces, robot.forces.fins.project(force).force)
    off = np.linalg.norm(robot.commands.wrench(ways[0]) - given, axis=1)
    assert np.median(off) < 0.02, "the first is what was proposed"
    error = np.array([np.linalg.norm(robot.commands.wrench(way) - target, axis=1) for way in ways])
    exact = error[-1] <= robot.exact
    assert exact.mean() > 0.9 and np.median(error[0]) > 100.0 * np.median(error[16])
    effort = np.array([robot.effort(way) for way in ways])[:, exact]
    assert effort[16].sum() < effort[1].sum(), "the descent lowers the effort"
