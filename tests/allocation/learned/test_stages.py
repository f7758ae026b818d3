"""The learned method's stages one by one: what is prepared, seeded, ranked and refined."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.pipeline import SEARCH, _best_of_each_component
from finlab.allocation.learned.prepared import MAX_SUBSETS, Prepared, prepare
from finlab.allocation.learned.proposal import sample
from finlab.allocation.learned.refined_candidates import (
    MISSED,
    RANKING,
    RefinedCandidates,
    _fresh_starts,
    improve,
    rank,
    reduce_energy,
    refine_candidates,
)
from finlab.allocation.learned.settings import Settings
from finlab.allocation.learned.turn_limits import TURNS, limit_turn
from finlab.assets import shipped_layouts
from finlab.errors import AllocationError
from finlab.inference.mixture import MixtureArrays
from finlab.layout import Layout, load_layout
from finlab.physics import Plant
from finlab.physics.energy import EnergyWeights, fin_energy


@pytest.fixture(params=["A", "penta", "restricted", "octo", "pair"])
def layout(request: pytest.FixtureRequest) -> Layout:
    return load_layout(shipped_layouts()[request.param])


@pytest.fixture
def prepared(learned: LearnedAllocator, layout: Layout) -> Prepared:
    return learned.pipeline.prepare(layout)


def drawn(prepared: Prepared, *size: int, seed: int = 0) -> np.ndarray:
    """Commands (*size, n, 3) within the limits."""
    unit = np.random.default_rng(seed).random((*size, *prepared.lower.shape))
    return np.asarray(prepared.lower + unit * (prepared.upper - prepared.lower))


# What is known of a layout.


def test_columns_are_what_a_newton_does(
    learned: LearnedAllocator, layout: Layout, prepared: Prepared
) -> None:
    """The plant's own wrench, from the plant's own forces."""
    plant, std = Plant(layout), learned.normalization.std
    command = drawn(prepared)
    fins = plant.fin_forces(command)  # in the body frame
    for i, fin in enumerate(layout.fins):
        across = np.array([-math.sin(fin.mounting_angle), math.cos(fin.mounting_angle), 0.0])
        planar = np.array([fins[i] @ across, fins[i, 2]])
        expected = np.concatenate([fins[i], np.cross(fin.position, fins[i])]) / std
        np.testing.assert_allclose(planar @ prepared.planar.columns[i], expected, atol=1e-9)
    pairs = np.einsum("nci,ndj->ncdij", prepared.planar.columns, prepared.planar.columns)
    np.testing.assert_allclose(prepared.planar.products, pairs)


def test_arcs_and_what_a_direction_costs(layout: Layout, prepared: Prepared) -> None:
    planar = prepared.planar
    for i, fin in enumerate(layout.fins):
        low, high = fin.limits.lower[2], fin.limits.upper[2]
        full = high - low >= math.tau - 1e-9
        assert prepared.commands.wraps[i] == full
        assert planar.middle[i] == pytest.approx(0.5 * (low + high))
        assert planar.half[i] == pytest.approx(math.pi if full else 0.5 * (high - low))
        assert planar.idle_direction[i] == pytest.approx(min(max(0.0, low), high))
        flat, raised = (np.array([[0.3, 1.0, angle]]) for angle in (0.0, 0.5 * high))
        upper = prepared.upper[i : i + 1]
        extra = float(fin_energy(raised, upper)[0] - fin_energy(flat, upper)[0])
        assert planar.direction_cost[i] * (0.5 * high) ** 2 == pytest.approx(extra)
    assert planar.turns_fully == prepared.commands.wraps.all()
    assert planar.growth == 0.5


def test_inertial_power_makes_all_fins_work(learned: LearnedAllocator, layout: Layout) -> None:
    weights = EnergyWeights(inertial=1.0)
    found = prepare(layout, learned.pipeline.prepare(layout).commands.fin, np.ones(6), weights)
    assert found.planar.growth == 1.5
    command = drawn(found)[None]
    assert found.energy(command) != pytest.approx(found.usual_energy(command))


def test_subsets_let_up_to_two_fins_rest_and_three_work(prepared: Prepared) -> None:
    top = prepared.planar.curves.maximum
    n = len(top)
    expected = [resting for k in range(3) if k == 0 or n - k >= 3 for resting in combinations(range(n), k)][
        :MAX_SUBSETS
    ]
    assert [tuple(np.flatnonzero(row < top)) for row in prepared.subsets] == expected
    for row, resting in zip(prepared.subsets, expected, strict=True):
        np.testing.assert_allclose(row[list(resting)], 1e-3 * top[list(resting)])


def test_arcs_are_narrowed_for_fins_that_point_somewhere(prepared: Prepared) -> None:
    n = len(prepared.lower)
    previous = drawn(prepared)
    previous[0] = np.nan
    near = limit_turn(prepared, previous, previous[:, 2], TURNS[0])
    assert near.commands.wraps[0] == prepared.commands.wraps[0]
    assert not near.commands.wraps[1:].any()
    assert near.planar.half[0] == prepared.planar.half[0]
    assert (near.planar.half[1:] <= TURNS[0] + 1e-12).all()
    assert not near.planar.turns_fully
    middle = (near.planar.middle - previous[:, 2])[1:]
    assert (np.abs(middle) <= TURNS[0]).all()
    if prepared.commands.wraps.all():
        np.testing.assert_allclose(near.planar.half[1:], TURNS[0])
        np.testing.assert_allclose(middle, 0.0, atol=1e-12)
    assert limit_turn(prepared, previous, previous[:, 2], math.pi) is prepared
    assert limit_turn(prepared, np.full((n, 3), np.nan), np.zeros(n), TURNS[0]) is prepared


# What is drawn and seeded.


def test_samples_are_the_means_and_then_draws_around_them() -> None:
    rows, n, m, k = 3, 2, 4, 4000
    rng = np.random.default_rng(0)
    mean = rng.uniform(-0.5, 0.5, (rows, n, m, 3)).astype(np.float32)
    std = rng.uniform(0.1, 0.3, (rows, n, m, 3)).astype(np.float32)
    weight = np.array([[0.1, 0.2, 0.3, 0.4], [0.7, 0.1, 0.1, 0.1], [0.0, 0.0, 1.0, 0.0]], np.float32)
    command, component = sample(MixtureArrays(weight=weight, mean=mean, std=std), k, 0.25, seed=1)
    np.testing.assert_array_equal(component[:, :m], np.tile(np.arange(m), (rows, 1)))
    np.testing.assert_array_equal(command[:, :m], mean.swapaxes(1, 2))
    for row in range(rows):
        share = np.bincount(component[row, m:], minlength=m) / (k - m)
        np.testing.assert_allclose(share, weight[row], atol=0.03)
        for c in np.flatnonzero(weight[row] > 0.2):
            of_c = command[row, m:][component[row, m:] == c]
            np.testing.assert_allclose(of_c.mean(0), mean[row, :, c], atol=0.03)
            np.testing.assert_allclose(of_c.std(0), 0.5 * std[row, :, c], rtol=0.1)
    few, _ = sample(MixtureArrays(weight=weight, mean=mean, std=std), 2, 0.25, seed=1)
    np.testing.assert_array_equal(few, mean.swapaxes(1, 2)[:, :2])


@pytest.mark.parametrize("n_seeds", [1, 3, 9])
def test_seeds_are_the_best_of_each_component(n_seeds: int) -> None:
    rng = np.random.default_rng(n_seeds)
    score = rng.random((5, 30))
    component = np.stack([rng.permutation(np.arange(30) % 6) for _ in range(5)])
    found = _best_of_each_component(component, score, n_seeds)
    for row in range(5):
        best = {int(component[row, k]): int(k) for k in np.argsort(-score[row])}
        expected = sorted(best.values(), key=lambda k: score[row, k])[:n_seeds]
        assert (found[row] - 30 * row).tolist() == expected


def test_the_search_is_longer_with_more_fins(
    learned: LearnedAllocator, monkeypatch: pytest.MonkeyPatch
) -> None:
    from finlab.allocation.learned import pipeline

    steps: list[tuple[int, int]] = []
    whole = pipeline.force_space.descend

    def counted(problem: object, target: object, thrust: np.ndarray, n: int) -> object:
        steps.append((thrust.shape[1], n))
        return whole(problem, target, thrust, n)  # type: ignore[arg-type]

    monkeypatch.setattr(pipeline.force_space, "descend", counted)
    for name in ("A", "penta", "hexa", "octo"):
        learned.allocate(load_layout(shipped_layouts()[name]), [0.3, 0.0, 0.3, 0.0, 0.0, 0.02])
    few, many = SEARCH.few_fins_steps, SEARCH.many_fins_steps
    assert few < many
    assert set(steps) == {(4, few), (5, few), (6, many), (8, many)}


def test_fresh_starts_are_half_the_networks_own(prepared: Prepared) -> None:
    own = drawn(prepared, 2, 64).astype(np.float32)
    found = _fresh_starts(prepared, own, 32)
    assert found.shape == (2, 32, *prepared.lower.shape)
    np.testing.assert_array_equal(found[:, :16], own[:, :16].astype(np.float64))
    spread = found[0, 16:]
    assert (spread >= prepared.lower).all() and (spread <= prepared.upper).all()
    share = (spread - prepared.lower) / (prepared.upper - prepared.lower)
    assert share.min() < 0.1 and share.max() > 0.9
    np.testing.assert_array_equal(found[0, 16:], found[1, 16:])


# How answers are ranked and refined.


def test_exact_answers_by_energy_then_the_others_by_error() -> None:
    energy = np.array([5.0, 1.0, 3.0, 2.0, 9.0])
    error = np.array([0.0, 0.5, 1e-5, 0.1, 1e-4])
    assert rank(energy, error, 1e-4).argsort().tolist() == [2, 0, 4, 3, 1]
    # Errors in the same step of the resolution are one, and the energy decides.
    near = np.array([0.101, 0.5, 0.5, 0.109, 0.121])
    assert rank(energy, near, 1e-4, 0.02).argsort().tolist() == [3, 0, 4, 1, 2]
    np.testing.assert_array_equal(rank(energy, 0.0 * error, 1e-4), energy)
    assert rank(np.array([1e4, 1.0]), np.array([0.0, 1e-3]), 1e-4).argsort().tolist() == [0, 1]


def answers(prepared: Prepared, target: np.ndarray, p: int, steps: int) -> RefinedCandidates:
    return refine_candidates(prepared, target, drawn(prepared, len(target), p), steps)


def reachable(prepared: Prepared, rows: int) -> np.ndarray:
    return prepared.commands.wrench(drawn(prepared, rows, seed=7))


def test_refined_answers_say_what_they_give(prepared: Prepared) -> None:
    target = reachable(prepared, 3)
    found = answers(prepared, target, 5, 4)
    for row in range(3):
        np.testing.assert_allclose(found.wrench[row], prepared.commands.wrench(found.command[row]), atol=1e-9)
        error = np.linalg.norm(found.wrench[row] - target[row], axis=-1)
        np.testing.assert_allclose(found.error[row], error, atol=1e-9)
        np.testing.assert_allclose(found.energy[row], prepared.energy(found.command[row]))
        order = rank(found.energy[row], found.error[row], RANKING.exact_error, RANKING.error_resolution)
        assert (np.diff(order) >= 0.0).all()


def test_a_robot_in_motion_keeps_its_mode_for_a_small_gain(learned: LearnedAllocator) -> None:
    prepared = learned.pipeline.prepare(load_layout(shipped_layouts()["A"]))
    target = reachable(prepared, 1)
    found = refine_candidates(prepared, target, drawn(prepared, 1, 24), 40)
    exact = np.flatnonzero(found.error[0] <= RANKING.exact_error)
    energy = found.energy[0, exact]
    close = [k for k in exact[1:] if energy[0] < found.energy[0, k] < energy[0] * 1.3]
    assert close, "two modes of nearly the same energy"
    kept, best = found.command[:, close[0]], found.command[:, 0]
    meter = prepared.energy
    gain = 1.0 - float(meter(best)[0] / meter(kept)[0])
    both = np.stack([kept, best], axis=1)
    for switch_gain, first in ((1.1 * gain, kept), (0.9 * gain, best)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(
                "finlab.allocation.learned.refined_candidates.RANKING",
                replace(RANKING, switch_gain=switch_gain),
            )
            chosen = refine_candidates(prepared, target, both, 0, keep_mode=True)
        np.testing.assert_allclose(chosen.command[0, 0], first[0], atol=1e-6)
    cheapest = refine_candidates(prepared, target, both, 0)
    np.testing.assert_allclose(cheapest.command[0, 0], best[0], atol=1e-6)


def test_only_the_rows_asked_for_are_improved(prepared: Prepared) -> None:
    target = reachable(prepared, 4)
    found = answers(prepared, target, 3, 1)
    before = RefinedCandidates(*(values.copy() for values in found))
    rows = np.array([True, False, True, False])
    improve(prepared, target, found, rows, drawn(prepared, 2, 6, seed=3), 12)
    for new, old in zip(found, before, strict=True):
        np.testing.assert_array_equal(new[~rows], old[~rows])
    assert (found.error[rows, 0] <= before.error[rows, 0] + RANKING.error_resolution).all()
    assert found.error[rows, 0].sum() < 0.5 * before.error[rows, 0].sum()


def test_inexact_answers_become_cheaper_and_exact_ones_stay(prepared: Prepared) -> None:
    target = np.concatenate([reachable(prepared, 3), 30.0 * reachable(prepared, 3)])
    found = answers(prepared, target, 6, 30)
    before = RefinedCandidates(*(values.copy() for values in found))
    reduce_energy(prepared, target, found, MISSED.energy_lm_steps)
    exact = before.error[:, 0] <= RANKING.exact_error
    np.testing.assert_array_equal(found.command[exact], before.command[exact])
    far = ~exact
    assert far.sum() >= 2
    spent, was = (prepared.energy(values.command[far, 0]) for values in (found, before))
    assert (found.error[far, 0] <= before.error[far, 0] + 2 * RANKING.error_resolution).all()
    assert ((spent < was + 1e-9) | (found.error[far, 0] < before.error[far, 0])).all()


# The whole, for many targets.


def test_many_targets_are_told_what_the_surrogate_gives(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["penta"])
    prepared, std = learned.pipeline.prepare(layout), learned.normalization.std
    targets = reachable(prepared, 5) * std
    found = learned._solve(layout, targets, seed=0, previous=None)
    assert found.wrench_surrogate is not None
    np.testing.assert_allclose(
        found.wrench_surrogate, prepared.commands.wrench(found.command) * std, atol=1e-9
    )
    np.testing.assert_allclose(found.wrench_surrogate / std, targets / std, atol=2 * RANKING.exact_error)


@pytest.mark.parametrize(
    "wrong",
    [{"n_candidates": 0}, {"n_seeds": 0}, {"n_refined": 0}, {"temperature": -0.1}, {"temperature": math.nan}],
)
def test_impossible_settings_are_refused_one_by_one(wrong: dict[str, float]) -> None:
    with pytest.raises(AllocationError, match=f"{next(iter(wrong))}={next(iter(wrong.values()))}"):
        Settings(**wrong)  # type: ignore[arg-type]


def test_the_least_settings_are_enough(learned: LearnedAllocator) -> None:
    Settings(n_candidates=1, n_seeds=1, n_refined=1, temperature=0.0)
    for weight in (-1e-9, math.inf, math.nan):
        with pytest.raises(AllocationError, match="energy_tradeoff"):
            Settings(energy_tradeoff=weight)


def test_constants_of_the_search_keep_their_order() -> None:
    assert (
        RANKING.error_resolution < RANKING.exact_error < SEARCH.passing_error < SEARCH.promising_error < 0.1
    )
    assert 0.0 < RANKING.switch_gain < 0.1
    assert MISSED.first_lm_steps < MISSED.nearest_lm_steps < MISSED.last_lm_steps
    assert 0.0 < MISSED.needless_share < 0.01 and RANKING.exact_error < MISSED.needless_error < 1e-3
    assert list(TURNS) == sorted(TURNS) and TURNS[-1] == math.pi
