"""Single questions as a function of Python that calls C without ctypes: the answers of
`Core.answer_row`, and nothing where it has to be asked."""

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.dual.outer_iterations import coupled_core
from finlab.allocation.policy import CLOSEST, POLICY_NAMES, as_policy
from finlab.arrays import Array
from finlab.core.calls import NOMINAL, ROWS, AnswerMemory, AnswerRow, Conditions, Core
from finlab.core.coupled_core import CoupledCore
from finlab.core.prepared_call import Answer, has_builtin_functions, prepared_call
from finlab.interaction.jets import Jets
from finlab.layout import load_layout
from finlab.physics.plant import Plant, plant_of

ROBOTS = ("bluerov2_heavy", "bluerov2", "A", "turtle_hybrid", "catamaran", "fish")
"""Shipped robots of every kind of command but foils."""
MOST_ERROR = 1e-6
"""Error up to which commands are exact."""
MOST_WRENCH = 1e6
"""Largest wrench."""

pytestmark = pytest.mark.skipif(not has_builtin_functions(), reason="not of this interpreter")


def core_of(robot: str) -> Core:
    """The core of a shipped robot."""
    return Compiled.of(load_layout(robot)).core


def prepared(core: Core, policy: str = "closest", conditions: Conditions = NOMINAL) -> Answer:
    """A question to it, of which all but the wrench is known."""
    record = core_policy(as_policy(policy))  # type: ignore[arg-type]
    call = prepared_call(core, record, conditions, 2.0, MOST_WRENCH, MOST_ERROR)
    assert call is not None
    return call.answer


def wrenches_of(core: Core, count: int, size: float = 1.0) -> Array:
    """Wrenches (N, 6) [N, N m], some within reach and some beyond."""
    rng = np.random.default_rng(59)
    return np.asarray(size * rng.normal(size=(count, 6)) * np.geomspace(0.1, 20.0, count)[:, None])


def assert_same(got: AnswerRow | None, expected: AnswerRow) -> None:
    """Fails unless two answers have the same bits."""
    if not expected.is_finished:
        assert got is None
        return
    assert got is not None
    assert got.is_met is expected.is_met
    assert got.is_finished is True
    assert np.array_equal(got.command, expected.command, equal_nan=True)
    assert not got.command.flags.writeable
    for name in ("wrench", "multipliers", "wrench_served", "gap_power_bound"):
        assert np.array_equal(getattr(got, name), getattr(expected, name)), name
    assert np.array_equal(got.copied().force, expected.copied().force)


@pytest.mark.parametrize("policy", POLICY_NAMES)
@pytest.mark.parametrize("robot", ROBOTS)
def test_answers_are_those_of_answer_row(robot: str, policy: str) -> None:
    core = core_of(robot)
    record = core_policy(as_policy(policy))  # type: ignore[arg-type]
    answer = prepared(core, policy)
    for wrench in wrenches_of(core, 12):
        expected = core.answer_row(wrench, record, None, NOMINAL, MOST_ERROR)
        assert_same(answer(wrench, None, None), expected)


@pytest.mark.parametrize("robot", ROBOTS)
def test_answers_in_a_tick_are_those_of_answer_row(robot: str) -> None:
    core = core_of(robot)
    record = core_policy(as_policy("direction"))
    answer = prepared(core, "direction")
    previous = core.answer_row(wrenches_of(core, 1)[0], record, None, NOMINAL, -1.0).command
    multipliers: Array | None = None
    for wrench in wrenches_of(core, 12):
        conditions = Conditions(previous=previous, calm=2.0)
        expected = core.answer_row(wrench, record, multipliers, conditions, MOST_ERROR)
        got = answer(wrench, previous, multipliers)
        assert_same(got, expected)
        if got is not None:
            assert got.previous is not None
            assert np.array_equal(got.previous, previous)
        previous = expected.command
        multipliers = expected.multipliers[0]


def test_losses_and_free_axes_are_those_that_are_prepared() -> None:
    core = core_of("bluerov2_heavy")
    record = core_policy(as_policy("closest"))
    lost = np.arange(8) == 2
    free = np.arange(6) == 4
    for conditions in (Conditions(lost=lost), Conditions(free=free), Conditions(None, lost, free)):
        answer = prepared(core, conditions=conditions)
        for wrench in wrenches_of(core, 6):
            expected = core.answer_row(wrench, record, None, conditions, MOST_ERROR)
            assert_same(answer(wrench, None, None), expected)


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "A", "fish"])
def test_bounds_are_those_of_power_bounds(robot: str) -> None:
    layout = load_layout(robot)
    compiled = Compiled.of(layout)
    core = compiled.core
    margins = compiled.conjugate_margins
    formulas = plant_of(layout).counting(layout.commanded).formulas
    assert formulas is not None
    lost = np.arange(core.n) == 1
    free = np.arange(6) == 0
    previous = core.answer_row(wrenches_of(core, 1)[0], None, None, NOMINAL, -1.0).command
    for conditions in (NOMINAL, Conditions(lost=lost), Conditions(free=free)):
        call = prepared_call(core, core_policy(CLOSEST), conditions, 2.0, MOST_WRENCH, MOST_ERROR)
        assert call is not None
        power_bound = call.power_bounds(formulas, margins)
        found = 0
        for wrench in wrenches_of(core, 12):
            for before in (None, previous):
                row = call.answer(wrench, before, None)
                if row is None:
                    continue
                figures = formulas.figures(row.command)
                assert figures is not None
                given = figures.wrench[None]
                if conditions.free is not None:
                    given = np.where(free, 0.0, given)
                asked = conditions._replace(previous=before)
                expected = core.power_bounds(row.multipliers, given, margins, asked)
                assert power_bound(row) == (None if row.gap_power_bound[0] else expected[0])
                found += expected[0] > 0.0
        assert found


def test_a_busy_work_area_is_left_alone_by_bounds() -> None:
    layout = load_layout("A")
    compiled = Compiled.of(layout)
    core = compiled.core
    formulas = plant_of(layout).formulas
    assert formulas is not None
    call = prepared_call(core, core_policy(CLOSEST), NOMINAL, 2.0, MOST_WRENCH, MOST_ERROR)
    assert call is not None
    row = call.answer([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], None, None)
    assert row is not None
    power_bound = call.power_bounds(formulas, compiled.conjugate_margins)
    bound = power_bound(row)
    assert bound is not None
    core._is_busy[0] = 1
    assert power_bound(row) is None
    core._is_busy[0] = 0
    assert power_bound(row) == bound


def test_a_wrench_may_be_any_six_plain_numbers() -> None:
    core = core_of("bluerov2_heavy")
    answer = prepared(core)
    wrench = np.array([3.0, -2.0, 1.0, 0.0, 1.0, -1.0])
    expected = core.answer_row(wrench, core_policy(as_policy("closest")), None, NOMINAL, MOST_ERROR)
    spread = np.zeros((6, 2))
    spread[:, 1] = wrench
    wholes = [int(number) for number in wrench]
    forms = (
        wrench,
        wrench.tolist(),
        tuple(wrench.tolist()),
        wholes,
        spread[:, 1],
        wrench[::-1][::-1],
    )
    for form in forms:
        assert_same(answer(form, None, None), expected)


USUAL = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
"""A wrench within reach."""


@pytest.mark.parametrize(
    "wrench",
    [
        None,
        "123456",
        7.0,
        USUAL[:5],
        [*USUAL, 0.0],
        [True, *USUAL[1:]],
        ["1", *USUAL[1:]],
        [10**400, *USUAL[1:]],
        [float("nan"), *USUAL[1:]],
        [float("inf"), *USUAL[1:]],
        [2e6, *USUAL[1:]],
        np.array(USUAL, np.float32),
        np.array(USUAL, np.int64),
        np.array(USUAL, ">f8"),
        np.array(USUAL, object),
        np.array([USUAL]),
        np.array(USUAL[:5]),
        np.array([*USUAL, 0.0]),
        np.array([np.nan, *USUAL[1:]]),
        np.array(5.0),
        np.ma.masked_array(USUAL),
    ],
    ids=lambda wrench: repr(wrench)[:40],
)
def test_all_else_is_left_to_who_says_what_is_wrong(wrench: Any) -> None:
    answer = prepared(core_of("bluerov2_heavy"))
    assert answer(wrench, None, None) is None
    assert answer(USUAL, None, None) is not None  # no error was left behind


@pytest.mark.parametrize(
    "previous",
    [
        np.zeros((7, 3)),
        np.zeros((8, 2)),
        np.zeros(24),
        np.zeros((8, 3), np.float32),
        np.full((8, 3), np.inf),
        np.zeros((8, 3)).tolist(),
        "previous",
    ],
    ids=lambda previous: repr(previous)[:30],
)
def test_a_command_before_of_another_form_is_left_too(previous: Any) -> None:
    answer = prepared(core_of("bluerov2_heavy"))
    assert answer(USUAL, previous, None) is None
    assert answer(USUAL, None, np.zeros(5)) is None
    assert answer(USUAL, np.zeros((8, 3)), None) is not None


def test_a_question_without_all_arguments_is_left() -> None:
    answer: Any = prepared(core_of("bluerov2_heavy"))
    assert answer() is None
    assert answer(USUAL) is None


def test_nothing_is_answered_while_a_batch_has_the_work_area() -> None:
    core = core_of("bluerov2_heavy")
    answer = prepared(core)
    core._is_busy[0] = 1
    assert answer(USUAL, None, None) is None
    core._is_busy[0] = 0
    assert answer(USUAL, None, None) is not None
    core.answer_many(wrenches_of(core, 5), None)
    assert answer(USUAL, None, None) is not None


def test_answers_stay_as_they_are_when_others_follow() -> None:
    core = core_of("bluerov2_heavy")
    answer = prepared(core)
    wrenches = wrenches_of(core, 3 * ROWS)
    rows = [answer(wrench, None, None) for wrench in wrenches]
    copies = [None if row is None else row.command.copy() for row in rows]
    again = [answer(wrench, None, None) for wrench in wrenches]
    for row, copy, other in zip(rows, copies, again, strict=True):
        assert row is not None
        assert other is not None
        assert np.array_equal(row.command, copy)
        assert np.array_equal(row.command, other.command)


def test_memory_is_given_back_when_nobody_holds_an_answer() -> None:
    core = core_of("bluerov2_heavy")
    answer: Answer | None = prepared(core)
    assert answer is not None
    row: AnswerRow | None = answer(USUAL, None, None)
    assert row is not None
    memory: weakref.ref[AnswerMemory] = weakref.ref(row.memory)
    command = row.command
    for _ in range(ROWS):
        row = answer(USUAL, None, None)
    assert memory() is None
    assert np.isfinite(command).all()  # the numbers live as long as their view
    assert row is not None
    last = weakref.ref(row.memory)
    row = None
    answer = None
    gc.collect()
    assert last() is None


COUPLED = ("bluerov2_heavy", "A", "turtle_hybrid")
"""Shipped robots that are asked with jets."""


def with_jets(robot: str) -> CoupledCore:
    """A shipped robot in the core, whose actuators act on each other."""
    layout = load_layout(robot)
    return coupled_core(Plant(replace(layout, interaction=Jets())), Compiled.of(layout))


def prepared_with_jets(core: CoupledCore, policy: str, conditions: Conditions) -> Answer:
    """A question to it, of which all but the wrench is known."""
    record = core_policy(as_policy(policy))  # type: ignore[arg-type]
    call = prepared_call(core, record, conditions, 2.0, MOST_WRENCH, MOST_ERROR)
    assert call is not None
    return call.answer


@pytest.mark.parametrize("policy", ["closest", "direction"])
@pytest.mark.parametrize("robot", COUPLED)
def test_answers_with_jets_are_those_of_answer_row(robot: str, policy: str) -> None:
    core = with_jets(robot)
    record = core_policy(as_policy(policy))  # type: ignore[arg-type]
    lost = np.arange(core.n) == 1
    plain = core_of(robot)
    answered = 0
    for conditions in (NOMINAL, Conditions(lost=lost)):
        answer = prepared_with_jets(core, policy, conditions)
        for wrench in wrenches_of(plain, 6):
            expected = core.answer_row(wrench, record, None, conditions, MOST_ERROR)
            assert_same(answer(wrench, None, None), expected)
            answered += expected.is_finished
    assert answered > 0


def test_ticks_with_jets_are_those_of_answer_row() -> None:
    core = with_jets("bluerov2_heavy")
    record = core_policy(as_policy("direction"))
    answer = prepared_with_jets(core, "direction", NOMINAL)
    wrenches = wrenches_of(core_of("bluerov2_heavy"), 8)
    previous = core.answer_row(wrenches[0], record, None, NOMINAL, -1.0).command
    for wrench in wrenches:
        conditions = Conditions(previous=previous, calm=2.0)
        expected = core.answer_row(wrench, record, None, conditions, MOST_ERROR)
        assert_same(answer(wrench, previous, None), expected)
        previous = expected.command


def test_an_interaction_that_asks_python_has_no_prepared_call() -> None:
    core = with_jets("bluerov2_heavy")
    offset = core._wrench_offset._replace(core_constants=None)
    asking = CoupledCore(Compiled.of(load_layout("bluerov2_heavy")).block, offset)
    assert prepared_call(asking, None, NOMINAL, 2.0, MOST_WRENCH, MOST_ERROR) is None
