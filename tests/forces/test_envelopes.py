"""Compiled fins side by side: look-ups against the laws themselves, projections against brute force."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.envelopes import BOUNDARY, Envelopes, largest_forces, layout_envelopes
from finlab.forces.fin_envelope import (
    AMPLITUDE,
    COST,
    DEFLECTION,
    FREQUENCY,
    SHAFT,
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
DEFLECTED = FinModelSpec("soft", (("d", 0.15), ("e", 0.1), ("phi_e", -2.0)))
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
    (DEFLECTED, Limits(zero_direction=ARC)),
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
    boundary = fins.boundary(direction)
    share = 1.0 + 0.2 * np.cos(direction[:, 1] - 1.0)
    x = np.linspace(0.0, 0.6 * 2.1, 200001)
    most = (3.6 * x / (1.0 + (x / 1.3) ** 5)).max()
    np.testing.assert_allclose(boundary.largest[:, 1], most * share, rtol=1e-3)
    expected = -0.2 * most * np.sin(direction[:, 1] - 1.0)
    np.testing.assert_allclose(boundary.hessian[:, 1], expected, atol=0.02 * most)
    np.testing.assert_allclose(boundary.smallest[:, 1], 3.6 * 0.005 * share, rtol=2e-3)
    share = 1.0 + 0.1 * np.cos(direction[:, 2] - 0.15 + 2.0)
    np.testing.assert_allclose(boundary.largest[:, 2], most * share, rtol=1e-3)
    np.testing.assert_allclose(boundary.largest[:, 0], THRUST, rtol=1e-6)
    np.testing.assert_allclose(boundary.hessian[:, (0, 3)], 0.0, atol=1e-9)
    assert fins.maximum == pytest.approx(
        [THRUST, 1.2 * most, (1.0 + 0.1 * np.cos(1.0)) * most, boundary.largest[0, 3]], rel=1e-3
    )
    assert fins.minimum == pytest.approx(fins.smallest.max(axis=1))
    np.testing.assert_array_equal(fins.without_rest().boundary(direction).smallest, 0.0)
    np.testing.assert_array_equal(fins.without_rest().boundary(direction).largest, boundary.largest)
    np.testing.assert_array_equal(largest_forces(robot(*FINS)), fins.maximum)


def test_look_ups_give_commands_that_push_as_asked_at_the_cost_that_is_told(objective: Objective) -> None:
    layout = robot(*FINS)
    fins, direction = layout_envelopes(layout, objective), inside(300)
    boundary = fins.boundary(direction)
    share = np.random.default_rng(1).uniform(0.02, 0.98, direction.shape)
    size = boundary.smallest + share * (boundary.largest - boundary.smallest)
    row = fins.lookup(boundary, size)
    assert row.shape == (300, 4, 8)
    command = np.stack([row[..., AMPLITUDE], row[..., FREQUENCY], direction - row[..., DEFLECTION]], axis=-1)
    for i, fin in enumerate(layout.fins):
        law = make_law(fin.model)
        force = law.force(command[:, i])[:, 1:]
        wanted = size[:, i, None] * np.stack([np.cos(direction[:, i]), np.sin(direction[:, i])], axis=1)
        off = np.linalg.norm(force - wanted, axis=1) / fins.maximum[i]
        assert np.median(off) < 3e-4 and np.quantile(off, 0.9) < 2e-3
        cost = objective.fin_cost(law, np.array(fin.limits.upper))(command[:, i])
        apart = np.abs(row[:, i, COST] - cost) / cost.max()
        assert np.median(apart) < 1e-3 and apart.max() < 1e-2


def distance_by_brute_force(fins: Envelopes, i: int, given: Array) -> Array:
    """Distances (R,) [N] from planar forces (R, 2) to the nearest that fin i can give, of a fine grid."""
    middle, half = float(fins.middle[i]), float(fins.half[i])
    angle = np.linspace(middle - half, middle + half, 601)
    boundary = fins.boundary(np.repeat(angle[:, None], len(fins.middle), axis=1))
    smallest, largest = (
        np.broadcast_to(r, (601, len(fins.middle)))[:, i] for r in (boundary.smallest, boundary.largest)
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
        there = getattr(known.boundary(direction), name)
        np.testing.assert_allclose(getattr(found.boundary, name), there, rtol=1e-6)
    if known.largest.shape[1] > 1 or not known.turns_fully:
        assert np.abs(wrapped(found.direction - direction)).max() < 1e-9


def test_the_polygon_around_an_uneven_fin_is_its_support() -> None:
    """How far the hull of r(theta) = m (1 + e cos(theta - phi)) reaches along RIM directions."""
    layout = robot(*FINS[:3])
    sets = planar_sets(problem_of(layout))
    fins = layout_envelopes(layout, Objective())
    assert sets.boundary is not None and sets.boundary.shape == (1, 3, BOUNDARY)
    along = 2.0 * np.pi * np.arange(BOUNDARY) / BOUNDARY
    theta = np.linspace(-np.pi, np.pi, 4001)
    support = ((1.0 + 0.2 * np.cos(theta - 1.0)) * np.cos(theta - along[:, None])).max(axis=1) / 1.2
    np.testing.assert_allclose(sets.boundary[0, 1], support, rtol=3e-3)
    np.testing.assert_allclose(sets.boundary[0, 0], 1.0, rtol=3e-3)
    theta = np.linspace(ARC[0] + 0.15, ARC[1] + 0.15, 4001)
    arc = ((1.0 + 0.1 * np.cos(theta - 0.15 + 2.0)) * np.cos(theta - along[:, None])).max(axis=1)
    strongest = (1.0 + 0.1 * np.cos(theta - 0.15 + 2.0)).max()
    np.testing.assert_allclose(sets.boundary[0, 2], np.maximum(arc, 0.0) / strongest, atol=4e-3)
    np.testing.assert_array_equal(sets.radius[0], fins.maximum)
    np.testing.assert_array_equal(
        np.stack([sets.middle[0], sets.half[0]]), np.stack([fins.middle, fins.half])
    )
    even = planar_sets(problem_of(robot(FINS[0], FINS[3])))
    assert even.boundary is None
    made = problem_of(layout)
    for i in range(3):
        np.testing.assert_array_equal(sets.effectiveness[0, i], made.effectiveness[[i, i + 3]])


def test_a_force_along_the_shaft_is_noticed(tmp_path: Path) -> None:
    law = make_law(FinModelSpec())
    for sideways, noticed in ((0.0, False), (1e-6, True), (0.1, True)):
        spec = write_fin_table(
            tmp_path / f"{sideways}.csv", law, Limits(), sideways=sideways, points=(4, 4, 9)
        )
        fins = stack((spec, Limits()), FINS[0])
        assert fins.pushes_sideways == noticed
    row = fins.lookup(fins.boundary(np.zeros((1, 2))), fins.maximum[None])[0, :, SHAFT]
    assert row == pytest.approx([0.1 * THRUST, 0.0], rel=1e-2)
