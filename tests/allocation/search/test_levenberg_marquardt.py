"""Levenberg-Marquardt on commands: never worse, never outside the limits, never NaN."""

import math
import warnings

import numpy as np
import pytest

from finlab.allocation.search.levenberg_marquardt import CommandProblem, _smallest_change, refine
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.layout import Fin, FinModelSpec, Layout, Limits, random_layout


def problem_of(search: SearchAllocator, layout: Layout) -> CommandProblem:
    return search.pipeline.prepare(layout).commands


def draw(problem: CommandProblem, rows: int, seed: int) -> np.ndarray:
    share = np.random.default_rng(seed).uniform(size=(rows, *problem.lower.shape))
    return np.asarray(problem.lower + share * (problem.upper - problem.lower))


def error(problem: CommandProblem, target: np.ndarray, command: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(target - problem.wrench(command), axis=-1))


def keeps_limits(problem: CommandProblem, command: np.ndarray) -> bool:
    return bool((command >= problem.lower).all() and (command <= problem.upper).all())


SHARED = (0.1, 0.05, 0.0)
HOSTILE = {
    "one fin": Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)),
    "two at one place": Layout("twins", (Fin("a", SHARED, 0.3), Fin("b", SHARED, 0.3))),
    "all parallel": Layout("rake", tuple(Fin(f"f{i}", (0.1 * i, 0.0, 0.0), 0.5) for i in range(3))),
    "no width": Layout(
        "stiff",
        (
            Fin("a", (0.1, 0.0, 0.0), 0.0, Limits((0.3, 0.3), (1.0, 1.0), (0.5, 0.5))),
            Fin("b", (-0.1, 0.0, 0.0), 1.0, Limits((0.05, 0.6), (2.0, 2.0), (-1.0, 1.0))),
        ),
    ),
    "may rest": Layout(
        "rest", (Fin("a", SHARED, 0.0, Limits((0.0, 0.6), (0.0, 2.1))), Fin("b", (0, 0, 0), 2.0))
    ),
}


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_never_makes_it_worse_and_mostly_much_better(limits: str, search: SearchAllocator) -> None:
    before, after = [], []
    for seed in range(5000, 5010):
        layout = random_layout(np.random.default_rng(seed), limits=limits)  # type: ignore[arg-type]
        problem = problem_of(search, layout)
        target, start = problem.wrench(draw(problem, 20, 1)), draw(problem, 20, 2)
        refined = refine(problem, target, start, 30)
        assert keeps_limits(problem, refined.command)
        before.append(error(problem, target, start))
        after.append(error(problem, target, refined.command))
        np.testing.assert_allclose(refined.error, after[-1], atol=1e-9)
        np.testing.assert_allclose(refined.wrench, problem.wrench(refined.command), atol=1e-9)
    first, last = np.concatenate(before), np.concatenate(after)
    assert (last <= first + 1e-12).all()
    assert np.median(first) > 0.5 and (last < 0.05 * first).mean() > 0.7


def test_finds_the_way_back_from_nearby(search: SearchAllocator) -> None:
    problem = problem_of(search, random_layout(np.random.default_rng(5003), n_fins=5))
    middle = problem.lower + (0.3 + 0.4 * np.random.default_rng(0).uniform(size=(30, 5, 3))) * (
        problem.upper - problem.lower
    )
    start = problem.feasible(middle + 0.02 * np.random.default_rng(1).normal(size=middle.shape))
    target = problem.wrench(middle)
    assert error(problem, target, start).min() > 1e-3
    refined = refine(problem, target, start, 12)
    assert np.quantile(refined.error, 0.9) < 1e-7


@pytest.mark.parametrize("scale", [1.0, 1e6])
@pytest.mark.parametrize("name", list(HOSTILE))
def test_hostile_layouts_give_numbers_inside_the_limits(
    name: str, scale: float, search: SearchAllocator
) -> None:
    problem = problem_of(search, HOSTILE[name])
    target = scale * np.random.default_rng(0).normal(size=(40, 6))
    starts = draw(problem, 40, 1)
    starts[0], starts[1] = problem.lower, problem.upper
    refined = refine(problem, target, starts, 20)
    assert np.isfinite(refined.command).all() and np.isfinite(refined.error).all()
    assert keeps_limits(problem, refined.command)
    assert (error(problem, target, refined.command) <= error(problem, target, starts) * (1 + 1e-12)).all()


STRONG = {
    "drag": (FinModelSpec(), Limits((0.0, 1.5), (0.0, 20.0))),
    "soft": (FinModelSpec("soft", (("k", 20.0),)), Limits((1.5, 1.5), (0.1, 20.0), (0.3, 0.3))),
}


@pytest.mark.parametrize(("model", "limits"), STRONG.values(), ids=list(STRONG))
def test_strong_fins_on_long_levers_give_numbers(
    model: FinModelSpec, limits: Limits, search: SearchAllocator
) -> None:
    """Their derivatives are large and of too low a rank: without a relative ridge a step is no number.

    The force of soft fins at their upper limits is nothing beside their largest.
    """
    layout = Layout("far", tuple(Fin(f"f{i}", (8.0, 5.0, 1.0), 0.3 + i, limits, model) for i in range(3)))
    problem = problem_of(search, layout)
    target = 1e3 * np.random.default_rng(0).normal(size=(200, 6))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refined = refine(problem, target, draw(problem, 200, 1), 40)
    assert np.isfinite(refined.command).all() and np.isfinite(refined.error).all()


def test_a_start_a_whole_turn_off_is_the_same_start(search: SearchAllocator) -> None:
    limits = Limits(zero_direction=(0.0, 2.0 * math.pi))
    problem = problem_of(search, Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0, limits),)))
    start = np.array([[[0.4, 1.5, -1.0]]])
    refined = refine(problem, problem.wrench(start), start, 0)
    np.testing.assert_allclose(refined.command[0, 0], [0.4, 1.5, 2.0 * math.pi - 1.0])
    assert refined.error[0] < 1e-9


def test_commands_without_room_stay_bit_for_bit(search: SearchAllocator) -> None:
    problem = problem_of(search, HOSTILE["no width"])
    refined = refine(problem, np.random.default_rng(0).normal(size=(10, 6)), draw(problem, 10, 1), 10)
    assert (refined.command[:, 0] == [0.3, 1.0, 0.5]).all()
    assert (refined.command[:, 1, 1] == 2.0).all()
    assert np.ptp(refined.command[:, 1, 0]) > 0.01  # what has room moves


def test_rows_do_not_see_each_other(search: SearchAllocator) -> None:
    problem = problem_of(search, random_layout(np.random.default_rng(5004), n_fins=4))
    target, start = problem.wrench(draw(problem, 6, 1)), draw(problem, 6, 2)
    together = refine(problem, target, start, 8)
    for row in range(6):
        alone = refine(problem, target[row : row + 1], start[row : row + 1], 8)
        np.testing.assert_allclose(together.error[row], alone.error[0], rtol=1e-3, atol=1e-6)


def test_a_direction_may_cross_the_seam(search: SearchAllocator) -> None:
    # The answer lies just across +-pi from the start, and nearly a full turn away the other way round.
    problem = problem_of(search, Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)))
    start = np.array([[[0.4, 1.5, math.pi - 0.1]]])
    target = problem.wrench(np.array([[[0.4, 1.5, -math.pi + 0.1]]]))
    refined = refine(problem, target, start, 15)
    assert refined.error[0] < 1e-6
    assert refined.command[0, 0, 2] == pytest.approx(-math.pi + 0.1, abs=1e-3)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_clamp_wraps_and_clips_in_either_precision(kind: type, search: SearchAllocator) -> None:
    limits = Limits((0.1, 0.5), (0.2, 1.0), (0.5, 2.0))
    problem = problem_of(search, Layout("arc", (Fin("a", SHARED, 0.0, limits), Fin("b", (0, 0, 0), 1.0))))
    command = np.array([[0.7, 0.0, 1.0 - 2 * math.pi], [0.3, 1.0, 7.0]], dtype=kind)
    clamped = problem.feasible(command)
    assert clamped.dtype == kind
    np.testing.assert_allclose(clamped, [[0.5, 0.2, 1.0], [0.3, 1.0, 7.0 - 2 * math.pi]], rtol=1e-6)


@pytest.fixture
def mixed(search: SearchAllocator) -> CommandProblem:
    """A fin that turns freely and one in an arc."""
    arc = Limits((0.1, 0.5), (0.3, 1.4), (0.3, 1.7))
    return problem_of(
        search,
        Layout("two", (Fin("a", (0.2, 0.1, 0.0), 0.4), Fin("b", (-0.3, 0.2, 0.1), 2.0, limits=arc))),
    )


def test_edges_are_just_within_the_limits_except_where_fins_turn_freely(mixed: CommandProblem) -> None:
    low, high = mixed.edges
    lower, upper = mixed.lower + 1e-9, mixed.upper - 1e-9
    lower[0, 2], upper[0, 2] = -np.inf, np.inf
    np.testing.assert_array_equal(low, lower)
    np.testing.assert_array_equal(high, upper)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_limits_as_each_type_sees_them(mixed: CommandProblem, kind: type[np.floating]) -> None:
    limits = mixed.float64 if kind is np.float64 else mixed.float32
    assert all(part.dtype == kind for part in limits)
    np.testing.assert_allclose(limits.lower, mixed.lower, rtol=1e-6)
    np.testing.assert_allclose(limits.upper, mixed.upper, rtol=1e-6)
    middle = (mixed.lower[:, 2] + mixed.upper[:, 2]) / 2
    np.testing.assert_allclose(limits.seam, middle - math.pi, rtol=1e-6)
    np.testing.assert_allclose(limits.half, (mixed.upper - mixed.lower) / 2, rtol=1e-6)
    assert limits.turn == pytest.approx(2 * math.pi)
    command = np.array(
        [[(9.0, -1.0, 4.0), (0.2, 0.4, 1.9 + 2 * math.pi)], [(0.3, 1.0, -4.0), (0.2, 0.4, 4.0)]]
    )
    given = command.astype(kind)
    found = mixed.feasible(given)
    a, f = mixed.upper[0, 0], mixed.lower[0, 1]
    turn = 2 * math.pi
    expected = [[(a, f, 4.0 - turn), (0.2, 0.4, 1.7)], [(0.3, 1.0, turn - 4.0), (0.2, 0.4, 1.7)]]
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert found.dtype == kind
    np.testing.assert_array_equal(given, command.astype(kind))


def test_the_ridge_is_by_the_derivatives_themselves() -> None:
    """One command changes its axis a thousand times more than another one does, or a million times."""
    for large in (1e2, 1e4):
        small, damping, right = 1e-4, 3e-10, np.ones((1, 6, 1))
        free = np.zeros((1, 3, 6))
        free[0, 0, 0], free[0, 1, 5] = large, small
        change = _smallest_change(free, right, np.array([damping]))
        ridge = damping + 1e-9 + 1e-14 * (large**2 + small**2)
        expected = [1.0 / large, small / (small**2 + ridge), 0.0]
        np.testing.assert_allclose(change[0, :, 0], expected, rtol=1e-6)
