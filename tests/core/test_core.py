"""The core as Python calls it: sizes of both languages, damaged blocks, arguments, one answer and
many."""

import ctypes
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from finlab.allocation import Policy
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.policy import CLOSEST
from finlab.arrays import Array
from finlab.core.calls import Conditions, Core, error_text
from finlab.core.fields import actuators_of, constant, head_of, struct, tables_begin
from finlab.core.library import library
from finlab.errors import CommandError, DataError
from finlab.layout import Layout
from tests.mixed_robots import KINDS, bluerov2_heavy, load, random_plant, random_robot, within

BLOCK = constant("FL_BAD_BLOCK")
"""FL_BAD_BLOCK: no block of a robot."""
NUMBER = constant("FL_BAD_NUMBER")
"""FL_BAD_NUMBER: a number out of range."""


def core_of_layout(layout: Layout) -> Core:
    return Compiled.of(layout).core


@pytest.fixture(scope="module")
def heavy() -> Core:
    return core_of_layout(load(bluerov2_heavy()))


def test_both_languages_agree_on_what_a_block_is(heavy: Core) -> None:
    core = library()
    names = ["fl_head", "fl_actuator", "fl_policy", "fl_answer"]
    for name in names:
        assert constant(f"sizeof {name}") == struct(name).itemsize, name
    assert core.fl_check(heavy._block.ctypes.data, len(heavy._block)) == 0


def checked(block: Array) -> int:
    code: int = library().fl_check(block.ctypes.data, len(block))
    return code


@pytest.mark.parametrize(
    ("field", "value", "code"),
    [
        ("magic", 7.0, BLOCK),
        ("version", constant("FL_VERSION") + 1.0, 2),
        ("length", 1e6, BLOCK),
        ("n", 0.0, BLOCK),
        ("n", 65.0, BLOCK),
        ("rank", 2.5, BLOCK),
        ("axis_scale", 0.0, NUMBER),
        ("effectiveness_normalized", np.nan, NUMBER),
        ("rows", 3.0, BLOCK),
        ("force_table", 1e9, BLOCK),
        ("force_table", 0.5, BLOCK),
        ("force_scale", -1.0, NUMBER),
    ],
)
def test_a_damaged_block_is_refused(heavy: Core, field: str, value: float, code: int) -> None:
    block = heavy._block.copy()
    names = struct("fl_head").names
    assert names is not None
    owner = head_of(block) if field in names else actuators_of(block)[:1]
    owner[field] = value
    assert checked(block) == code
    with pytest.raises(DataError, match=re.escape(error_text(code))):
        Core(block, 8)


@pytest.mark.parametrize("kind", ["azimuths", "fins uneven", "rudders"])
def test_no_number_of_a_block_may_be_none(kind: str) -> None:
    """Every field of the head and of every actuator, and every number of a table."""
    block = core_of_layout(load(random_robot(kind, 1, 3)))._block
    assert checked(block) == 0
    tables = np.random.default_rng(0).integers(
        tables_begin(int(head_of(block)["n"])), len(block), 50
    )
    for place in [*range(tables_begin(int(head_of(block)["n"]))), *tables.tolist()]:
        for bad in (np.nan, np.inf):
            damaged = block.copy()
            damaged[place] = bad
            assert checked(damaged) != 0, f"number {place} is {bad}"


def test_a_block_cut_short_is_refused(heavy: Core) -> None:
    for length in (0, 1, tables_begin(0), len(heavy._block) - 1):
        assert checked(heavy._block[:length].copy()) != 0


def test_what_is_no_number_is_refused(heavy: Core) -> None:
    wrench = np.zeros(6)
    multipliers = np.zeros(6)
    for bad in (np.nan, np.inf):
        with pytest.raises(CommandError, match="not finite or out of range"):
            heavy.answer_one(np.where(np.arange(6) == 2, bad, wrench), None)
        # Multipliers are where to begin: those of no use are left out.
        assert heavy.answer_one(
            wrench, None, np.where(np.arange(6) == 2, bad, multipliers)
        ).is_attainable[0]
    with pytest.raises(CommandError, match="not finite or out of range"):
        heavy.answer_one(
            wrench, None, conditions=Conditions(command_previous=np.full((8, 3), np.inf))
        )
    nothing_known = Conditions(command_previous=np.full((8, 3), np.nan))
    assert heavy.answer_one(wrench, None, conditions=nothing_known).is_attainable[0]


@pytest.mark.parametrize("kind", KINDS)
def test_one_and_many_are_the_same(kind: str) -> None:
    core = core_of_layout(load(random_robot(kind, 1, 3)))
    plant = random_plant(kind, 1, 3)
    targets = np.array([within(plant, np.random.default_rng([3, k])) for k in range(6)])
    targets[::2] *= 3.0
    policy = core_policy(Policy("direction"))
    many = core.answer_many(targets, policy)
    for row, target in enumerate(targets):
        single = core.answer_one(target, policy)
        np.testing.assert_array_equal(many.command[row], single.command[0])
        np.testing.assert_array_equal(many.wrench_served[row], single.wrench_served[0])
        assert many.is_attainable[row] == single.is_attainable[0]


def test_one_and_many_say_which_searches_were_truncated() -> None:
    core = core_of_layout(load(random_robot("fins", 1, 3)))
    settings = np.zeros(1, struct("fl_settings"))  # no part of a set with a gap is looked at
    use_settings = library().fl_use_settings
    use_settings.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    assert use_settings(core._work_address, settings.ctypes.data) == 0
    plant = random_plant("fins", 1, 3)
    targets = np.array([within(plant, np.random.default_rng([3, k])) for k in range(8)])
    truncated = [core.answer_one(target, None).is_truncated for target in targets]
    assert any(truncated) and not all(truncated)
    for target, is_truncated in zip(targets, truncated, strict=True):
        assert core.answer_many(target[None], None).is_truncated == is_truncated
    assert core.answer_many(targets, None).is_truncated


def test_threads_share_one_robot(heavy: Core) -> None:
    targets = np.random.default_rng(0).normal(0.0, 20.0, (2000, 6))
    closest = core_policy(CLOSEST)
    with ThreadPoolExecutor(4) as pool:
        shared = list(
            pool.map(lambda target: heavy.answer_one(target, closest).wrench_served[0], targets)
        )
    np.testing.assert_array_equal(shared, heavy.answer_many(targets, closest).wrench_served)
