"""Solutions of parts of a robot or of its targets put together, and lists of candidates."""

import numpy as np
import pytest

from finlab.allocation.solution import (
    CANDIDATE_ARRAYS,
    Candidates,
    Solution,
    among_all,
    equal,
    joined,
)
from finlab.arrays import Array

WORKS = np.array([True, False, True, True])


def commands(count: int, n: int, seed: int) -> Array:
    """Random commands (count, n, 3)."""
    return np.random.default_rng(seed).normal(size=(count, n, 3))


@pytest.mark.parametrize("rows", [(), (2,), (2, 5)])
def test_commands_of_working_actuators_stand_among_those_of_all(rows: tuple[int, ...]) -> None:
    command = np.random.default_rng(0).normal(size=(*rows, 3, 3))
    full = among_all(command, WORKS)
    assert full.shape == (*rows, 4, 3)
    np.testing.assert_array_equal(full[..., WORKS, :], command)
    assert np.isnan(full[..., ~WORKS, :]).all()
    whole = np.random.default_rng(1).normal(size=(*rows, 4, 3))
    assert among_all(whole, WORKS) is whole


def part_of(count: int, n: int, seed: int, first_power: float | None, note: str) -> Solution:
    """A solution whose bound is a number, and of each row one more; None for none."""
    bound = None
    if first_power is not None:

        def bound(command: Array, force: Array) -> Array:
            assert command.shape == (count, n, 3) and np.isfinite(command).all()
            np.testing.assert_array_equal(force, 2.0 * command)
            return np.asarray(first_power + np.arange(count) + command[:, 0, 0])

    return Solution(
        commands(count, n, seed),
        bound=bound,
        wrench=np.full((count, 6), seed),
        notes=lambda: (note, "all"),
    )


@pytest.mark.parametrize("n", [3, 4])
def test_parts_of_the_targets_are_one_solution(n: int) -> None:
    """Of the actuators that work alone, or of all."""
    first, second = part_of(3, n, 1, 10.0, "one"), part_of(2, n, 2, 20.0, "two")
    rows = np.array([4, 0])
    whole = joined([(slice(1, 4), first), (rows, second)], 5, WORKS)
    assert whole.command.shape == (5, 4, 3)
    working = whole.command if n == 4 else whole.command[:, WORKS]
    np.testing.assert_array_equal(working[1:4], first.command)
    np.testing.assert_array_equal(working[rows], second.command)
    if n == 3:
        assert np.isnan(whole.command[:, ~WORKS]).all()
    assert whole.wrench is not None and whole.bound is not None
    np.testing.assert_array_equal(whole.wrench[:, 0], [2, 1, 1, 1, 2])
    expected = working[:, 0, 0] + [21.0, 10.0, 11.0, 12.0, 20.0]
    np.testing.assert_allclose(whole.bound(whole.command, 2.0 * whole.command), expected)
    assert whole.notes is not None and whole.notes() == ("one", "all", "two")


def test_parts_without_bounds_or_wrenches_have_none_together() -> None:
    plain = Solution(commands(2, 4, 3))
    whole = joined([(slice(0, 2), plain)], 2, WORKS)
    assert whole.bound is None and whole.wrench is None
    assert whole.notes is not None and whole.notes() == ()


def candidates(count: int) -> Candidates:
    """Candidates whose errors rise and whose efforts fall, by their sources' numbers."""
    rng = np.random.default_rng(count)
    return Candidates(
        command=rng.normal(size=(count, 2, 3)),
        wrench=rng.normal(size=(count, 6)),
        err_norm=np.arange(count) / 10.0,
        effort=1.0 - np.arange(count) / 100.0,
        power=rng.random(count),
        source=tuple(f"draw {k}" for k in range(count)),
    )


def check_rows(some: Candidates, every: Candidates, indices: list[int]) -> None:
    """Some candidates are those of all by their indices, in every field."""
    assert len(some) == len(indices)
    assert some.source == tuple(every.source[k] for k in indices)
    for name in CANDIDATE_ARRAYS:
        np.testing.assert_array_equal(getattr(some, name), getattr(every, name)[indices])


def test_candidates_are_chosen_split_and_joined_in_every_field() -> None:
    every = candidates(6)
    check_rows(every.rows([4, 1]), every, [4, 1])
    check_rows(every.rows(slice(2, 5)), every, [2, 3, 4])
    parts = every.split(3)
    assert len(parts) == 3
    for number, part in enumerate(parts):
        check_rows(part, every, [2 * number, 2 * number + 1])
    check_rows(parts[1].followed_by(parts[0]), every, [2, 3, 0, 1])
    # An error that is just as large as is allowed counts as exact; the last ones are cheapest.
    check_rows(every.exact(0.3), every, [3, 2, 1, 0])
    assert len(every.exact(-1.0)) == 0


@pytest.mark.parametrize(
    ("a", "b", "is_equal"),
    [
        (np.array([1.0, np.nan]), np.array([1.0, np.nan]), True),
        (np.array([1.0, 2.0]), np.array([1.0, 3.0]), False),
        (np.array(["a", "b"]), np.array(["a", "b"]), True),
        (np.array([1.0]), 1.0, False),
        (1.0, np.array([1.0]), False),
        ((1.0, np.array([np.nan])), (1.0, np.array([np.nan])), True),
        ((1.0, 2.0), (1.0,), False),
        ((1.0,), (1.0, 2.0), False),
        ((), (), True),
        ((1.0, 2.0), (1.0, 2.5), False),
        (float("nan"), float("nan"), True),
        (float("nan"), 1.0, False),
        (1.0, float("nan"), False),
        (1.0, 1.0, True),
        (1.0, 2.0, False),
        ("a", "a", True),
        ("a", "b", False),
        ((1.0,), 1.0, False),
    ],
)
def test_values_are_equal_part_by_part(a: object, b: object, is_equal: bool) -> None:
    assert equal(a, b) is is_equal
