"""Compiled fins side by side: look-ups against the laws themselves, projections against brute force."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.envelopes import LONGEST_TURN, RIM, Envelopes, largest_forces, layout_envelopes
from finlab.forces.fin_envelope import (
    AMPLITUDE,
    COST,
    DRIFT,
    FREQUENCY,
    LEAN,
    LEVELS,
    MOBILITY,
    SHAFT,
    STIFFNESS,
)
from finlab.forces.fin_sets import planar_sets
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.layout.angles import wrapped
from finlab.physics import make_law
from finlab.physics.objective import Name, Objective
from tests.forces.conftest import THRUST, problem_of
from tests.random_fins import write_fin_table

Array = NDArray[np.float64]

UNEVEN = FinModelSpec("soft", (("e", 0.2), ("phi_e", 1.0)))
LEANING = FinModelSpec("soft", (("d", 0.15), ("e", 0.1), ("phi_e", -2.0)))
ARC = (-1.0, 1.5)


def robot(*fins: tuple[FinModelSpec, Limits]) -> Layout:
    return Layout(
        "some",
        tuple(Fin(f"fin_{i}", (0.2, 0.1 * i, 0.05), 0.7 * i, *(fin[::-1])) for i, fin in enumerate(fins)),
    )


def stack(*fins: tuple[FinModelSpec, Limits], objective: Name = "power") -> Envelopes:
    return layout_envelopes(robot(*fins), Objective(objective))


FINS = (
    (FinModelSpec("drag"), Limits()),
    (UNEVEN, Limits()),
    (LEANING, Limits(zero_direction=ARC)),
    (FinModelSpec("lighthill"), Limits((0.1, 0.5), (0.4, 2.0), (0.5, 4.5))),
)
"""All round, uneven, with stops and a lean, with an arc wider than half a turn."""


@pytest.fixture(scope="module", params=["power", "effort"])
def objective(request: pytest.FixtureRequest) -> Objective:
    return Objective(request.param)


def inside(rows: int, seed: int = 0) -> Array:
    """Random directions (rows, 4) [rad] within the arcs of `FINS`, some told a turn later or earlier."""
    rng = np.random.default_rng(seed)
    ends = np.array([[-np.pi, np.pi], [-np.pi, np.pi], [ARC[0] + 0.15, ARC[1] + 0.15], [0.5, 4.5]])
    inner = rng.uniform(ends[:, 0] + 0.02, ends[:, 1] - 0.02, (rows, 4))
    return inner + 2.0 * np.pi * rng.integers(-1, 2, (rows, 4))


def test_the_rim_is_the_laws_own() -> None:
    """Largest and smallest force by the formula of the soft fin; they depend on the direction."""
    fins, direction = stack(*FINS), inside(200)
    rim = fins.rim(direction)
    share = 1.0 + 0.2 * np.cos(direction[:, 1] - 1.0)
    x = np.linspace(0.0, 0.6 * 2.1, 200001)
    most = (3.6 * x / (1.0 + (x / 1.3) ** 5)).max()
    np.testing.assert_allclose(rim.largest[:, 1], most * share, rtol=1e-3)
    np.testing.assert_allclose(rim.bend[:, 1], -0.2 * most * np.sin(direction[:, 1] - 1.0), atol=0.02 * most)
    np.testing.assert_allclose(rim.smallest[:, 1], 3.6 * 0.005 * share, rtol=2e-3)
    share = 1.0 + 0.1 * np.cos(direction[:, 2] - 0.15 + 2.0)
    np.testing.assert_allclose(rim.largest[:, 2], most * share, rtol=1e-3)
    np.testing.assert_allclose(rim.largest[:, 0], THRUST, rtol=1e-6)
    np.testing.assert_allclose(rim.bend[:, (0, 3)], 0.0, atol=1e-9)
    assert fins.maximum == pytest.approx(
        [THRUST, 1.2 * most, (1.0 + 0.1 * np.cos(1.0)) * most, rim.largest[0, 3]], rel=1e-3
    )
    assert fins.minimum == pytest.approx(fins.smallest.max(axis=1))
    np.testing.assert_array_equal(fins.without_rest().rim(direction).smallest, 0.0)
    np.testing.assert_array_equal(fins.without_rest().rim(direction).largest, rim.largest)
    np.testing.assert_array_equal(largest_forces(robot(*FINS)), fins.maximum)


def test_directions_outside_the_arc_are_those_of_its_nearest_end() -> None:
    fins = stack(*FINS[2:3], FINS[1])
    start, end = ARC[0] + 0.15, ARC[1] + 0.15
    behind = 0.5 * (start + end) + np.pi
    asked = np.array([start - 0.02, start, end, end + 0.5, behind - 0.2])
    held = np.array([start, start, end, end, end])
    for given, ends in ((asked, held), (asked + 2.0 * np.pi, held), (asked - 4.0 * np.pi, held)):
        found, expected = (fins.rim(np.stack([d, d], axis=1)).largest[:, 0] for d in (given, ends))
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_look_ups_give_commands_that_push_as_asked_at_the_cost_that_is_told(objective: Objective) -> None:
    layout = robot(*FINS)
    fins, direction = layout_envelopes(layout, objective), inside(300)
    rim = fins.rim(direction)
    share = np.random.default_rng(1).uniform(0.02, 0.98, direction.shape)
    size = rim.smallest + share * (rim.largest - rim.smallest)
    row = fins.lookup(rim, size)
    assert row.shape == (300, 4, 8)
    command = np.stack([row[..., AMPLITUDE], row[..., FREQUENCY], direction - row[..., LEAN]], axis=-1)
    for i, fin in enumerate(layout.fins):
        law = make_law(fin.model)
        force = law.force(command[:, i])[:, 1:]
        wanted = size[:, i, None] * np.stack([np.cos(direction[:, i]), np.sin(direction[:, i])], axis=1)
        off = np.linalg.norm(force - wanted, axis=1) / fins.maximum[i]
        assert np.median(off) < 3e-4 and np.quantile(off, 0.9) < 2e-3
        cost = objective.fin_cost(law, np.array(fin.limits.upper))(command[:, i])
        apart = np.abs(row[:, i, COST] - cost) / cost.max()
        assert np.median(apart) < 1e-3 and apart.max() < 1e-2


def test_slopes_are_those_of_the_cost_that_is_looked_up() -> None:
    """Marginal cost, its elasticity and what turning costs, each against differences of look-ups."""
    fins, direction = stack(*FINS), inside(400, seed=2)
    rim = fins.rim(direction)
    share = np.random.default_rng(3).uniform(0.1, 0.8, direction.shape)
    size = rim.smallest + share * (rim.largest - rim.smallest)
    row = fins.lookup(rim, size)

    def cost(size: Array, turned: float = 0.0) -> Array:
        return np.asarray(fins.lookup(fins.rim(direction + turned), size)[..., COST])

    step = 0.05 * size
    slope = (cost(size + step) - cost(size - step)) / (2.0 * step)
    marginal = size / np.exp(row[..., MOBILITY])
    off = np.abs(marginal / slope - 1.0)
    assert (np.median(off, axis=0) < 0.01).all() and (np.quantile(off, 0.9, axis=0) < 0.06).all()
    higher, lower = (np.exp(fins.lookup(rim, s)[..., MOBILITY]) for s in (size + step, size - step))
    rise = ((size + step) / higher - (size - step) / lower) / (2.0 * step)
    elastic = rise * size / marginal
    off = np.abs(row[..., STIFFNESS] / elastic - 1.0)[elastic > 0.4]
    assert np.median(off) < 0.02 and np.quantile(off, 0.9) < 0.1
    turning = (cost(size, 0.1) - cost(size, -0.1)) / 0.2
    inner = np.abs(wrapped(direction - fins.middle)) < fins.half - 0.15
    gap = np.abs(row[..., DRIFT] * marginal - turning) / row[..., COST]
    assert np.median(gap[inner][:, None]) < 0.005 and np.quantile(gap[inner], 0.9) < 0.03
    assert np.abs(turning / row[..., COST])[:, 1].max() > 0.2, "there is something to find"


def test_sizes_beyond_the_range_are_those_of_its_ends() -> None:
    fins, direction = stack(*FINS), inside(5)
    rim = fins.rim(direction)
    for asked, held in ((0.0 * rim.smallest, rim.smallest), (2.0 * rim.largest, rim.largest)):
        np.testing.assert_allclose(fins.lookup(rim, asked), fins.lookup(rim, held), rtol=2e-5, atol=1e-9)


def test_entries_of_the_table_are_looked_up_as_they_are() -> None:
    fins = stack(*FINS)
    count = fins.largest.shape[1]
    share = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, LEVELS)) ** 4
    table = fins.table.reshape(4, count, LEVELS, 8)
    for k, level in ((0, 3), (7, 0), (24, 20), (count - 1, 40), (count - 2, LEVELS - 1)):
        angle = fins.domain[0] + fins.domain[1] * (2.0 * k / (count - 1) - 1.0)
        size = fins.smallest[:, k] + share[level] * (fins.largest - fins.smallest)[:, k]
        inner = angle[None] - 1e-12 * (k == count - 1)  # the last direction of a circle is the first, too
        found = fins.lookup(fins.rim(inner), size[None])[0]
        np.testing.assert_allclose(found, table[:, k, level], rtol=2e-5, atol=1e-9)


def test_a_lean_is_told_of_strong_forces() -> None:
    fins = stack(*FINS)
    lean = fins.lean(np.array([0.3, 0.4, 0.5, 1.0]))
    assert lean == pytest.approx([0.0, 0.0, 0.15, 0.0], abs=2e-3)


def distance_by_brute_force(fins: Envelopes, i: int, given: Array) -> Array:
    """Distances (R,) [N] from planar forces (R, 2) to the nearest that fin i can give, of a fine grid."""
    middle, half = float(fins.middle[i]), float(fins.half[i])
    angle = np.linspace(middle - half, middle + half, 601)
    rim = fins.rim(np.repeat(angle[:, None], len(fins.middle), axis=1))
    smallest, largest = (
        np.broadcast_to(r, (601, len(fins.middle)))[:, i] for r in (rim.smallest, rim.largest)
    )
    size = smallest + np.linspace(0.0, 1.0, 101)[:, None] * (largest - smallest)
    every = (size * np.exp(1j * angle)).ravel()
    return np.abs(every - (given[:, 0] + 1j * given[:, 1])[:, None]).min(axis=1)


@pytest.mark.parametrize("fins", [FINS[:1], FINS[3:], FINS, (*FINS[:1], *FINS[3:])])
def test_projections_are_the_nearest_forces(fins: tuple[tuple[FinModelSpec, Limits], ...]) -> None:
    """At the rim of an uneven fin a step of first order goes towards it."""
    known = stack(*fins)
    n = len(fins)
    rng = np.random.default_rng(5)
    angle = rng.uniform(-np.pi, np.pi, (60, n))
    asked = known.maximum * rng.uniform(0.0, 1.25, (60, n)) ** 2
    force = np.stack([asked * np.cos(angle), asked * np.sin(angle)], axis=1)
    found = known.project(force, asked)
    np.testing.assert_allclose(np.linalg.norm(found.unit, axis=1), 1.0, rtol=1e-12)
    away = np.linalg.norm(found.unit * found.size[:, None] - force, axis=1)
    for i in range(n):
        best = distance_by_brute_force(known, i, force[..., i])
        uneven = np.ptp(known.largest[i]) > 0.01 * known.maximum[i]
        slack = np.where(uneven & (asked[:, i] > 0.8 * known.maximum[i]), 0.015, 0.006) * known.maximum[i]
        assert (away[:, i] <= best + slack).all()
        assert (away[:, i] > best - 0.01 * known.maximum[i]).all(), "nothing is nearer than the nearest"
        held = np.abs(wrapped(angle[:, i] - known.middle[i])) > known.half[i]
        assert held.any() == (known.half[i] < np.pi)
        stopped = found.stopped[:, i] if found.stopped is not None else np.zeros(60, bool)
        np.testing.assert_array_equal(stopped, held)
    direction = np.arctan2(found.unit[:, 1], found.unit[:, 0])
    for name in ("largest", "smallest"):
        there = getattr(known.rim(direction), name)
        np.testing.assert_allclose(getattr(found.rim, name), there, rtol=1e-6)
    if known.largest.shape[1] > 1 or not known.turns_fully:
        assert np.abs(wrapped(found.direction - direction)).max() < 1e-9


def test_what_is_wanted_ignores_the_limits_of_size() -> None:
    """Inside the arc it is the size itself; beyond a stop what lies along it, nothing past 90 deg."""
    low, high = -0.5, 1.0
    fins = stack((FinModelSpec("drag"), Limits(zero_direction=(low, high))))
    angle = np.array([[0.4], [low - 0.4], [high + 0.7], [low - 1.9]])
    size = np.array([[50.0], [40.0], [30.0], [20.0]])
    found = fins.project(np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1), size)
    assert found.wanted[:, 0] == pytest.approx([50.0, 40.0 * np.cos(0.4), 30.0 * np.cos(0.7), 0.0])
    assert found.direction[:, 0] == pytest.approx([0.4, low, high, low])
    assert found.size[:, 0] == pytest.approx([*[fins.maximum[0]] * 3, fins.minimum[0]])
    assert found.stopped is not None and found.stopped[:, 0].tolist() == [False, True, True, True]


def test_an_uneven_fin_turns_to_where_its_rim_is_farther_out() -> None:
    fins = stack(FINS[1])
    angle, size = np.array([[1.0 + 0.8], [1.0 - 0.8], [1.0]]), np.full((3, 1), 2.0 * fins.maximum[0])
    found = fins.project(np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1), size)
    turn = wrapped(found.direction - angle)[:, 0]
    assert turn[0] < -0.02 and turn[1] == pytest.approx(-turn[0], rel=0.1) and abs(turn[2]) < 5e-3
    assert np.abs(turn).max() <= LONGEST_TURN
    np.testing.assert_array_equal(found.wanted, size), "where limits of size do not hold"
    np.testing.assert_allclose(found.size, found.rim.largest)


def test_within_keeps_the_same_fins_in_narrower_arcs() -> None:
    whole, narrow = stack(*FINS[:2]), Limits(zero_direction=(0.2, 1.2))
    kept = whole.within(np.array([0.7, 0.7]), np.array([0.5, 0.5]))
    assert whole.turns_fully and not kept.turns_fully
    alone = stack((FinModelSpec("drag"), narrow), (UNEVEN, narrow))
    rng = np.random.default_rng(6)
    force = rng.normal(size=(40, 2, 2)) * 2.0
    size = np.linalg.norm(force, axis=1)
    found, expected = kept.project(force, size), alone.project(force, size)
    np.testing.assert_allclose(found.size, expected.size, rtol=5e-3)
    np.testing.assert_allclose(found.direction[:, 0], expected.direction[:, 0], atol=1e-6)
    np.testing.assert_allclose(found.direction[:, 1], expected.direction[:, 1], atol=2e-2)
    assert found.stopped is not None and expected.stopped is not None
    np.testing.assert_array_equal(found.stopped, expected.stopped)
    # What a force costs does not depend on where the fin may turn besides.
    inner = np.full((9, 2), 0.7) + np.linspace(-0.4, 0.4, 9)[:, None]
    size = np.full((9, 2), 1.0)
    row, other = kept.lookup(kept.rim(inner), size), alone.lookup(alone.rim(inner), size)
    np.testing.assert_allclose(row[..., COST], other[..., COST], rtol=5e-3)


def test_the_polygon_around_an_uneven_fin_is_its_support() -> None:
    """How far the hull of r(theta) = m (1 + e cos(theta - phi)) reaches along RIM directions."""
    layout = robot(*FINS[:3])
    sets = planar_sets(problem_of(layout))
    fins = layout_envelopes(layout, Objective())
    assert sets.rim is not None and sets.rim.shape == (1, 3, RIM)
    along = 2.0 * np.pi * np.arange(RIM) / RIM
    theta = np.linspace(-np.pi, np.pi, 4001)
    support = ((1.0 + 0.2 * np.cos(theta - 1.0)) * np.cos(theta - along[:, None])).max(axis=1) / 1.2
    np.testing.assert_allclose(sets.rim[0, 1], support, rtol=3e-3)
    np.testing.assert_allclose(sets.rim[0, 0], 1.0, rtol=3e-3)
    theta = np.linspace(ARC[0] + 0.15, ARC[1] + 0.15, 4001)
    arc = ((1.0 + 0.1 * np.cos(theta - 0.15 + 2.0)) * np.cos(theta - along[:, None])).max(axis=1)
    strongest = (1.0 + 0.1 * np.cos(theta - 0.15 + 2.0)).max()
    np.testing.assert_allclose(sets.rim[0, 2], np.maximum(arc, 0.0) / strongest, atol=4e-3)
    np.testing.assert_array_equal(sets.radius[0], fins.maximum)
    np.testing.assert_array_equal(
        np.stack([sets.middle[0], sets.half[0]]), np.stack([fins.middle, fins.half])
    )
    even = planar_sets(problem_of(robot(FINS[0], FINS[3])))
    assert even.rim is None
    made = problem_of(layout)
    for i in range(3):
        np.testing.assert_array_equal(sets.columns[0, i], made.columns[[i, i + 3]])


def test_a_force_along_the_shaft_is_noticed(tmp_path: Path) -> None:
    law = make_law(FinModelSpec())
    for sideways, noticed in ((0.0, False), (1e-6, True), (0.1, True)):
        spec = write_fin_table(
            tmp_path / f"{sideways}.csv", law, Limits(), sideways=sideways, points=(4, 4, 9)
        )
        fins = stack((spec, Limits()), FINS[0])
        assert fins.pushes_sideways == noticed
    row = fins.lookup(fins.rim(np.zeros((1, 2))), fins.maximum[None])[0, :, SHAFT]
    assert row == pytest.approx([0.1 * THRUST, 0.0], rel=1e-2)


def test_all_fins_that_are_the_same_all_round_need_one_direction_only() -> None:
    fins = stack(FINS[0], FINS[3])
    assert fins.largest.shape == (2, 1) and fins.rim_shares is None
    rim = fins.rim(np.zeros((3, 2)))
    assert rim.part is None and rim.bend == 0.0
    mixed = stack(FINS[0], FINS[1])
    direction = inside(20)[:, :2]
    size = np.full((20, 2), 0.4 * THRUST)
    alone = fins.lookup(fins.rim(direction), size)[:, 0]
    np.testing.assert_allclose(mixed.lookup(mixed.rim(direction), size)[:, 0], alone, rtol=1e-9)
    moved = replace(robot(FINS[0], FINS[1]), name="other")
    assert layout_envelopes(moved, Objective()) is mixed, "the stack is shared"
