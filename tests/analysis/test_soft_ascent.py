"""All facets of thrusters are as an oracle finds them, slopes are those of differences, and an
ascent raises the goal within bounds and rules."""

from collections.abc import Callable
from math import comb

import numpy as np
import pytest

from finlab.analysis import Bounds
from finlab.analysis.climb import CLEARANCE, ROUNDING, Rules
from finlab.analysis.moves import Moves
from finlab.analysis.slopes import WeakestDirection
from finlab.analysis.soft_ascent import (
    HOP_PARENTS,
    HOP_SIZE,
    HOPS_OF_EACH,
    FacetTable,
    SoftAscent,
    facets_of,
    has_few_facets,
)
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.layout import Layout
from tests.analysis.zonotope_oracle import largest_ball

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""
MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""All axes."""
TURN = (-np.pi, np.pi)
"""A whole turn."""
CUBE = Bounds((-0.2, 0.2), (-0.2, 0.2), (-0.2, 0.2), TURN, TURN)
"""A cube, all directions."""


def ascent_of(
    layout: Layout, mirror: tuple[tuple[str, str], ...] = ()
) -> tuple[SoftAscent, Moves, Rules]:
    """The ascent of all actuators of a layout within the cube."""
    moves = Moves(layout, layout.names, dict.fromkeys(layout.names, CUBE), mirror)
    rules = Rules(moves, None)
    return SoftAscent(WeakestDirection(moves, MOTIONS, after_loss=False), rules), moves, rules


def random_vectors(moves: Moves, count: int, seed: int = 0) -> Array:
    """Random vectors (count, D) within bounds."""
    shape = (count, len(moves.start))
    return np.random.default_rng(seed).uniform(moves.lower, moves.upper, shape)


@pytest.mark.parametrize(("n", "m"), [(6, 6), (7, 6), (8, 6), (5, 3)])
def test_the_nearest_facet_is_that_of_the_oracle(n: int, m: int) -> None:
    columns = np.random.default_rng(n).standard_normal((50, n, m))
    one = np.ones(n)
    table = FacetTable(n, m, after_loss=False)
    distance = facets_of(columns, -one, one, table).distance
    assert distance.shape == (50, comb(n, m - 1)), "each facet once"
    assert distance.min(axis=-1) == pytest.approx(largest_ball(columns), rel=1e-5)


@pytest.mark.parametrize(("n", "m"), [(7, 6), (8, 6), (5, 3)])
def test_the_nearest_facet_after_the_worst_loss(n: int, m: int) -> None:
    columns = np.random.default_rng(n).standard_normal((50, n, m))
    one = np.ones(n)
    table = FacetTable(n, m, after_loss=True)
    distance = facets_of(columns, -one, one, table).distance.min(axis=-1)
    after = [largest_ball(np.delete(columns, k, axis=1)) for k in range(n)]
    assert distance == pytest.approx(np.min(after, axis=0), rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("after_loss", [False, True])
def test_slopes_of_distances_are_those_of_differences(after_loss: bool) -> None:
    random = np.random.default_rng(1)
    columns = random.standard_normal((3, 8, 6))
    change = random.standard_normal(columns.shape)
    least = -random.uniform(0.5, 1.0, 8)
    most = random.uniform(0.5, 1.0, 8)
    table = FacetTable(8, 6, after_loss)
    facets = facets_of(columns, least, most, table)
    weight = random.random(facets.distance.shape)
    step = 1e-6
    ahead = facets_of(columns + step * change, least, most, table).distance
    behind = facets_of(columns - step * change, least, most, table).distance
    difference = (weight * (ahead - behind)).sum(axis=-1) / (2.0 * step)
    slope = (facets.slope(weight) * change).sum(axis=(-1, -2))
    assert slope == pytest.approx(difference, rel=1e-4)


def test_its_distances_are_the_goal_with_uneven_limits(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    ascent, moves, _ = ascent_of(layout)
    vectors = random_vectors(moves, 3)
    goal = WeakestDirection(moves, MOTIONS, after_loss=False)
    found = [goal.evaluate(vector).value for vector in vectors]
    # The goal's faces come from random directions, so that it may miss the nearest one.
    exact = ascent.least_distances(vectors)
    assert (found >= exact * (1.0 - 1e-6)).all()
    assert found == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_the_slope_by_numbers_is_that_of_differences(shipped: Layouts, is_mirrored: bool) -> None:
    layout = shipped("bluerov2_heavy")
    pairs = (("front_right", "front_left"), ("rear_right", "rear_left"))
    ascent, moves, _ = ascent_of(layout, pairs if is_mirrored else ())
    vector = random_vectors(moves, 1)
    column_slope = np.random.default_rng(2).standard_normal((1, layout.n, len(AXES)))
    goal = WeakestDirection(moves, MOTIONS, after_loss=False)
    width = moves.upper - moves.lower
    change = 1e-6 * np.diag(width)
    ahead = goal.columns(vector + change)
    behind = goal.columns(vector - change)
    difference = ((ahead - behind) * column_slope).sum(axis=(-1, -2)) / 2e-6
    slope = ascent._slope_by_columns(vector, column_slope)[0]
    assert slope == pytest.approx(difference, rel=1e-6, abs=1e-6)


def test_it_raises_the_goal_within_bounds_and_rules(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    ascent, moves, rules = ascent_of(layout)
    vectors = random_vectors(moves, 4)
    raised = ascent.raised(vectors)
    assert (raised >= moves.lower).all() and (raised <= moves.upper).all()
    assert (rules.violation(raised) == 0.0).sum() >= 3
    kept = raised[rules.violation(raised) == 0.0]
    assert rules.gaps(kept).min() >= -ROUNDING and CLEARANCE == 0.1
    assert ascent.least_distances(raised).min() > 110.0
    assert ascent.least_distances(vectors).max() < 60.0


def test_hops_raise_it_within_bounds_and_rules(shipped: Layouts) -> None:
    ascent, moves, rules = ascent_of(shipped("bluerov2_heavy"))
    vectors = random_vectors(moves, 1)
    hopped = ascent.hopped(vectors, np.random.default_rng(0))
    assert len(hopped) == HOPS_OF_EACH
    assert (hopped >= moves.lower).all() and (hopped <= moves.upper).all()
    assert (rules.violation(hopped) == 0.0).sum() >= 2
    assert ascent.least_distances(vectors)[0] < 60.0 < 100.0 < ascent.least_distances(hopped).min()


def test_hops_begin_near_the_best(shipped: Layouts) -> None:
    ascent, moves, _ = ascent_of(shipped("bluerov2_heavy"))
    vectors = random_vectors(moves, 20)
    value = ascent.least_distances(vectors)
    best = np.argsort(-value)[:HOP_PARENTS]
    first = ascent.hopped(vectors, np.random.default_rng(1), cancelled=lambda: True)
    again = ascent.hopped(vectors, np.random.default_rng(1), cancelled=lambda: True)
    assert (first == again).all()
    assert len(first) == HOP_PARENTS * HOPS_OF_EACH
    # One step from a change at random; whole turns go round, and places stop at their bounds.
    is_place = ~moves.is_whole_turn
    parents = np.repeat(vectors[best], HOPS_OF_EACH, axis=0)
    change = ((first - parents) / (moves.upper - moves.lower))[:, is_place]
    assert 0.5 * HOP_SIZE < change.std() < 1.5 * HOP_SIZE


def test_half_a_turn_of_a_whole_tilt_reverses_a_thruster(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    _, moves, _ = ascent_of(layout)
    assert len(moves.whole_tilts) == layout.n
    vector = random_vectors(moves, 1)
    turned = vector.copy()
    turned[:, moves.whole_tilts] += np.pi
    before = moves.geometry(vector)[1][0, :, 0]
    after = moves.geometry(turned)[1][0, :, 0]
    assert after == pytest.approx(-before)


def test_it_ends_when_told(shipped: Layouts) -> None:
    ascent, moves, _ = ascent_of(shipped("bluerov2_heavy"))
    calls = list[int]()

    def cancelled() -> bool:
        calls.append(1)
        return len(calls) >= 2

    ascent.raised(random_vectors(moves, 1), cancelled)
    assert len(calls) == 2


def test_where_it_applies(shipped: Layouts) -> None:
    heavy = shipped("bluerov2_heavy")
    _, moves, _ = ascent_of(heavy)
    goal = WeakestDirection(moves, MOTIONS, after_loss=True)
    assert has_few_facets(goal, heavy)
    fins = shipped("A")
    bounds = {fins.names[0]: Bounds.around(fins.actuators[0])}
    fin_goal = WeakestDirection(Moves(fins, fins.names[:1], bounds), MOTIONS, after_loss=False)
    assert not has_few_facets(fin_goal, fins)
    few = heavy.without(heavy.names[:2])
    few_moves = ascent_of(few)[1]
    assert not has_few_facets(WeakestDirection(few_moves, MOTIONS, after_loss=True), few)
