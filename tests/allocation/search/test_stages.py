"""The stages of the search one by one: what is prepared, seeded, ranked and refined."""

import math
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search import pipeline, search_allocator
from finlab.allocation.search.pipeline import SEARCH
from finlab.allocation.search.prepared import (
    SEEDS,
    Prepared,
    neighbour_seeds,
    prepare,
    resting_fins,
    resting_seeds,
    uneven_seeds,
)
from finlab.allocation.search.refined_candidates import (
    MISSED,
    RANKING,
    RefinedCandidates,
    _fresh_starts,
    improve,
    rank,
    reduce_cost,
    refine_candidates,
)
from finlab.allocation.search.search_allocator import CHUNK, SearchAllocator
from finlab.allocation.search.settings import Settings
from finlab.assets import shipped_layouts
from finlab.errors import AllocationError
from finlab.evaluation.splits import make_split
from finlab.layout import Fin, Layout, load_layout
from finlab.physics import Plant
from finlab.physics.energy import EnergyWeights, command_energy, fin_energy
from finlab.physics.objective import Name, Objective

SHIPPED = ["A", "penta", "restricted", "octo", "pair", "mixed"]


@pytest.fixture(params=SHIPPED)
def layout(request: pytest.FixtureRequest) -> Layout:
    return load_layout(shipped_layouts()[request.param])


@pytest.fixture
def prepared(search: SearchAllocator, layout: Layout) -> Prepared:
    return search.pipeline.prepare(layout)


@pytest.fixture
def for_effort(effort: SearchAllocator, layout: Layout) -> Prepared:
    return effort.pipeline.prepare(layout)


def drawn(prepared: Prepared, *size: int, seed: int = 0) -> np.ndarray:
    """Commands (*size, n, 3) within the limits."""
    return prepared.plant.sample(np.random.default_rng(seed), size)


# What is known of a layout.


def test_columns_are_what_a_newton_does(search: SearchAllocator, layout: Layout, prepared: Prepared) -> None:
    """The plant's own wrench, from the plant's own forces."""
    plant, std = Plant(layout), search.normalization.std
    command = drawn(prepared)
    fins = plant.fin_forces(command)  # in the body frame
    columns = np.stack(np.split(prepared.planar.columns, 2), axis=1)
    for i, fin in enumerate(layout.fins):
        across = np.array([-math.sin(fin.mounting_angle), math.cos(fin.mounting_angle), 0.0])
        shaft = np.array([math.cos(fin.mounting_angle), math.sin(fin.mounting_angle), 0.0])
        planar = np.array([fins[i] @ across, fins[i, 2]])
        expected = np.concatenate([fins[i], np.cross(fin.position, fins[i])]) / std
        np.testing.assert_allclose(planar @ columns[i], expected, atol=1e-12)
        along = np.concatenate([shaft, np.cross(fin.position, shaft)]) / std
        np.testing.assert_allclose(prepared.planar.along_shaft[i], along, atol=1e-12)
    n = layout.n_fins
    outer = np.einsum("nci,ndj->ncdij", columns, columns)
    products = prepared.planar.products.reshape(3, n, 6, 6)
    np.testing.assert_allclose(products[0], outer[:, 0, 0], atol=1e-8)
    np.testing.assert_allclose(products[1], outer[:, 0, 1] + outer[:, 1, 0], atol=1e-8)
    np.testing.assert_allclose(products[2], outer[:, 1, 1], atol=1e-8)
    np.testing.assert_allclose(prepared.commands.columns, plant.columns / std)


def test_arcs_and_what_a_direction_costs(layout: Layout, prepared: Prepared, for_effort: Prepared) -> None:
    planar, paid = prepared.planar, for_effort.planar
    assert planar.turning_is_free and not planar.direction_cost.any() and not paid.turning_is_free
    for i, fin in enumerate(layout.fins):
        low, high = fin.limits.lower[2], fin.limits.upper[2]
        full = high - low >= math.tau - 1e-9
        assert prepared.commands.full_turn[i] == full
        if fin.model.type in ("drag", "lighthill"):
            assert planar.fins.middle[i] == pytest.approx(0.5 * (low + high))
            assert planar.fins.half[i] == pytest.approx(math.pi if full else 0.5 * (high - low))
        assert planar.idle_direction[i] == pytest.approx(min(max(0.0, low), high))
        flat, raised = (np.array([[0.3, 1.0, angle]]) for angle in (0.0, 0.5 * high))
        upper = layout.upper[i : i + 1]
        extra = float(fin_energy(raised, upper)[0] - fin_energy(flat, upper)[0])
        assert paid.direction_cost[i] * (0.5 * high) ** 2 == pytest.approx(extra)
    assert planar.fins.turns_fully == prepared.commands.full_turn.all()


def test_each_objective_has_its_own_cost(
    search: SearchAllocator, layout: Layout, prepared: Prepared, for_effort: Prepared
) -> None:
    command = drawn(prepared, 5)
    np.testing.assert_allclose(prepared.cost(command), prepared.plant.power(command).sum(-1))
    np.testing.assert_allclose(for_effort.cost(command), command_energy(command, layout.upper))
    weights = EnergyWeights(inertial=1.0)
    other = prepare(layout, search.normalization.std, Objective("effort", weights))
    np.testing.assert_allclose(other.cost(command), command_energy(command, layout.upper, weights))
    heated = prepare(layout, search.normalization.std, Objective("power", copper_loss=2.0))
    np.testing.assert_allclose(heated.cost(command), prepared.plant.power(command, 2.0).sum(-1))


def test_exactness_is_one_but_for_weak_robots(search: SearchAllocator, layout: Layout) -> None:
    """Root of the summed squares of all columns at full force; never above one."""

    def exactness(std: np.ndarray) -> float:
        return prepare(layout, std, Objective()).exactness

    std = search.normalization.std
    assert exactness(std) == 1.0
    planar = prepare(layout, std, Objective()).planar
    columns = np.stack(np.split(planar.columns, 2), axis=1)
    size = math.sqrt(float(((planar.fins.maximum[:, None, None] * columns) ** 2).sum()))
    for share in (1e-3, 0.5, 0.999, 1.001):
        assert exactness(std * size / share) == pytest.approx(min(share, 1.0))


def test_up_to_two_fins_rest_or_all_but_two(for_effort: Prepared, prepared: Prepared) -> None:
    top = for_effort.planar.fins.maximum
    n = len(top)
    expected = [
        r for k in range(3) if k == 0 or n - k >= (1 if n == 2 else 2) for r in combinations(range(n), k)
    ]
    if n > 4:
        expected += [tuple(i for i in range(n) if i not in pair) for pair in combinations(range(n), 2)]
    expected = expected[: SEEDS.most_subsets]
    assert list(resting_fins(n)) == expected
    rests, uneven = np.split(for_effort.seeds, [len(expected)])
    assert [tuple(np.flatnonzero(row < top)) for row in rests] == expected
    np.testing.assert_array_equal(uneven, uneven_seeds(top))
    for row, resting in zip(rests, expected, strict=True):
        np.testing.assert_allclose(row[list(resting)], 1e-3 * top[list(resting)])
    # Power has one cheapest allocation: all fins work.
    np.testing.assert_array_equal(prepared.seeds, prepared.planar.fins.maximum[None])


@pytest.mark.parametrize(
    ("n", "count"),
    [(1, 1), (2, 3), (3, 4), (4, 11), (5, 26), (8, 65), (9, SEEDS.most_subsets), (16, SEEDS.most_subsets)],
)
def test_how_many_sub_layouts_there_are(n: int, count: int) -> None:
    assert len(resting_fins(n)) == count


def test_seeds_by_hand() -> None:
    seeds = resting_seeds(np.array([1.0, 2.0, 4.0]), ((), (1,), (0, 2)))
    np.testing.assert_allclose(seeds, [[1.0, 2.0, 4.0], [1.0, 2e-3, 4.0], [1e-3, 2.0, 4e-3]])


@pytest.mark.parametrize("n", [2, 3, 6])
def test_uneven_seeds_differ_from_fin_to_fin_and_from_seed_to_seed(n: int) -> None:
    share = uneven_seeds(np.full(n, 3.0)) / 3.0
    assert share.shape == (n, n) and share.min() >= 0.05 and share.max() < 1.0
    assert np.ptp(share, axis=1).min() > 0.1, "no start in which equal fins work alike"
    assert np.abs(share[:, None] - share[None])[~np.eye(n, dtype=bool)].max(axis=-1).min() > 0.05
    assert uneven_seeds(np.arange(1.0, n + 1.0)) == pytest.approx(share * np.arange(1.0, n + 1.0))


def test_seeds_near_an_allocation_change_one_fin_or_two() -> None:
    top = np.array([1.0, 2.0, 4.0])
    seeds = neighbour_seeds(np.array([[0.4, 0.001, 0.0]]), np.array([[True, True, False]]), top)
    rest, first, second, third = (
        1e-3 * top,
        0.4,
        0.2,
        2.0,
    )  # a weak one begins with a tenth, a new one with half
    expected = [
        [rest[0], second, rest[2]],
        [rest[0], rest[1], rest[2]],
        [rest[0], second, third],
        [first, rest[1], rest[2]],
        [first, rest[1], third],
        [first, second, third],
    ]
    assert seeds == pytest.approx(np.array([expected]))


def test_many_fins_take_each_others_part(effort: SearchAllocator) -> None:
    """Twelve fins of which the cheapest way rests most: no single fin or pair at rest leads there."""
    case = make_split("many-fins", 4, 1, 0)[3]
    found = effort.allocate(case.layout, case.targets[0])
    plain = effort.with_settings(subsets=False).pipeline
    prepared = plain.prepare(case.layout)
    alone = plain.solve(prepared, case.targets, seeds=prepared.seeds[None])
    assert found.err_norm < 1e-5 and found.energy < 0.95 * alone.cost[0, 0]


def test_a_robot_in_motion_is_not_searched_again_where_it_is_cheap_already(
    search: SearchAllocator, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = search.allocate(load_layout("A"), EASY)
    monkeypatch.setattr(pipeline, "cheaper_commands", None)
    again = search.allocate(load_layout("A"), EASY, previous=first.command)
    assert again.err_norm < 1e-5 and again.power == pytest.approx(first.power, rel=1e-4)


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_twins_that_must_give_more_than_one_can_work_unevenly(share: float) -> None:
    """For effort one at its largest and the other a little is cheaper than both alike."""
    pair = Layout("twins", tuple(Fin(name, (0.1, 0.05, 0.0), 0.3) for name in "ab"))
    target = Plant(pair).wrench(np.array([[0.6, 2.1, 0.4]] * 2)) * share
    size = np.linalg.norm(load_allocator(objective="effort").allocate(pair, target).fin_forces, axis=1)
    assert size.max() > 0.9 * 6.66 and size.min() < size.max() * (2.2 * share - 1.0)


# What is searched.


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int, int]]:
    """Fins, seeds and steps of each search from now on."""
    steps: list[tuple[int, int, int]] = []
    whole = pipeline.force_space.descend

    def spy(problem: Any, target: Any, seeds: np.ndarray, n: int, works: Any = None) -> Any:
        steps.append((seeds.shape[1], len(seeds), n))
        return whole(problem, target, seeds, n, works)

    monkeypatch.setattr(pipeline.force_space, "descend", spy)
    return steps


EASY = [0.3, 0.0, 0.3, 0.0, 0.0, 0.02]


def test_effort_is_searched_longer_with_more_fins(
    effort: SearchAllocator, counted: list[tuple[int, int, int]]
) -> None:
    few, many = SEARCH.few_fins_steps, SEARCH.many_fins_steps
    assert few < many
    for name, n, steps in (("A", 4, few), ("penta", 5, few), ("hexa", 6, many), ("octo", 8, many)):
        counted.clear()
        effort.allocate(load_layout(shipped_layouts()[name]), EASY)
        near = [(n, 3 * n * (n + 1) // 2, steps)] if n >= 6 else []  # then once more near the best
        assert counted == [(n, len(resting_fins(n)) + n, steps), *near]


def test_power_is_searched_once(search: SearchAllocator, counted: list[tuple[int, int, int]]) -> None:
    for name, n in (("A", 4), ("octo", 8)):
        counted.clear()
        search.allocate(load_layout(shipped_layouts()[name]), EASY)
        assert counted == [(n, 1, SEARCH.convex_steps)]


def test_settings_say_how_long_and_how_widely(counted: list[tuple[int, int, int]]) -> None:
    for objective in ("power", "effort"):
        method = load_allocator(objective=objective, search_steps=9, subsets=False)
        method.allocate(load_layout("A"), EASY)
    assert counted == [(4, 1, 9)] * 2


def test_chunks_of_targets_are_searched_together(
    search: SearchAllocator, counted: list[tuple[int, int, int]]
) -> None:
    search.allocate_batch(load_layout("A"), np.tile(EASY, (CHUNK + 1, 1)))
    assert sorted(rows for _, rows, _ in counted) == [1, CHUNK]


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_exploring_tries_what_may_be_another_way(
    objective: Name, counted: list[tuple[int, int, int]]
) -> None:
    """Effort has local minima, found from many seeds; power has one, but for fins that are made to rest."""
    result = load_allocator(objective=objective).allocate(load_layout("A"), EASY)
    counted.clear()
    assert len(result.explore()) >= 2
    rests = len(resting_fins(4))
    # The question is asked again first, as of a copy.
    assert counted[1:] == [(4, rests + (4 + SEARCH.wide_seeds) * (objective == "effort"), SEARCH.wide_steps)]


def test_random_seeds_of_the_wide_search_are_spread_over_what_fins_can_give(
    effort: SearchAllocator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Squares of even shares: half of them below a quarter of a fin's largest force."""
    layout, asked = load_layout(shipped_layouts()["mixed"]), []
    whole = pipeline.force_space.descend

    def spy(problem: Any, target: Any, seeds: np.ndarray, *rest: Any) -> Any:
        asked.append(seeds / problem.fins.maximum)
        return whole(problem, target, seeds, *rest)

    result = effort.allocate(layout, EASY)
    monkeypatch.setattr(pipeline.force_space, "descend", spy)
    result.explore()
    share = asked[-1][-SEARCH.wide_seeds :]
    assert (share > 0.0).all() and (share < 1.0).all() and share.max() > 0.9
    np.testing.assert_allclose(np.quantile(share, [0.25, 0.5, 0.75]), [0.0625, 0.25, 0.5625], atol=0.1)


@pytest.mark.parametrize("exactness", [1.0, 0.4])
def test_a_seed_that_misses_is_left_for_a_dearer_one_that_does_not(
    exactness: float, effort: SearchAllocator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What misses by less than `promising_error` is judged by its cost, the rest by what is missing; of
    a weak robot, in proportion."""
    layout = load_layout("A")
    prepared = effort.pipeline.prepare(layout)._replace(exactness=exactness)
    whole = pipeline.force_space.descend
    missed = exactness * SEARCH.promising_error * np.array([0.9, 0.5, 1.1, 1.5])

    def told(*arguments: Any) -> Any:
        planar = whole(*arguments)
        residual = np.zeros_like(planar.residual)
        residual[:, 0] = missed
        return planar._replace(residual=residual)

    monkeypatch.setattr(pipeline.force_space, "descend", told)
    seeds = np.repeat(prepared.seeds[:1], 4, axis=0)[None]
    price = np.array([4.0, 5.0, 1.0, 2.0])
    realize = pipeline.force_space.realize
    monkeypatch.setattr(
        pipeline.force_space, "realize", lambda *a, **k: (realize(*a, **k)[0], price), raising=True
    )
    target = np.array([EASY]) / effort.normalization.std
    _, chosen, expected = effort.pipeline._search(prepared, target, seeds, False, keep=4)
    assert chosen[0, :4].tolist() == [0, 1, 2, 3] and expected.tolist() == [4.0]


def test_exploring_power_rests_fins_for_good(search: SearchAllocator) -> None:
    result = search.allocate(load_layout("A"), EASY)
    modes = result.explore()
    assert modes[0].resting == () and {mode.resting for mode in modes} > {()}
    assert all(mode.power >= (1.0 - 1e-4) * result.power for mode in modes)
    for mode in modes[1:]:
        for i in mode.resting:  # but for what the last refinement asks of them
            np.testing.assert_allclose(mode.command[i, :2], result.layout.lower[i, :2], rtol=0.05)
        others = [k for k in range(4) if k not in mode.resting]
        assert (mode.command[others, 1] > 0.3).all()


def test_fresh_starts_are_spread_over_the_limits(prepared: Prepared) -> None:
    found = _fresh_starts(prepared, 2, 32)
    lower, upper = prepared.plant.lower, prepared.plant.upper
    assert found.shape == (2, 32, *lower.shape)
    assert (found >= lower).all() and (found <= upper).all()
    share = (found[0] - lower) / (upper - lower)
    assert share.min() < 0.1 and share.max() > 0.9
    np.testing.assert_array_equal(found[0], found[1])


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


def refined(
    prepared: Prepared, target: np.ndarray, command: np.ndarray, steps: int, **options: bool
) -> RefinedCandidates:
    origin = np.tile(np.arange(command.shape[1]), (len(command), 1))
    return refine_candidates(prepared, target, command, origin, steps, **options)


def answers(prepared: Prepared, target: np.ndarray, p: int, steps: int) -> RefinedCandidates:
    return refined(prepared, target, drawn(prepared, len(target), p), steps)


def reachable(prepared: Prepared, rows: int) -> np.ndarray:
    return prepared.commands.wrench(drawn(prepared, rows, seed=7))


def test_refined_answers_say_what_they_give(prepared: Prepared) -> None:
    target = reachable(prepared, 3)
    found = answers(prepared, target, 5, 4)
    for row in range(3):
        np.testing.assert_allclose(found.wrench[row], prepared.commands.wrench(found.command[row]), atol=1e-9)
        error = np.linalg.norm(found.wrench[row] - target[row], axis=-1)
        np.testing.assert_allclose(found.error[row], error, atol=1e-9)
        np.testing.assert_allclose(found.cost[row], prepared.cost(found.command[row]))
        order = rank(found.cost[row], found.error[row], RANKING.exact_error, RANKING.error_resolution)
        assert (np.diff(order) >= 0.0).all()


def test_a_robot_in_motion_keeps_its_mode_for_a_small_gain(effort: SearchAllocator) -> None:
    prepared = effort.pipeline.prepare(load_layout(shipped_layouts()["A"]))
    target = reachable(prepared, 1)
    found = refined(prepared, target, drawn(prepared, 1, 24), 40)
    exact = np.flatnonzero(found.error[0] <= RANKING.exact_error)
    energy = found.cost[0, exact]
    close = [k for k in exact[1:] if energy[0] < found.cost[0, k] < energy[0] * 1.3]
    assert close, "two modes of nearly the same energy"
    kept, best = found.command[:, close[0]], found.command[:, 0]
    meter = prepared.cost
    gain = 1.0 - float(meter(best)[0] / meter(kept)[0])
    both = np.stack([kept, best], axis=1)
    for switch_gain, first in ((1.1 * gain, kept), (0.9 * gain, best)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(
                "finlab.allocation.search.refined_candidates.RANKING",
                replace(RANKING, switch_gain=switch_gain),
            )
            chosen = refined(prepared, target, both, 0, keep_mode=True)
        np.testing.assert_allclose(chosen.command[0, 0], first[0], atol=1e-6)
    cheapest = refined(prepared, target, both, 0)
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
    reduce_cost(prepared, target, found, MISSED.cost_lm_steps)
    exact = before.error[:, 0] <= RANKING.exact_error
    np.testing.assert_array_equal(found.command[exact], before.command[exact])
    far = ~exact
    assert far.sum() >= 2
    spent, was = (prepared.cost(values.command[far, 0]) for values in (found, before))
    assert (found.error[far, 0] <= before.error[far, 0] + 2 * RANKING.error_resolution).all()
    assert ((spent < was + 1e-9) | (found.error[far, 0] < before.error[far, 0])).all()


# Settings.


@pytest.mark.parametrize("wrong", [{"n_refined": 0}, {"refine_steps": -1}, {"search_steps": -1}])
def test_impossible_settings_are_refused_one_by_one(wrong: dict[str, Any]) -> None:
    with pytest.raises(AllocationError, match=f"{next(iter(wrong))}={next(iter(wrong.values()))}"):
        Settings(**wrong)


def test_the_least_settings_are_enough() -> None:
    Settings(n_refined=1, refine_steps=0, search_steps=1, energy_tradeoff=0.0)
    for weight in (-1e-9, math.inf, math.nan):
        with pytest.raises(AllocationError, match="energy_tradeoff"):
            Settings(energy_tradeoff=weight)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"objective": "watts"}, "objective: expected 'power' or 'effort', got 'watts'"),
        ({"copper_loss": -0.1}, "copper_loss: expected watts per .*, from 0, got -0.1"),
        ({"copper_loss": math.inf}, "copper_loss: .* got inf"),
        ({"copper_loss": math.nan}, "copper_loss: .* got nan"),
        ({"energy_weights": 3}, "a setting has the wrong type .*expected EnergyWeights, got 3"),
        (
            {"energy_tradeoff": 0.1},
            "energy_tradeoff: the weighted sum is one of error and effort, got objective",
        ),
    ],
)
def test_impossible_objectives_are_refused(options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(AllocationError, match=sentence) as caught:
        load_allocator(**options)
    assert "\n" not in str(caught.value)
    with pytest.raises(AllocationError, match=sentence):
        load_allocator().with_settings(**options)


def test_other_settings_keep_what_is_known_of_layouts(search: SearchAllocator) -> None:
    layout = load_layout("A")
    known = search.pipeline.prepare(layout)
    longer = search.with_settings(refine_steps=3)
    assert longer.pipeline.prepare(layout) is known and longer.pipeline.settings.refine_steps == 3
    assert search.pipeline.settings.refine_steps == 1
    other = search.with_settings(objective="effort")
    assert other.pipeline.prepare(layout) is not known and other.objective == Objective("effort")
    assert other.options["objective"] == "effort" and search.options["objective"] == "power"
    assert set(search.option_names()) == set(search.options)
    answers = [method.allocate(layout, EASY) for method in (other, load_allocator(objective="effort"))]
    np.testing.assert_array_equal(answers[0].command, answers[1].command)


def test_constants_of_the_search_keep_their_order() -> None:
    assert RANKING.exact_error < RANKING.error_resolution < SEARCH.alternative_error
    assert SEARCH.alternative_error < SEARCH.promising_error < 0.1
    assert 0.0 < RANKING.switch_gain < 0.1
    assert MISSED.first_lm_steps < MISSED.nearest_lm_steps < MISSED.last_lm_steps
    assert 0.0 < MISSED.needless_share < 0.01 and RANKING.exact_error < MISSED.needless_error < 1e-3
    assert SEARCH.tick_lm_steps <= MISSED.nearest_lm_steps
    assert search_allocator.CHUNK > 100
