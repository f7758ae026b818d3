"""Splits hold what they promise, and the same numbers give the same cases."""

import math

import numpy as np
import pytest

from finlab.allocation.weighted_descent import DescentOptions, descend
from finlab.errors import DataError
from finlab.evaluation.splits import NEAR_ANGLE, NEAR_POSITION, SPLITS, Case, make_split
from finlab.layout import Limits
from finlab.physics import plant_of

N = 60


def _cases(split: str) -> list[Case]:
    return make_split(split, N, 2, 1234)


def _outside(case: Case) -> bool:
    return any((np.abs(fin.position) > (0.3, 0.3, 0.1)).any() for fin in case.layout.fins)


@pytest.mark.parametrize("split", SPLITS)
def test_same_numbers_same_cases(split: str) -> None:
    for first, second in zip(make_split(split, 3, 4, 5), make_split(split, 3, 4, 5), strict=True):
        assert first.layout == second.layout and first.failed == second.failed
        np.testing.assert_array_equal(first.targets, second.targets)


@pytest.mark.parametrize("split", SPLITS)
def test_a_small_run_is_the_beginning_of_a_large_one(split: str) -> None:
    for small, large in zip(make_split(split, 2, 3, 5), make_split(split, 4, 8, 5), strict=False):
        assert small.layout == large.layout
        np.testing.assert_array_equal(small.targets, large.targets[:3])


def test_seeds_and_splits_differ() -> None:
    layouts = [make_split(split, 1, 1, seed)[0].layout for split in SPLITS for seed in (0, 1)]
    assert len({layout.fins for layout in layouts}) == len(layouts)


def test_fin_counts() -> None:
    for split in SPLITS:
        least, most = (6, 8) if split == "ood-fins" else (2, 5)
        assert {case.layout.n_fins for case in _cases(split)} == set(range(least, most + 1))


def test_boxes() -> None:
    for split in ("id", "ood-fins", "limits", "failure"):
        assert not any(_outside(case) for case in _cases(split))
    assert all(_outside(case) for case in _cases("ood"))
    for case in _cases("ood"):
        assert all((np.abs(fin.position) <= (0.45, 0.45, 0.2)).all() for fin in case.layout.fins)


def test_limits() -> None:
    for split in ("id", "ood", "ood-fins", "failure", "near-singular"):
        assert all(fin.limits == Limits() for case in _cases(split) for fin in case.layout.fins)
    limits = [fin.limits for case in _cases("limits") for fin in case.layout.fins]
    assert all(0.3 <= each.amplitude[1] <= 0.8 and 1.0 <= each.frequency[1] <= 3.0 for each in limits)
    arcs = np.array([each.zero_direction[1] - each.zero_direction[0] for each in limits])
    confined = arcs < 2 * math.pi - 1e-9
    assert 0.2 < confined.mean() < 0.47
    assert (arcs[confined] >= math.pi / 2).all() and (arcs[confined] <= 1.5 * math.pi).all()
    assert all(-math.pi <= low <= high <= math.pi for low, high in (each.zero_direction for each in limits))


def test_failures() -> None:
    cases = _cases("failure")
    assert {len(case.failed) for case in cases} == {1, 2}
    assert all(set(case.failed) < set(case.layout.names) for case in cases)
    assert not any(case.failed for split in SPLITS if split != "failure" for case in _cases(split))


def test_near_singular_layouts_are() -> None:
    for case in _cases("near-singular"):
        fins = case.layout.fins
        turns = [math.remainder(fin.mounting_angle - fins[0].mounting_angle, math.pi) for fin in fins]
        parallel = max(map(abs, turns)) <= NEAR_ANGLE
        apart = np.abs(np.subtract(fins[0].position, fins[1].position)).max()
        assert parallel or (apart <= NEAR_POSITION and abs(turns[1]) <= NEAR_ANGLE)


@pytest.mark.parametrize("split", SPLITS)
def test_targets_are_reachable(split: str) -> None:
    sigma = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])
    rng = np.random.default_rng(0)
    for case in make_split(split, 4, 3, 77):
        plant = plant_of(case.layout.without(case.failed) if case.failed else case.layout)
        start = plant.sample(rng, (30 * len(case.targets),))
        end = descend(plant, start, np.repeat(case.targets, 30, axis=0), sigma, DescentOptions(n_steps=60))
        assert np.sqrt(end.objective.reshape(len(case.targets), -1).min(axis=1)).max() < 0.02


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("nowhere", 1, 1, 0),
            "expected one of id, ood, ood-fins, limits, .*, got 'nowhere'",
        ),
        (("id", 0, 1, 0), "layouts: expected a number of at least 1, got 0"),
        (("id", 1, -3, 0), "targets: expected a number of at least 1, got -3"),
        (("id", 1, 1, -1), "seed: expected a number of at least 0, got -1"),
    ],
)
def test_bad_numbers_are_refused(arguments: tuple[str, int, int, int], message: str) -> None:
    with pytest.raises(DataError, match=message):
        make_split(*arguments)
