"""Answers to one target and to many are plain data, and each row is what a single call would
say."""

import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocation, Allocator, Policy
from finlab.allocation.solution import equal
from finlab.assets import shipped_checkpoints
from finlab.errors import AllocationError, DataError
from finlab.layout import Damage, Fin, FinModelSpec, Layout, load_layout
from finlab.physics import Plant
from tests.allocation.quick_allocator import OF_FINS, quick_allocator
from tests.allocator_cache import AllocatorCache

WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""
WRENCH_OUT_OF_REACH = [40.0, 5.0, -30.0, 1.0, 2.0, 3.0]
"""A wrench that no robot here can give [N, N m]."""

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()),
    reason="no trained checkpoints in the tree",
)


def copies(result: Allocation) -> list[Allocation]:
    """An answer after each way of copying it."""
    return [pickle.loads(pickle.dumps(result)), copy.copy(result), copy.deepcopy(result)]


def test_every_field_counts_but_the_time() -> None:
    result = AllocatorCache("mdn").allocate(load_layout("A"), WRENCH)
    assert replace(result, solve_ms=1e3) == result
    assert result.candidates is not None
    for changed in (
        {"command": result.command + 1e-15},
        {"command": result.command[:3]},
        {"wrench_expected": result.wrench},
        {"previous": result.command},
        {"damage": Damage(["front_left"])},
        {"seed": 1},
    ):
        assert replace(result, **changed) != result, changed
    candidates_of_result = result.candidates
    for candidates, samples in (
        (replace(candidates_of_result, power=candidates_of_result.power + 1e-12), None),
        (None, None),
        (candidates_of_result, candidates_of_result),
    ):
        assert result.with_candidates(candidates, samples) != result
    assert result.with_candidates(candidates_of_result, result.samples) == result
    assert result != "an answer" and result is not None
    with pytest.raises(TypeError, match="unhashable"):
        hash(result)


def test_nan_equals_nan_and_kinds_differ() -> None:
    nan = float("nan")
    assert (
        equal(nan, nan)
        and equal(np.array([1.0, nan]), np.array([1.0, nan]))
        and equal((nan,), (nan,))
    )
    assert (
        not equal(np.array([1.0]), 1.0)
        and not equal((1.0,), (1.0, 2.0))
        and not equal(np.ones(2), np.ones(3))
    )
    assert not equal(1.0, nan) and not equal(None, np.ones(2))


def test_an_answer_cannot_be_written_to_nor_what_comes_after_it() -> None:
    layout = load_layout("A")
    search = AllocatorCache("mdn")
    first, second = (search.allocate(layout, WRENCH) for _ in range(2))
    assert first.candidates is not None and first.candidates.command.base is not first.command
    with pytest.raises(ValueError, match="read-only"):
        first.command[:] = 0.0
    assert search.allocate(layout, WRENCH) == second
    assert first.candidates == second.candidates


@pytest.mark.parametrize("n_fins", [1, 4, 16])
def test_the_short_form_is_short(n_fins: int, search: AllocatorCache) -> None:
    fins = tuple(Fin(f"{'long' * 14}_{i}", (0.1, 0.01 * i, 0.0), 0.3 * i) for i in range(n_fins))
    layout = Layout("the longest name of a layout that " + "x" * 30, fins)
    result = search.allocate(layout, WRENCH, lost=[fin.name for fin in fins[: n_fins // 2]])
    assert len(repr(result)) <= 400 and "err_norm=" in repr(result)
    batch = search.allocate_batch(layout, [WRENCH] * 5)
    assert len(repr(batch)) <= 400 and "5 targets" in repr(batch)
    assert "0 targets" in repr(search.allocate_batch(layout, np.empty((0, 6))))


def test_another_command_is_judged_anew(search: AllocatorCache) -> None:
    layout = load_layout("A")
    result = search.allocate(layout, WRENCH, lost=["front_left"])
    least = np.where(np.isnan(result.command), np.nan, layout.lower)
    other = result.with_command(least)
    np.testing.assert_allclose(other.wrench, Plant(layout).wrench(least), atol=1e-12)
    assert (
        not other.reachable
        and other.err_norm > 0.01 > result.err_norm
        and other.effort < result.effort
    )
    assert other.wrench_expected is None and other.target is result.target


def test_a_method_that_does_not_know_the_fins_blames_no_limit() -> None:
    layout = load_layout("A")
    strange = replace(
        layout, actuators=tuple(replace(f, model=FinModelSpec("lighthill")) for f in layout.fins)
    )
    result = quick_allocator("paper").allocate(strange, WRENCH)
    assert not result.reachable and result.binding == () and result.unknown_fins == layout.names
    assert "not reached" not in str(
        result
    ) and "the method does not know these fins: front_right" in str(result)
    for method in ("dual", "sqp"):
        answer = Allocator(strange, method).allocate(WRENCH)
        assert answer.reachable and answer.unknown_fins == ()


@pytest.mark.parametrize("method", OF_FINS)
def test_without_its_force_table_no_method_answers(method: str, tmp_path: Path) -> None:
    allocator = quick_allocator(method)
    layout = load_layout("A")
    table = FinModelSpec("table", (("path", str(tmp_path / "gone.csv")),))
    tables = replace(layout, actuators=tuple(replace(fin, model=table) for fin in layout.fins))
    for answer in (
        allocator.allocate,
        lambda *asked, **how: allocator.allocate_batch(*asked, **how),
    ):
        with pytest.raises(DataError, match=r"gone\.csv: no such file, expected a CSV table"):
            answer(
                tables, WRENCH if answer == allocator.allocate else [WRENCH], lost=["front_left"]
            )


def test_an_axis_that_nothing_drives_is_told_where_it_is_asked_for() -> None:
    allocator = Allocator(load_layout("no_yaw"))
    assert any(
        "no actuator gives Tz" in note for note in allocator.allocate([1, 0, 0.5, 0, 0, 0.1]).notes
    )
    assert not any("no actuator" in note for note in allocator.allocate([1, 0, 0.5, 0, 0, 0]).notes)


POLICIES = (
    "direction",
    "priority",
    Policy(axis_weights=(1.0, 1.0, 10.0, 1.0, 1.0, 0.1)),
    Policy("priority", order=(("Tz",), ("Fx", "Fz"))),
)
"""A policy of each kind, and weights of axes."""


def wrenches(n: int = 6) -> np.ndarray:
    """Wrenches of which the later ones are out of reach."""
    size = np.geomspace(0.1, 30.0, n)[:, None]
    return size * np.random.default_rng(0).normal(size=(n, 6)) * [1.0, 0.3, 1.0, 0.05, 0.05, 0.1]


def test_a_batch_errs_as_little_as_single_calls() -> None:
    allocator = AllocatorCache()
    layout = load_layout("A")
    targets = wrenches(20)
    batch = allocator.allocate_batch(layout, targets)
    errors = np.array([allocator.allocate(layout, target).err_norm for target in targets])
    np.testing.assert_allclose(batch.err_norm, errors, rtol=1e-6, atol=1e-5)


def test_weights_move_the_error_off_the_heavy_axis() -> None:
    allocator = AllocatorCache()
    layout = load_layout("A")
    targets = wrenches(20)
    batch = allocator.allocate_batch(layout, targets)
    weighted = allocator.allocate_batch(
        layout, targets, policy=Policy(axis_weights=(1, 1, 10, 1, 1, 1))
    )
    heave = np.abs(weighted.unallocated[:, 2]) - np.abs(batch.unallocated[:, 2])
    assert (heave <= 1e-2).all() and heave.min() < -0.01


@pytest.mark.parametrize("method", OF_FINS)
def test_empty_batches_have_the_shapes_of_full_ones(method: str) -> None:
    layout = load_layout("A")
    batch = quick_allocator(method).allocate_batch(layout, np.empty((0, 6)))
    assert batch.command.shape == batch.forces.shape == (0, 4, 3) and batch.wrench.shape == (0, 6)
    assert (
        batch.err_norm.shape
        == batch.effort.shape
        == batch.solve_ms.shape
        == batch.reachable.shape
        == (0,)
    )


@pytest.mark.parametrize("method", OF_FINS)
def test_batches_carry_the_note_about_unknown_fins(method: str) -> None:
    layout = load_layout("A")
    strange = layout.replace_actuator("back_left", model=FinModelSpec("lighthill"))
    batch = quick_allocator(method).allocate_batch(strange, wrenches(2))
    assert batch.unknown_fins == (("back_left",) if method == "paper" else ())
    assert len(batch.notes) == len(batch.unknown_fins) and all(
        "back_left" in note for note in batch.notes
    )


def test_a_method_that_does_not_know_the_policy_says_so_at_once() -> None:
    allocator = AllocatorCache("analytic")
    layout = load_layout("A")
    for policy in ("priority", Policy(axis_weights=(2.0, 1.0, 1.0, 1.0, 1.0, 1.0))):
        with pytest.raises(AllocationError, match="minimizes the plain error"):
            allocator.allocate_batch(layout, [[0.1, 0, 0, 0, 0, 0]], policy=policy)
    with pytest.raises(AllocationError, match="damage: expected a Damage, got 'weak'"):
        allocator.allocate_batch(layout, [[0.1, 0, 0, 0, 0, 0]], damage="weak")  # type: ignore[arg-type]
