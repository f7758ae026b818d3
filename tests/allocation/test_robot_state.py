"""A robot in one state: its actuators that work, rows of commands, and the question to its
method."""

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.policy import CLOSEST
from finlab.allocation.robot_state import RobotState
from finlab.layout import Damage, Fin, Layout, Limits

ROBOT = Layout("robot", tuple(Fin(name, (0.1 * i, 0.0, 0.0), 0.0) for i, name in enumerate("abc")))
"""Three fins in a row."""


def state_of(damage: Damage) -> RobotState:
    """What an allocator prepares for a robot with damage."""
    return Allocator(ROBOT)._state(damage)


def test_commands_of_an_undamaged_robot_are_not_copied() -> None:
    command = np.ones((2, 3, 3))
    assert state_of(Damage()).among_all(command) is command
    assert state_of(Damage([])).among_all(command) is command


def test_commands_of_the_working_fins_are_put_in_their_rows() -> None:
    state = state_of(Damage(["b"]))
    assert state.damage.lost == ("b",)
    assert state.healthy.names == ("a", "c")
    assert state.layout is ROBOT
    assert state.works.tolist() == [True, False, True]
    command = np.arange(12.0).reshape(2, 2, 3)
    full = state.among_all(command)
    np.testing.assert_array_equal(full[:, [0, 2]], command)
    assert full.shape == (2, 3, 3) and np.isnan(full[:, 1]).all()
    assert state.among_all(command[0]).shape == (3, 3)


def test_damage_changes_the_limits_of_all_and_of_the_working_fins() -> None:
    state = state_of(Damage(["a"], running={"c": (0.2, 1.0, 0.5)}))
    held = Limits((0.2, 0.2), (1.0, 1.0), (0.5, 0.5))
    assert state.layout.fins[2].limits == held
    assert state.healthy.fins[1].limits == held
    assert state.layout.fins[1] == ROBOT.fins[1]


def test_a_question_tells_losses_and_free_axes_to_a_method_that_reads_them() -> None:
    state = Allocator(ROBOT)._state(Damage(["b"]), ("Ty",))
    wrenches = np.ones((2, 6))
    previous = np.arange(9.0).reshape(3, 3)
    question = state.question(wrenches, CLOSEST, None, 0, previous)
    assert question.lost is not None and question.lost.tolist() == [False, True, False]
    assert question.free is not None and question.free[4]
    assert (question.targets[:, 4] == 0.0).all() and (question.targets[:, 0] == 1.0).all()
    assert question.previous is previous


def test_a_question_to_any_other_method_is_of_the_actuators_that_work() -> None:
    state = Allocator(ROBOT, "sqp")._state(Damage(["b"]))
    previous = np.arange(9.0).reshape(3, 3)
    question = state.question(
        np.ones((1, 6)), CLOSEST, None, 0, previous, np.ones(6), np.ones((4, 6))
    )
    assert question.lost is None and question.free is None
    assert question.multipliers is None and question.reference is None
    assert question.previous is not None
    np.testing.assert_array_equal(question.previous, previous[[0, 2]])


def test_a_part_of_a_question_has_the_seeds_of_its_targets() -> None:
    wrenches = np.arange(30.0).reshape(5, 6)
    part = Allocator(ROBOT)._whole.question(wrenches, CLOSEST, None, 7).part(slice(2, 4))
    np.testing.assert_array_equal(part.targets[:, 0], wrenches[2:4, 0])
    assert part.seed == 9
