"""Splits hold what they promise, and the same numbers give the same cases."""

import math
from collections.abc import Iterable
from functools import cache
from itertools import chain, product
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.errors import DataError
from finlab.layout import Fin, Limits
from finlab.physics import plant_of
from finlab.research.evaluation.splits import (
    NEAR_ANGLE,
    NEAR_POSITION,
    SPLITS,
    SplitCase,
    make_split,
)

N_CASES = 60
"""How many cases of a split are made."""
FINS = {"ood-fins": (6, 8), "many-fins": (9, 12)}
"""Least and most fins where they are not two and five."""
ROBOTS = {
    "thrusters": (4, 10, {"thruster"}),
    "azimuths": (2, 6, {"azimuth"}),
    "mixed-actuators": (4, 10, {"fin", "thruster", "azimuth", "tilt"}),
    "any-shaft": (2, 8, {"fin"}),
}
"""Least and most actuators, and their types, in splits of other robots than those of horizontal
fins."""
QUICK = [split for split in SPLITS if split != "tables" and split not in ROBOTS]
"""Splits of fins of which many cases are drawn in no time; `tables` is `fins-mixed` with files."""


@cache
def _cases(split: str) -> list[SplitCase]:
    """Cases of a split."""
    return make_split(split, N_CASES, 2, 1234)


def _fins(cases: Iterable[SplitCase]) -> list[Fin]:
    """The fins of all robots of some cases."""
    return list(chain.from_iterable(case.layout.fins for case in cases))


def _outside(case: SplitCase) -> bool:
    """Whether a fin of a case is outside of the box of the other splits."""
    return any((np.abs(fin.position) > (0.3, 0.3, 0.1)).any() for fin in case.layout.fins)


@pytest.mark.parametrize("split", SPLITS)
def test_same_numbers_same_cases(split: str) -> None:
    for first, second in zip(make_split(split, 3, 4, 5), make_split(split, 3, 4, 5), strict=True):
        assert first.layout == second.layout and first.lost == second.lost
        np.testing.assert_array_equal(first.targets, second.targets)


@pytest.mark.parametrize("split", SPLITS)
def test_a_small_run_is_the_beginning_of_a_large_one(split: str) -> None:
    for small, large in zip(make_split(split, 2, 3, 5), make_split(split, 4, 8, 5), strict=False):
        assert small.layout == large.layout
        # Products of other sizes are rounded otherwise on some processors.
        np.testing.assert_allclose(small.targets, large.targets[:3], rtol=1e-12, atol=1e-12)


def test_seeds_and_splits_differ() -> None:
    layouts = [make_split(split, 1, 1, seed)[0].layout for split, seed in product(SPLITS, (0, 1))]
    assert len({layout.actuators for layout in layouts}) == len(layouts)


def test_fin_counts() -> None:
    for split in QUICK:
        least, most = FINS.get(split, (2, 5))
        counts = {case.layout.n_fins for case in _cases(split)}
        assert counts == set(range(least, most + 1))


@pytest.mark.parametrize("split", ROBOTS)
def test_other_robots_have_the_actuators_that_they_are_said_to_have(split: str) -> None:
    least, most, types = ROBOTS[split]
    layouts = [case.layout for case in _cases(split)]
    assert {layout.n for layout in layouts} == set(range(least, most + 1))
    found = [{part.type for part in layout.actuators} for layout in layouts]
    assert all(each == types for each in found)
    assert all((np.abs(layout.position) <= (0.3, 0.3, 0.15)).all() for layout in layouts)
    frames = np.concatenate([layout.frames[:, 0] for layout in layouts])
    assert np.abs(frames.mean(axis=0)).max() < 0.2 and (np.abs(frames).mean(axis=0) > 0.4).all()


def test_boxes() -> None:
    for split in ("id", "ood-fins", "limits", "failure", "fins", "fins-mixed", "many-fins"):
        assert not any(_outside(case) for case in _cases(split))
    assert all(_outside(case) for case in _cases("ood"))
    for case in _cases("ood"):
        assert all((np.abs(fin.position) <= (0.45, 0.45, 0.2)).all() for fin in case.layout.fins)


def test_limits() -> None:
    for split in QUICK:
        if split != "limits":
            assert all(fin.limits == Limits() for fin in _fins(_cases(split))), split
    limits = [fin.limits for fin in _fins(_cases("limits"))]
    assert all(
        0.3 <= each.amplitude[1] <= 0.8 and 1.0 <= each.frequency[1] <= 3.0 for each in limits
    )
    arcs = np.array([each.zero_direction[1] - each.zero_direction[0] for each in limits])
    confined = arcs < 2 * math.pi - 1e-9
    assert 0.2 < confined.mean() < 0.47
    assert (arcs[confined] >= math.pi / 2).all() and (arcs[confined] <= 1.5 * math.pi).all()
    assert all(
        -math.pi <= low <= high <= math.pi for low, high in (each.zero_direction for each in limits)
    )


def test_failures() -> None:
    cases = _cases("failure")
    assert {len(case.lost) for case in cases} == {1, 2}
    assert all(set(case.lost) < set(case.layout.names) for case in cases)
    for split in QUICK:
        if split != "failure":
            assert not any(case.lost for case in _cases(split)), split


def test_near_singular_layouts_are() -> None:
    for case in _cases("near-singular"):
        fins = case.layout.fins
        turns = [
            math.remainder(fin.mounting_angle - fins[0].mounting_angle, math.pi) for fin in fins
        ]
        parallel = max(map(abs, turns)) <= NEAR_ANGLE
        apart = np.abs(np.subtract(fins[0].position, fins[1].position)).max()
        assert parallel or (apart <= NEAR_POSITION and abs(turns[1]) <= NEAR_ANGLE)


FIN_RANGES = {
    "drag": {"area": (0.005, 0.04), "lever": (0.05, 0.15)},
    "lighthill": {"length": (0.1, 0.3), "width": (0.05, 0.15)},
    "soft": {
        "k": (1, 8),
        "p": (1, 2),
        "x0": (0.6, 1.5),
        "q": (3, 6),
        "e": (0, 0.2),
        "d": (-0.15, 0.15),
    },
}
"""The contract's."""


@pytest.mark.parametrize("split", ["fins", "fins-mixed"])
def test_random_fins_keep_to_the_contract(split: str) -> None:
    cases = _cases(split)
    models = [fin.model for fin in _fins(cases)]
    of_kind = {kind: [model for model in models if model.type == kind] for kind in FIN_RANGES}
    assert sum(map(len, of_kind.values())) == len(models)
    for kind, ranges in FIN_RANGES.items():
        assert 0.2 * len(models) < len(of_kind[kind]) < 0.47 * len(models)
        for name, (low, high) in ranges.items():
            values = np.array([model.values()[name] for model in of_kind[kind]], float)
            assert low <= values.min() < low + 0.3 * (high - low)
            assert high >= values.max() > high - 0.3 * (high - low)
            middle = math.sqrt(low * high) if kind != "soft" or name == "k" else (low + high) / 2
            assert 0.25 < (values < middle).mean() < 0.75
    alone = [len({fin.model for fin in case.layout.fins}) == 1 for case in cases]
    assert all(alone) if split == "fins" else not any(alone)


def test_tables_are_noisy_grids_of_random_fins() -> None:
    (case,) = make_split("tables", 1, 3, 1234)
    for fin in case.layout.fins:
        assert fin.model.type == "table"
        path = Path(str(fin.model.values()["path"]))
        rows = np.loadtxt(path, delimiter=",", skiprows=1)
        around = rows[rows[:, :2].prod(axis=1) == rows[:, :2].prod(axis=1).max()]
        # All round the circle the noise is what differs from the neighbours of a smooth fin.
        size = np.hypot(around[:, 4], around[:, 5])
        turn = np.exp(2j * np.pi * np.arange(len(around)) / 12)
        smooth = size.mean() + 2 * np.real((size * turn.conj()).mean() * turn)
        assert 0.005 < ((size - smooth) / size.mean()).std() < 0.06
        assert len(rows) == 8 * 9 * 12 and not rows[:, 3].any()
    stamp = path.stat().st_mtime_ns
    assert (
        make_split("tables", 1, 3, 1234)[0].layout == case.layout
        and path.stat().st_mtime_ns == stamp
    )


def test_robots_of_other_fins_are_measured_by_their_own_wrenches() -> None:
    for split in ("id", "limits", "many-fins"):
        assert all(case.sigma is None for case in _cases(split)), split
    for case in _cases("fins"):
        plant = plant_of(case.layout)
        wrench = plant.wrench(plant.sample(np.random.default_rng(1), (20_000,)))
        spread = wrench.std(axis=0)
        floor = 0.05 * np.repeat([spread[:3].max(), spread[3:].max()], 3)
        assert case.sigma is not None
        np.testing.assert_allclose(case.sigma, np.maximum(spread, floor), rtol=0.06)


@pytest.mark.parametrize("split", SPLITS)
def test_targets_are_reachable(split: str) -> None:
    sigma = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])
    rng = np.random.default_rng(0)
    for case in make_split(split, 4, 3, 77):
        plant = plant_of(case.layout.without(case.lost) if case.lost else case.layout)
        start = plant.sample(rng, (30 * len(case.targets),))
        unit = sigma if case.sigma is None else case.sigma
        wanted = np.repeat(case.targets / unit, 30, axis=0)
        end = refine(CommandProblem.of(plant, unit), wanted, start, 60)
        assert end.error.reshape(len(case.targets), -1).min(axis=1).max() < 0.02


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere", 1, 1, 0), "expected one of id, ood, ood-fins, limits, .*, got 'nowhere'"),
        (("id", 0, 1, 0), "layouts: expected a number of at least 1, got 0"),
        (("id", 1, -3, 0), "targets: expected a number of at least 1, got -3"),
        (("id", 1, 1, -1), "seed: expected a number of at least 0, got -1"),
    ],
)
def test_bad_numbers_are_refused(arguments: tuple[str, int, int, int], message: str) -> None:
    with pytest.raises(DataError, match=message):
        make_split(*arguments)
