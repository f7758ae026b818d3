"""Results are frozen: nothing that is written to an array changes a figure of an answer."""

import pickle

import numpy as np
import pytest

from finlab import PowerTable
from finlab.allocation import Allocation, Allocator, BatchAllocation
from finlab.layout import load_layout
from tests.t200 import t200_rows

FIGURES = ("target", "command", "scale", "wrench", "forces", "unallocated", "expected_miss")


@pytest.fixture(scope="module")
def allocator() -> Allocator:
    return Allocator(load_layout("bluerov2_heavy"))


def wrenches() -> np.ndarray:
    return np.random.default_rng(2).normal(size=(5, 6)) * [9.0, 9.0, 9.0, 1.0, 1.0, 1.0]


def assert_frozen(answer: Allocation | BatchAllocation) -> None:
    for name in FIGURES:
        with pytest.raises(ValueError, match="read-only"):
            getattr(answer, name)[...] = 0.0


def test_candidates_are_read_only() -> None:
    result = Allocator(load_layout("A"), "mdn").allocate([1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
    for answer in (result, pickle.loads(pickle.dumps(result))):
        for some in (answer.candidates, answer.samples):
            with pytest.raises(ValueError, match="read-only"):
                some.command[...] = 0.0


def test_a_buffer_that_is_used_again_changes_nothing(allocator: Allocator) -> None:
    buffer = wrenches()[0]
    flow = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    result, expected = (allocator.allocate(given, flow=flow) for given in (buffer, buffer.copy()))
    _ = expected.bound, expected.notes, expected.err_norm
    buffer[:] = 1e3
    flow[:] = 3.0
    assert result == expected
    many = wrenches()
    batch, same = (allocator.allocate_batch(given) for given in (many, many.copy()))
    _ = same.bound, same.notes, same.err_norm
    many[:] = 1e3
    assert batch == same and many.flags.writeable
    previous = np.zeros((8, 3))
    tick = allocator.allocate(wrenches()[0], previous=previous)
    previous[:] = 5.0
    assert tick.previous is not None and not tick.previous.any()


def test_another_command_is_a_copy(allocator: Allocator) -> None:
    result = allocator.allocate(wrenches()[0])
    command = np.zeros((8, 3))
    other = result.with_command(command)
    command[:] = 5.0
    assert not other.command.any() and command.flags.writeable
    assert_frozen(other)


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "A", "torpedo"])
def test_a_batch_has_the_commands_of_each_answer_by_name(robot: str) -> None:
    layout = load_layout(robot)
    lost = layout.names[:1]
    batch = Allocator(layout).allocate_batch(wrenches() * 0.1, lost=lost)
    assert list(batch.commands) == list(layout.names) and batch.commands[lost[0]] is None
    assert batch.commands is batch.commands
    for part, rows in zip(layout.actuators[1:], np.moveaxis(batch.command, 1, 0)[1:], strict=True):
        found = batch.commands[part.name]
        assert type(found) is part.KIND.command
        singles = [part.command(row) for row in rows]
        for name in found.__struct_fields__:
            each = [getattr(one, name) for one in singles]
            values = getattr(found, name)
            if values is None:
                assert each == [None] * len(rows)
                continue
            assert values.shape == (len(rows),) and not values.flags.writeable
            np.testing.assert_array_equal(values, each)
    assert pickle.loads(pickle.dumps(batch)).commands.keys() == batch.commands.keys()
    nothing = Allocator(layout).allocate_batch(np.empty((0, 6)))
    assert nothing.commands[layout.names[1]] is not None


def test_the_batch_says_what_a_table_sends() -> None:
    layout = load_layout("bluerov2_heavy")
    table = PowerTable(t200_rows(16), "us")
    measured = layout.replace_actuator(layout.names[0], model=table, force=(-30.0, 40.0))
    batch = Allocator(measured).allocate_batch([*wrenches(), np.zeros(6)])
    sent = batch.commands[layout.names[0]].input  # type: ignore[union-attr]
    for k, row in enumerate(batch.command[:, 0]):
        assert sent[k] == measured.actuators[0].command(row).input  # type: ignore[union-attr]
