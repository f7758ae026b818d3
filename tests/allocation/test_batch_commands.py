"""`BatchAllocation.commands`: the values by name of a single answer, as arrays over the targets."""

import pickle

import numpy as np
import pytest

from finlab import PowerTable
from finlab.allocation import Allocator
from finlab.layout import load_layout
from tests.t200 import t200_rows


def wrenches() -> np.ndarray:
    """Wrenches (5, 6) [N, N m] within reach of eight thrusters."""
    return np.random.default_rng(2).normal(size=(5, 6)) * [9.0, 9.0, 9.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "A", "torpedo"])
def test_a_batch_has_the_commands_of_each_answer_by_name(robot: str) -> None:
    layout = load_layout(robot)
    lost = layout.names[0]
    batch = Allocator(layout).allocate_batch(wrenches() * 0.1, lost=[lost])
    assert list(batch.commands) == list(layout.names)
    assert batch.commands[lost] is None
    assert batch.commands is batch.commands, "the mapping is made anew at each access"
    for i, actuator in enumerate(layout.actuators[1:], start=1):
        command = batch.commands[actuator.name]
        assert type(command) is actuator.KIND.command
        commands_of_answers = [actuator.command(row) for row in batch.command[:, i]]
        for field in command.__struct_fields__:
            expected = [getattr(one, field) for one in commands_of_answers]
            values = getattr(command, field)
            if values is None:
                assert expected == [None] * len(batch)
                continue
            assert values.shape == (len(batch),)
            assert not values.flags.writeable
            np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "A", "torpedo"])
def test_a_copy_of_a_batch_has_the_same_names(robot: str) -> None:
    layout = load_layout(robot)
    batch = Allocator(layout).allocate_batch(wrenches() * 0.1, lost=layout.names[:1])
    assert pickle.loads(pickle.dumps(batch)).commands.keys() == batch.commands.keys()


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "A", "torpedo"])
def test_an_empty_batch_has_commands_of_every_actuator(robot: str) -> None:
    layout = load_layout(robot)
    batch = Allocator(layout).allocate_batch(np.empty((0, 6)))
    assert batch.commands[layout.names[1]] is not None


def test_the_batch_says_which_input_a_measured_thruster_is_sent() -> None:
    layout = load_layout("bluerov2_heavy")
    name = layout.names[0]
    table = PowerTable(t200_rows(16), "us")
    measured = layout.replace_actuator(name, model=table, force=(-30.0, 40.0))
    batch = Allocator(measured).allocate_batch([*wrenches(), np.zeros(6)])
    inputs = batch.commands[name].input  # type: ignore[union-attr]
    for k, row in enumerate(batch.command[:, 0]):
        expected = measured.actuators[0].command(row).input  # type: ignore[union-attr]
        assert inputs[k] == expected
