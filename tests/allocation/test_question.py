"""What an allocator may be asked: the last values that are taken, the first that are refused, and
why."""

import math
import re
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator, question
from finlab.errors import AllocationError, CommandError
from finlab.layout import Fin, Layout

ROBOT = Layout("robot", tuple(Fin(name, (0.1 * i, 0.0, 0.0), 0.0) for i, name in enumerate("abc")))
"""Three fins in a row."""


@pytest.mark.parametrize(
    ("lost", "sentence"),
    [
        ("a", "lost: expected a list of names, got the text 'a'; write ['a']"),
        (["a", 2], "lost: expected a list of names, got ['a', 2]"),
        ({"a"}, "lost: expected a list of names, got {'a'}"),
    ],
)
def test_lost_fins_are_a_list_of_names(lost: object, sentence: str) -> None:
    with pytest.raises(AllocationError, match=f"^{re.escape(sentence)}$"):
        question.damage_of(None, lost)  # type: ignore[arg-type]


def test_damage_of_another_type_is_refused() -> None:
    with pytest.raises(AllocationError, match="damage: expected a Damage, got 'weak'"):
        question.damage_of("weak", ())  # type: ignore[arg-type]


def test_the_largest_wrench_is_still_taken() -> None:
    most = [question.MAX_WRENCH, -question.MAX_WRENCH, 0, 0, 0, 0]
    np.testing.assert_array_equal(question.check_target(most), most)
    assert question.check_target([1, 2, 3, 4, 5, 6]).dtype == np.float64
    assert question.check_wrenches(np.empty((0, 6))).shape == (0, 6)
    sentence = r"wrench: Tx must be a number of at most 1e\+12 in size, got -1000000000001"
    with pytest.raises(CommandError, match=sentence):
        question.check_wrenches([[0] * 6, [0, 0, 0, -question.MAX_WRENCH - 1, 0, 9e15]])


@pytest.mark.parametrize("shape", [(6,), (2, 5), (1, 2, 6), ()])
def test_many_wrenches_are_rows_of_six(shape: tuple[int, ...]) -> None:
    sentence = (
        f"wrench: expected an array of shape (N, 6) in N and N m, got an array of shape {shape}"
    )
    with pytest.raises(CommandError, match=f"^{re.escape(sentence)}$"):
        question.check_wrenches(np.zeros(shape))


def test_complex_numbers_are_no_wrench() -> None:
    with pytest.raises(CommandError, match="wrench: expected six numbers"):
        question.check_target([1j, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    "wrong",
    [
        [True, 0.0, 0.0, 0.0, 0.0, 0.0],
        (1, 0, 0, 0, 0, np.False_),
        ["1", "0", "0", "0", "0", "0"],
        [1.0, "0", 0.0, 0.0, 0.0, 0.0],
        "1",
        True,
        np.ones(6, dtype=bool),
        np.array(["1"] * 6),
        np.array([True, 1, 0, 0, 0, 0], dtype=object),
        np.array(["2020-01-01"] * 6, dtype="datetime64[D]"),
    ],
)
def test_truth_values_and_text_are_no_numbers(wrong: Any) -> None:
    allocator = Allocator(ROBOT)
    for name, ask in (
        ("wrench", lambda: allocator.allocate(wrong)),
        ("wrench", lambda: allocator.allocate_batch([wrong])),
        ("flow", lambda: allocator.allocate([0.0] * 6, flow=wrong)),
        ("reference", lambda: allocator.allocate([0.0] * 6, reference=[wrong])),
        ("previous", lambda: allocator.allocate([0.0] * 6, previous=[wrong] * 3)),
    ):
        with pytest.raises(CommandError, match=f"^{name}: expected .*, got "):
            ask()
    for given in (
        [1, 0, 0, 0, 0, 0],
        np.ones(6, np.float32),
        np.ones(6, np.int16),
        (1.0, 0, 0, 0, 0, 0),
    ):
        assert allocator.allocate(given).target.dtype == np.float64


def test_expected_wrenches_are_numbers() -> None:
    later = np.ones((30, 6))
    np.testing.assert_array_equal(question.check_reference(later), later)
    later[7, 2] = math.nan
    with pytest.raises(CommandError, match="reference: Fz must be a number"):
        question.check_reference(later)


@pytest.mark.parametrize("seed", [0, 1, np.int64(3)])
def test_seeds_are_whole_numbers_from_0(seed: object) -> None:
    question.check_seed(seed)


@pytest.mark.parametrize("seed", [-1, True, 1.0, "1", None])
def test_other_seeds_are_refused(seed: object) -> None:
    with pytest.raises(
        AllocationError, match=f"^seed: expected a whole number from 0, got {seed!r}$"
    ):
        question.check_seed(seed)


def test_no_layout_is_refused() -> None:
    with pytest.raises(
        AllocationError, match="layout: expected a Layout, got 'A'; read a file with"
    ):
        question.check_layout("A")


def test_previous_commands_may_hold_nan_but_nothing_infinite() -> None:
    previous = np.zeros((3, 3))
    previous[1] = math.nan
    np.testing.assert_array_equal(question.check_previous(previous, ROBOT), previous)
    previous[2, 1] = -math.inf
    with pytest.raises(CommandError, match="previous: expected finite commands"):
        question.check_previous(previous, ROBOT)
    for wrong in (np.zeros((2, 3)), np.zeros((3, 2)), np.zeros(9)):
        sentence = f"(3, 3) for layout 'robot', got shape {wrong.shape}; pass the `command`"
        with pytest.raises(CommandError, match=re.escape(sentence)):
            question.check_previous(wrong, ROBOT)


@pytest.mark.parametrize("rows", [1, 16, 17, 40])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 2e12, -2e12])
def test_one_number_out_of_range_is_found_among_few_and_many(rows: int, bad: float) -> None:
    rng = np.random.default_rng(rows)
    wrenches = rng.uniform(-1e5, 1e5, (rows, 6))
    np.testing.assert_array_equal(question.check_wrenches(wrenches), wrenches)
    row, axis = int(rng.integers(rows)), int(rng.integers(6))
    wrenches[row, axis] = bad
    name = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")[axis]
    with pytest.raises(
        CommandError, match=f"wrench: {name} must be a number .* got {bad}"
    ) as caught:
        question.check_wrenches(wrenches)
    assert (f'free=("{name}",)' in str(caught.value)) == (not math.isfinite(bad))


def test_many_numbers_that_are_large_together_are_no_error() -> None:
    """What bounds them all is above the limit, none of them is."""
    wrenches = np.full((10, 6), 9e11)
    np.testing.assert_array_equal(question.check_wrenches(wrenches), wrenches)
    wrenches[3, 2] = -1e12
    np.testing.assert_array_equal(question.check_wrenches(wrenches), wrenches)


@pytest.mark.parametrize("axis", range(6))
def test_a_flow_is_as_fast_as_it_may_be_at_most(axis: int) -> None:
    flow = np.zeros(6)
    assert question.check_flow(flow) is None
    flow[axis] = -question.MAX_FLOW
    np.testing.assert_array_equal(question.check_flow(flow), flow)
    for bad in (1.001 * question.MAX_FLOW, math.nan, math.inf):
        flow[axis] = bad
        with pytest.raises(CommandError, match="flow: each component must be finite"):
            question.check_flow(flow)


@pytest.mark.parametrize("n", [3, 40])
def test_of_a_previous_command_infinity_is_refused_and_nan_is_not(n: int) -> None:
    fins = tuple(Fin(f"f{i}", (0.01 * i, 0.0, 0.0), 0.0) for i in range(n))
    layout = Layout("many", fins)
    command = np.ones((n, 3))
    command[1] = np.nan
    np.testing.assert_array_equal(question.check_previous(command, layout), command)
    command[2, 1] = -math.inf
    with pytest.raises(CommandError, match="previous: expected finite commands"):
        question.check_previous(command, layout)
    with pytest.raises(CommandError, match="previous: expected a command of shape"):
        question.check_previous(np.ones((n - 1, 3)), layout)
