"""What learning buys, at a tiny size: the network's seeds against random ones at equal numbers of steps."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.evaluation.experiments.seeds import KINDS, STEPS, Row, seed_report, seed_rows
from finlab.evaluation.splits import Case, make_split

COLUMNS = [
    "fins",
    "steps",
    "seeds",
    "n",
    "err_norm_mean",
    "err_norm_mean_interval",
    "success_0.01",
    "success_0.05",
    "energy_over_network",
]


@pytest.fixture(scope="module")
def method() -> LearnedAllocator:
    allocator = load_allocator()
    assert isinstance(allocator, LearnedAllocator)
    return allocator


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    """The first layout of each fin count from 2 to 5, with six targets."""
    drawn = make_split("id", 20, 6, 0)
    return [next(case for case in drawn if case.layout.n_fins == fins) for fins in (2, 3, 4, 5)]


@pytest.fixture(scope="module")
def rows(method: LearnedAllocator, cases: list[Case]) -> list[Row]:
    return seed_rows(method, cases, n_seeds=8)


def test_one_row_for_each_fin_count_step_and_kind(rows: list[Row]) -> None:
    shown = [(row["fins"], row["steps"], row["seeds"]) for row in rows]
    assert shown == [(fins, steps, kind) for fins in (2, 3, 4, 5) for steps in STEPS for kind in KINDS]
    for row in rows:
        assert list(row) == COLUMNS
        assert row["n"] == 6
        assert 0.0 <= row["success_0.01"] <= row["success_0.05"] <= 1.0
        low, high = row["err_norm_mean_interval"]
        assert 0.0 <= low <= row["err_norm_mean"] <= high < np.inf
        if row["seeds"] == "network" and row["success_0.05"] > 0:
            assert row["energy_over_network"] == 1.0


@pytest.mark.parametrize("fins", [2, 3, 4, 5])
@pytest.mark.parametrize("steps", [0, 1])
def test_the_networks_seeds_meet_more_targets(rows: list[Row], fins: int, steps: int) -> None:
    network, *others = (row for row in rows if row["fins"] == fins and row["steps"] == steps)
    for other in others:
        assert network["success_0.05"] > other["success_0.05"], other["seeds"]
        assert network["success_0.01"] >= other["success_0.01"], other["seeds"]
        assert 5.0 * network["err_norm_mean"] < other["err_norm_mean"], other["seeds"]


def test_more_steps_make_no_kind_of_seed_worse(rows: list[Row]) -> None:
    for kind in KINDS:
        error = [
            np.mean([row["err_norm_mean"] for row in rows if (row["seeds"], row["steps"]) == (kind, steps)])
            for steps in STEPS
        ]
        assert (np.diff(error) <= 1e-3).all(), kind


def test_failed_fins_take_no_part(method: LearnedAllocator) -> None:
    case = make_split("failure", 1, 3, 0)[0]
    left = case.layout.n_fins - len(case.failed)
    assert {row["fins"] for row in seed_rows(method, [case], n_seeds=2)} == {left}


def test_the_same_seed_gives_the_same_rows(method: LearnedAllocator, cases: list[Case]) -> None:
    few = cases[:1]
    first = seed_rows(method, few, n_seeds=2, seed=3)
    assert seed_rows(method, few, n_seeds=2, seed=3) == first
    assert seed_rows(method, few, n_seeds=2, seed=4) != first


def test_the_report_says_how_many_seeds_and_what_scored_them(rows: list[Row]) -> None:
    report = seed_report(rows, 8)
    heading, *_, note = report.splitlines()
    assert heading.split() == COLUMNS
    assert note.startswith("8 seeds per target") and "scored by the plant" in note


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n_seeds", [1, 3, 8])
def test_any_number_of_seeds_is_drawn_without_a_warning(
    n_seeds: int, method: LearnedAllocator, cases: list[Case]
) -> None:
    few = [case._replace(targets=case.targets[:1]) for case in cases[:1]]
    assert len(seed_rows(method, few, n_seeds=n_seeds)) == len(KINDS) * len(STEPS)
