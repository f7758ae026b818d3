"""The state of a damaged robot: which actuators work, and commands of these among all."""

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.question import RobotState
from finlab.layout import Damage, Fin, Layout, Limits

ROBOT = Layout("robot", tuple(Fin(name, (0.1 * i, 0.0, 0.0), 0.0) for i, name in enumerate("abc")))


def state_of(damage: Damage) -> RobotState:
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
