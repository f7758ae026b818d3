"""Batches in vector lanes: the answers of single questions, the same bits whatever the width of the
vectors and whatever else is in the batch."""

import ctypes
import platform
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.allocation import Policy
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.core import library
from finlab.core.calls import NOMINAL, Conditions, Core, widest_lanes
from finlab.core.fields import constant
from finlab.layout import Layout, load_layout
from finlab.physics.plant import plant_of
from tests.core.internal_functions import Work
from tests.random_robots import KINDS, beyond, load, random_plant, random_robot, within

NONE, BASELINE, AVX2, AVX512 = 1, 2, 4, 8
"""Lanes: none, so that each target is a question of its own; those that every machine has, and
those of its widest vectors."""
WIDTHS = [lanes for lanes in (BASELINE, AVX2, AVX512) if lanes <= widest_lanes()]
"""What this machine can run."""
SAME = 1e-9
"""Up to which answers of lanes are those of single questions."""
DIRECTION = core_policy(Policy("direction"))
CONDITIONS = ("whole", "lost", "free")
"""Conditions of a robot: the first actuator lost, or an axis free."""


def code_of_many(
    core: Core, lanes: int, wrenches: Array, conditions: Conditions = NOMINAL
) -> tuple[int, dict[str, Array]]:
    """What `fl_answer_many` returns, and its answers by their names."""
    wrenches = np.ascontiguousarray(wrenches)
    count = len(wrenches)
    answers: dict[str, Any] = {
        "force": np.full((count, core.n, 2), np.nan),
        "multipliers": np.full((count, 6), np.nan),
        "wrench_served": np.full((count, 6), np.nan),
        "gap_power_bound": np.full(count, np.nan),
        "command": np.full((count, core.n, 3), np.nan),
        "is_attainable": np.zeros(count, np.bool_),
        "error": np.full(count, np.nan),
        "is_truncated": np.ones(count, np.bool_),
    }
    core._question.write(DIRECTION, None, conditions)
    addresses = [values.ctypes.data for values in answers.values()]
    code = library().fl_answer_many(
        core._block_address,
        core._work_address,
        core._question.address,
        lanes,
        wrenches.ctypes.data,
        count,
        *addresses,
    )
    return code, answers


def many(
    core: Core, lanes: int, wrenches: Array, conditions: Conditions = NOMINAL
) -> dict[str, Array]:
    """Answers of `fl_answer_many` by their names, where it refuses nothing."""
    code, answers = code_of_many(core, lanes, wrenches, conditions)
    assert code == constant("FL_OK")
    return answers


def conditions_of(name: str, n: int) -> Conditions:
    """Conditions of a robot of n actuators, by their name in `CONDITIONS`."""
    if name == "lost":
        return Conditions(lost=np.arange(n) == 0)
    if name == "free":
        return Conditions(free=np.arange(6) == 4)
    return NOMINAL


def some_wrenches(kind: str, number: int, seed: int) -> Array:
    """Wrenches (13, 6) of a random robot, within reach, near its rim, and beyond it."""
    plant = random_plant(kind, number, seed)
    rng = np.random.default_rng([seed, number])
    near = [within(plant, rng) for _ in range(8)]
    far = [beyond(plant, rng, times) for times in (0.5, 0.9, 0.97, 0.999, 1.5)]
    return np.array(near + far)


def shipped_wrenches(layout: Layout, share: float, count: int) -> Array:
    """Wrenches (count, 6) of random commands of a robot, their sizes a share of the range."""
    plant = plant_of(layout)
    command = plant.sample(np.random.default_rng(5), (count,))
    return np.asarray(plant.wrench(command) * share * layout.commanded)


def assert_same_bits(one: dict[str, Array], other: dict[str, Array], rows: Any = ...) -> None:
    """Holds answers to be equal; `rows` of the other one are compared."""
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name][rows], err_msg=name)


def assert_same_answers(
    layout: Layout, in_lanes: dict[str, Array], alone: dict[str, Array], works: NDArray[np.bool_]
) -> None:
    """Holds answers in lanes to those of single questions."""
    for name in ("is_attainable", "is_truncated"):
        np.testing.assert_array_equal(in_lanes[name], alone[name], err_msg=name)
    for name in ("force", "multipliers", "wrench_served", "gap_power_bound"):
        largest = np.abs(alone[name]).max(initial=1e-12)
        np.testing.assert_allclose(in_lanes[name] / largest, alone[name] / largest, 0, SAME)
    np.testing.assert_allclose(in_lanes["error"], alone["error"], 0, SAME)
    plant = plant_of(layout)
    for figure in (plant.power, plant.force):
        expected = figure(alone["command"])[:, works]
        largest = np.abs(expected).max(initial=1e-12)
        given = figure(in_lanes["command"])[:, works]
        np.testing.assert_allclose(given / largest, expected / largest, 0, SAME)


@pytest.mark.parametrize("number", range(2))
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "rudders"])
def test_lanes_answer_random_robots_as_single_questions_do(kind: str, number: int) -> None:
    layout = load(random_robot(kind, number, 5))
    core = Compiled.of(layout).core
    wrenches = some_wrenches(kind, number, 5)
    for name in CONDITIONS:
        conditions = conditions_of(name, layout.n)
        alone = many(core, NONE, wrenches, conditions)
        baseline = many(core, BASELINE, wrenches, conditions)
        works = np.ones(layout.n, bool) if conditions.lost is None else ~conditions.lost
        assert_same_answers(layout, baseline, alone, works)
        for width in WIDTHS:
            assert_same_bits(baseline, many(core, width, wrenches, conditions))


@pytest.mark.parametrize("name", [*shipped_layouts()])
def test_lanes_answer_shipped_robots_as_single_questions_do(name: str) -> None:
    layout = load_layout(name)
    core = Compiled.of(layout).core
    for share in (0.3, 0.9, 1.5):
        wrenches = shipped_wrenches(layout, share, 21)
        alone = many(core, NONE, wrenches)
        baseline = many(core, BASELINE, wrenches)
        assert_same_answers(layout, baseline, alone, np.ones(layout.n, bool))
        for width in WIDTHS:
            assert_same_bits(baseline, many(core, width, wrenches))


@pytest.mark.parametrize("name", ["bluerov2_heavy", "bluerov2", "A", "fish", "catamaran"])
def test_an_answer_does_not_depend_on_the_rest_of_its_batch(name: str) -> None:
    """Whether lanes are full, and which targets they have had before."""
    layout = load_layout(name)
    core = Compiled.of(layout).core
    within_reach = shipped_wrenches(layout, 0.5, 60)
    wrenches = np.concatenate([within_reach, 4.0 * within_reach[:20]])
    wrenches = wrenches[np.random.default_rng(1).permutation(len(wrenches))]
    for width in WIDTHS:
        whole = many(core, width, wrenches)
        assert np.isfinite(whole["command"]).all()
        for count in range(2, 18):
            rows = np.random.default_rng(count).choice(len(wrenches), count, replace=False)
            assert_same_bits(many(core, width, wrenches[rows]), whole, rows)


@pytest.mark.parametrize("count", [1, 2, 63, 64, 65, 129])
def test_batches_of_any_length_are_answered_whole(count: int) -> None:
    layout = load_layout("A")
    core = Compiled.of(layout).core
    wrenches = shipped_wrenches(layout, 0.6, count)
    alone = many(core, NONE, wrenches)
    for width in WIDTHS:
        in_lanes = many(core, width, wrenches)
        assert_same_answers(layout, in_lanes, alone, np.ones(layout.n, bool))


@pytest.mark.parametrize(
    "name", ["bluerov2_heavy", "bluerov2", "A", "fish", "turtle_hybrid", "catamaran", "mixed"]
)
def test_within_reach_lanes_leave_no_target_of_usual_robots(name: str) -> None:
    """Nothing is left to single questions, which would count their steps in the work area."""
    layout = load_layout(name)
    core = Compiled.of(layout).core
    work = ctypes.cast(core._work_address, ctypes.POINTER(Work)).contents
    wrenches = shipped_wrenches(layout, 0.5, 50)
    for width in WIDTHS:
        work.newton_steps = -1
        in_lanes = many(core, width, wrenches)
        assert in_lanes["is_attainable"].all()
        assert work.newton_steps == -1
    many(core, NONE, wrenches)
    assert work.newton_steps > 0


def test_wrenches_that_are_no_numbers_are_refused_in_lanes_too() -> None:
    layout = load_layout("A")
    core = Compiled.of(layout).core
    wrenches = shipped_wrenches(layout, 0.5, 9)
    wrenches[6, 2] = np.nan
    for width in (NONE, *WIDTHS):
        assert code_of_many(core, width, wrenches)[0] == constant("FL_BAD_ARGUMENT")


def test_a_wrench_in_an_axis_that_does_not_count_is_refused_where_it_is_no_number() -> None:
    mapping = random_robot("thrusters", 2, 5) | {"axes": ["Fx", "Fy", "Fz"]}
    layout = load(mapping)
    core = Compiled.of(layout).core
    wrenches = np.zeros((4, 6))
    wrenches[1, 5] = np.inf
    for width in (NONE, *WIDTHS):
        assert code_of_many(core, width, wrenches)[0] == constant("FL_BAD_ARGUMENT")


@pytest.mark.skipif(
    platform.machine() != "x86_64" or not Path("/proc/cpuinfo").exists(),
    reason="the system lists what its processor has on Linux alone",
)
def test_the_widest_lanes_are_those_that_the_system_lists() -> None:
    listed = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("flags")[2]
    flags = listed.partition("\n")[0].split()
    expected = BASELINE
    if "avx2" in flags:
        expected = AVX2
    if {"avx512f", "avx512dq"} <= set(flags):
        expected = AVX512
    assert widest_lanes() == expected
