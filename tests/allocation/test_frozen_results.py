"""Results are frozen: nothing that is written to an array changes a figure of an answer."""

import pickle

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.allocation import Allocation, BatchAllocation
from finlab.layout import load_layout

ARRAYS = ("target", "command", "scale", "wrench", "forces", "unallocated", "expected_miss")
"""Names of the arrays that every answer and every batch has."""


@pytest.fixture(scope="module")
def allocator() -> Allocator:
    """An allocator of eight thrusters."""
    return Allocator(load_layout("bluerov2_heavy"))


def wrenches() -> np.ndarray:
    """Wrenches (5, 6) [N, N m] within reach of eight thrusters."""
    return np.random.default_rng(2).normal(size=(5, 6)) * [9.0, 9.0, 9.0, 1.0, 1.0, 1.0]


def assert_frozen(answer: Allocation | BatchAllocation) -> None:
    """No array of an answer can be written to."""
    for name in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(answer, name)[...] = 0.0


def test_candidates_are_read_only() -> None:
    result = Allocator(load_layout("A"), "mdn").allocate([1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
    for answer in (result, pickle.loads(pickle.dumps(result))):
        for candidates in (answer.candidates, answer.samples):
            with pytest.raises(ValueError, match="read-only"):
                candidates.command[...] = 0.0


def read_lazy_figures(answer: Allocation | BatchAllocation) -> None:
    """Compute what an answer computes when it is first read, from the arrays that it keeps."""
    _ = answer.bound
    _ = answer.notes
    _ = answer.err_norm


def test_a_buffer_of_an_answer_that_is_used_again_changes_nothing(allocator: Allocator) -> None:
    buffer = wrenches()[0]
    flow = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    result = allocator.allocate(buffer, flow=flow)
    expected = allocator.allocate(buffer.copy(), flow=flow)
    read_lazy_figures(expected)
    buffer[:] = 1e3
    flow[:] = 3.0
    assert result == expected


def test_a_buffer_of_a_batch_that_is_used_again_changes_nothing(allocator: Allocator) -> None:
    buffer = wrenches()
    batch = allocator.allocate_batch(buffer)
    expected = allocator.allocate_batch(buffer.copy())
    read_lazy_figures(expected)
    buffer[:] = 1e3
    assert batch == expected
    assert buffer.flags.writeable


def test_a_buffer_of_the_tick_before_that_is_used_again_changes_nothing(
    allocator: Allocator,
) -> None:
    previous = np.zeros((8, 3))
    tick = allocator.allocate(wrenches()[0], previous=previous)
    previous[:] = 5.0
    assert tick.previous is not None
    assert not tick.previous.any()


def test_another_command_is_a_copy(allocator: Allocator) -> None:
    result = allocator.allocate(wrenches()[0])
    command = np.zeros((8, 3))
    other = result.with_command(command)
    command[:] = 5.0
    assert not other.command.any() and command.flags.writeable
    assert_frozen(other)
