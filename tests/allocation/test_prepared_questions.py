"""Questions that are asked again and again are prepared: answers, errors and copies are those of the
first question, with builtin functions and without."""

import pickle
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocation, Policy
from finlab.allocation.allocator import Allocator
from finlab.allocation.robot_state import MAX_POLICIES
from finlab.allocation.solution import equal
from finlab.arrays import Array
from finlab.core import prepared_call
from finlab.errors import CommandError, FinlabError

ROBOTS = ("bluerov2_heavy", "A", "turtle_hybrid", "catamaran", "torpedo")
"""Shipped robots; foils of the last are out of what is prepared in a flow alone."""
LAZY = ("wrench", "err_norm", "power", "bound", "notes", "multipliers", "target", "policy", "seed")
"""What a result tells beside its command."""


@pytest.fixture(params=["builtin function", "ctypes"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """How the core is called."""
    if request.param == "ctypes":
        monkeypatch.setattr(prepared_call, "has_builtin_functions", lambda: False)
    yield request.param


@cache
def first_answer(robot: str) -> Allocation:
    """An answer of an allocator that was never asked before."""
    return Allocator(finlab.load_layout(robot)).allocate(target_of(robot))


@cache
def target_of(robot: str) -> tuple[float, ...]:
    """A wrench (6,) half way to the rim."""
    layout = finlab.load_layout(robot)
    allocator = Allocator(layout)
    direction = np.array([1.0, 0.2, 0.1, 0.05, 0.1, 0.2]) * allocator.scale * layout.commanded
    most = allocator.allocate_batch(50.0 * direction[None], policy="direction").wrench[0]
    return tuple((0.5 * most * layout.commanded).tolist())


def is_prepared(result: Allocation) -> bool:
    """Whether a result is that of a prepared question."""
    return "_asked" in vars(result)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_third_answer_is_the_first_one(robot: str, way: str) -> None:
    allocator = Allocator(finlab.load_layout(robot))
    results = [allocator.allocate(target_of(robot)) for _ in range(4)]
    first = first_answer(robot)
    for result in results:
        assert result == first
        assert np.array_equal(result.command, first.command)
        assert result.previous is None
        assert result.damage == first.damage
        assert result.solve_ms > 0.0
        for name in LAZY:
            assert equal(getattr(result, name), getattr(first, name)), name
    if robot != "torpedo":
        assert [is_prepared(result) for result in results[:2]] == [False, way != "ctypes"]


@pytest.mark.parametrize(
    "question",
    [
        {"policy": "direction"},
        {"policy": "priority"},
        {"policy": Policy("closest", axis_weights=(1.0, 2.0, 1.0, 1.0, 1.0, 3.0))},
        {"lost": ["front_left"]},
        {"lost": ("front_left",), "policy": "direction"},
        {"free": ("Ty",)},
        {"damage": finlab.Damage(weak={"front_left": 0.5})},
    ],
    ids=str,
)
@pytest.mark.parametrize("times", [1.0, 4.0], ids=["within", "beyond"])
def test_the_same_of_other_questions(question: dict[str, Any], times: float, way: str) -> None:
    robot = "bluerov2_heavy"
    layout = finlab.load_layout(robot)
    target = times * np.array(target_of(robot))
    first = Allocator(layout).allocate(target, **question)
    allocator = Allocator(layout)
    for _ in range(3):
        result = allocator.allocate(target, **question)
        assert result == first
        assert np.array_equal(result.command, first.command, equal_nan=True)
    assert is_prepared(result) == (way != "ctypes")
    assert result.lost == first.lost
    assert result.notes == first.notes


@pytest.mark.parametrize("robot", ROBOTS[:4])
def test_the_same_in_ticks(robot: str, way: str) -> None:
    layout = finlab.load_layout(robot)
    target = np.array(target_of(robot))
    allocator = Allocator(layout)
    before = allocator.allocate(0.8 * target)
    for k in range(4):
        share = 0.8 + 0.05 * k
        fresh = Allocator(layout)
        for previous in (before.command, before):
            result = allocator.allocate(share * target, previous=previous)
            expected = fresh.allocate(share * target, previous=previous)
            assert np.abs(result.command - expected.command).max() <= 1e-9
            assert np.array_equal(result.previous, before.command)
            assert result.calm_power == pytest.approx(expected.calm_power, abs=1e-9)
            assert result.bound == pytest.approx(expected.bound, rel=1e-9)
        before = result
    assert is_prepared(result) == (way != "ctypes")


def test_results_stay_as_they_are(way: str) -> None:
    allocator = Allocator(finlab.load_layout("bluerov2_heavy"))
    target = np.array(target_of("bluerov2_heavy"))
    shares = np.linspace(0.1, 1.0, 100)
    results = [allocator.allocate(share * target) for share in shares]
    commands = [result.command.copy() for result in results]
    for share, result, command in zip(shares, results, commands, strict=True):
        assert np.array_equal(result.command, command)
        assert np.array_equal(result.target, share * target)
        assert result.err_norm < 1e-6
        with pytest.raises(ValueError, match="read-only"):
            result.command[0, 0] = 1.0
        with pytest.raises(ValueError, match="read-only"):
            result.target[0] = 1.0


def test_copies_and_other_commands_of_a_result(way: str) -> None:
    allocator = Allocator(finlab.load_layout("bluerov2_heavy"))
    target = target_of("bluerov2_heavy")
    for _ in range(3):
        result = allocator.allocate(target)
    copy = pickle.loads(pickle.dumps(result))
    assert copy == result
    assert copy.answered is None
    halved = result.with_command(0.5 * result.command)
    assert halved.err_norm > 0.1
    assert str(copy) == str(result)


def test_figures_are_found_once(way: str) -> None:
    allocator = Allocator(finlab.load_layout("fish"))
    for _ in range(3):
        result = allocator.allocate(target_of("fish"))
    for name in ("forces", "wrench", "unallocated", "bound", "notes"):
        assert name not in vars(result)
        found = getattr(result, name)
        assert vars(result)[name] is found
        assert getattr(result, name) is found


def test_bound_and_power_are_those_of_a_first_answer(way: str) -> None:
    allocator = Allocator(finlab.load_layout("fish"))
    target = target_of("fish")
    for _ in range(3):
        result = allocator.allocate(target)
    bound = result.bound  # before anything else is known of the answer
    assert bound is not None
    assert bound == first_answer("fish").bound
    assert 0.0 < bound <= result.power * (1.0 + 1e-9)
    tables = str(result).partition("effort")[0]  # behind which stands the time
    assert tables == str(first_answer("fish")).partition("effort")[0]


BAD: list[tuple[Any, str]] = [
    ([1.0, 2.0], "six numbers"),
    ([float("nan"), 0, 0, 0, 0, 0], "free="),
    ([2e12, 0, 0, 0, 0, 0], "at most 1e"),
    ("abcdef", "six numbers"),
    ([True, 0, 0, 0, 0, 0], "six numbers"),
    (None, "six numbers"),
]
"""Wrenches that are refused, and a part of the sentence."""


@pytest.mark.parametrize(("wrench", "words"), BAD, ids=[repr(wrench) for wrench, _ in BAD])
def test_refusals_are_those_of_the_first_question(wrench: Any, words: str, way: str) -> None:
    allocator = Allocator(finlab.load_layout("bluerov2_heavy"))
    sentences = []
    for _ in range(3):
        with pytest.raises(CommandError, match=words) as refusal:
            allocator.allocate(wrench)
        sentences.append(str(refusal.value))
        allocator.allocate(target_of("bluerov2_heavy"))
    assert len(set(sentences)) == 1


@pytest.mark.parametrize(
    "question",
    [
        {"policy": "sideways"},
        {"policy": ["closest"]},
        {"policy": 3},
        {"previous": np.zeros((7, 3))},
        {"previous": np.full((8, 3), np.inf)},
        {"seed": -1},
        {"seed": False},
        {"lost": ["nobody"]},
    ],
    ids=str,
)
def test_other_arguments_are_refused_as_ever(question: dict[str, Any], way: str) -> None:
    allocator = Allocator(finlab.load_layout("bluerov2_heavy"))
    target = target_of("bluerov2_heavy")
    for _ in range(3):
        allocator.allocate(target)
        with pytest.raises(FinlabError):
            allocator.allocate(target, **question)


def test_policies_of_any_number_are_answered(way: str) -> None:
    allocator = Allocator(finlab.load_layout("bluerov2_heavy"))
    target = 4.0 * np.array(target_of("bluerov2_heavy"))
    fresh: list[Array] = []
    policies = [Policy(axis_weights=(1.0, 1.0, 1.0, 1.0, 1.0, 1.0 + k)) for k in range(12)]
    assert len(policies) > MAX_POLICIES
    for policy in policies:
        fresh.append(Allocator(allocator.layout).allocate(target, policy=policy).command)
    for _ in range(3):
        for policy, command in zip(policies, fresh, strict=True):
            result = allocator.allocate(target, policy=policy)
            assert np.array_equal(result.command, command)
