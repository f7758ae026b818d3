"""`finlab.core.calls.Core`, the core as Python calls it: structs as long as in C, refusals as
errors, and the same answers one by one, in a batch and from several threads."""

import ctypes
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from finlab.allocation import Policy
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.policy import CLOSEST
from finlab.core import library
from finlab.core.calls import NOMINAL, Conditions, Core, error_text
from finlab.core.fields import constant, head_of, struct
from finlab.errors import CommandError, DataError
from finlab.layout import Layout
from tests.random_robots import KINDS, bluerov2_heavy, load, random_plant, random_robot, within


def core_of_layout(layout: Layout) -> Core:
    """The core of a robot, as the default method makes it."""
    return Compiled.of(layout).core


@pytest.fixture(scope="module")
def heavy() -> Core:
    """The core of eight thrusters."""
    return core_of_layout(load(bluerov2_heavy()))


def test_both_languages_agree_on_what_a_block_is(heavy: Core) -> None:
    core = library()
    names = ["fl_head", "fl_actuator", "fl_policy", "fl_answer"]
    for name in names:
        assert constant(f"sizeof {name}") == struct(name).itemsize, name
    assert core.fl_check(heavy._block.ctypes.data, len(heavy._block)) == 0


@pytest.mark.parametrize(
    ("field", "value", "code"),
    [
        ("magic", 7.0, "FL_BAD_BLOCK"),
        ("version", constant("FL_VERSION") + 1.0, "FL_BAD_VERSION"),
        ("axis_scale", 0.0, "FL_BAD_NUMBER"),
    ],
)
def test_a_block_that_fl_check_refuses_is_an_error_with_its_text(
    heavy: Core, field: str, value: float, code: str
) -> None:
    """What `fl_check` refuses is in `test_block_check.py`."""
    block = heavy._block.copy()
    head_of(block)[field] = value
    with pytest.raises(DataError, match=re.escape(error_text(constant(code)))):
        Core(block, 8)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_wrench_that_is_not_finite_is_refused(heavy: Core, bad: float) -> None:
    wrench = np.zeros(6)
    wrench[2] = bad
    with pytest.raises(CommandError, match="not finite or out of range"):
        heavy.answer_one(wrench, None)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_multipliers_to_begin_with_that_are_not_finite_are_left_out(
    heavy: Core, bad: float
) -> None:
    multipliers = np.zeros(6)
    multipliers[2] = bad
    assert heavy.answer_one(np.zeros(6), None, multipliers).is_attainable[0]


def test_commands_of_the_tick_before_may_be_unknown_but_not_infinite(heavy: Core) -> None:
    infinite = Conditions(previous=np.full((8, 3), np.inf))
    with pytest.raises(CommandError, match="not finite or out of range"):
        heavy.answer_one(np.zeros(6), None, conditions=infinite)
    unknown = Conditions(previous=np.full((8, 3), np.nan))
    assert heavy.answer_one(np.zeros(6), None, conditions=unknown).is_attainable[0]


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
        # To rounding: lanes divide and add in another order.
        np.testing.assert_allclose(many.command[row], single.command[0], 1e-9, 1e-9)
        np.testing.assert_allclose(many.wrench_served[row], single.wrench_served[0], 1e-12, 1e-12)
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


def test_threads_share_one_robot_for_batches(heavy: Core) -> None:
    """Each batch has what it would have alone, to the bit, whatever it is answered beside."""
    rng = np.random.default_rng(0)
    closest = core_policy(CLOSEST)
    lost = np.arange(8) == 3
    batches = []
    for k in range(12):
        conditions = NOMINAL if k % 2 else Conditions(lost=lost)
        batches.append((rng.normal(0.0, 15.0, (1500, 6)), closest, conditions))
    alone = [heavy.answer_many(*batch) for batch in batches]
    with ThreadPoolExecutor(4) as pool:
        at_once = list(pool.map(lambda batch: heavy.answer_many(*batch), batches))
    for one, other in zip(alone, at_once, strict=True):
        for values, other_values in zip(one, other, strict=True):
            np.testing.assert_array_equal(values, other_values)
