"""The parts of the search in force space, hulls and extents, each against values worked out by hand."""

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces import extent
from finlab.forces.attainable import FLAT, hull_of
from finlab.forces.extent import singular_values, strongest, weakest
from finlab.forces.fin_sets import HALF_TURN_TOLERANCE, FinSets, wide_fins
from finlab.forces.force_space import IDLE, REST, PlanarProblem, polar, realize
from finlab.forces.reach import Largest, max_wrench_along
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant
from finlab.physics.objective import Name, Objective
from tests.forces.conftest import SIGMA, problem_of

Array = NDArray[np.float64]


def layout_of(*arcs: tuple[float, float]) -> Layout:
    return Layout(
        "some",
        tuple(
            Fin(f"fin_{i}", (0.2, 0.1 * i, 0.05), 0.7 * i, Limits(zero_direction=arc))
            for i, arc in enumerate(arcs)
        ),
    )


def problem(*arcs: tuple[float, float], objective: Name = "effort") -> PlanarProblem:
    return problem_of(layout_of(*arcs), Objective(objective))


def test_half_of_an_arc_and_which_are_wide() -> None:
    made = problem((-np.pi, np.pi), (-1.0, 1.0), (0.5, 4.9), (-0.2, -0.2))
    assert made.fins.half == pytest.approx([np.pi, 1.0, 2.2, 0.0])
    edge = np.pi / 2 + HALF_TURN_TOLERANCE
    halves = np.array([[np.pi / 2, edge, np.nextafter(edge, 4.0), 3.0, np.pi, 2.0]])
    sets = FinSets(np.ones((1, 6, 2, 6)), np.array([[1.0, 1.0, 1.0, 1.0, 1.0, 0.0]]), 0.0 * halves, halves)
    assert wide_fins(sets).tolist() == [2, 3]


def test_a_problem_by_hand() -> None:
    made = problem((-1.0, 2.0), (0.5, 4.0), (-np.pi, np.pi), (-2.0, -0.5))
    assert made.fins.middle == pytest.approx([0.5, 2.25, 0.0, -1.25])
    assert made.fins.half == pytest.approx([1.5, 1.75, np.pi, 0.75])
    assert made.idle_direction == pytest.approx([0.0, 0.5, 0.0, -0.5])
    assert made.direction_cost == pytest.approx([0.1 / 4.0, 0.1 / 16.0, 0.1 / np.pi**2, 0.1 / 0.25])
    assert not made.fins.turns_fully and not made.turning_is_free
    free = problem((-1.0, 2.0), objective="power")
    assert free.turning_is_free and free.direction_cost == pytest.approx([0.0])
    assert problem((-np.pi, np.pi)).fins.turns_fully
    # One newton ahead of the first fin: +y and, 0.2 m in front and 0.05 m above, torques -0.05 and 0.2.
    assert made.columns[0] * SIGMA == pytest.approx([0.0, 1.0, 0.0, -0.05, 0.0, 0.2])
    assert made.columns[4] * SIGMA == pytest.approx([0.0, 0.0, 1.0, 0.0, -0.2, 0.0])
    assert made.along_shaft[0] * SIGMA == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.05, 0.0])
    x, y = made.columns[1], made.columns[5]
    products = made.products.reshape(3, 4, 6, 6)
    for found, plain in zip(
        products[:, 1], (np.outer(x, x), np.outer(x, y) + np.outer(y, x), np.outer(y, y)), strict=True
    ):
        assert found == pytest.approx(plain + 1e-9 * np.trace(plain) * np.eye(6), rel=1e-12, abs=1e-15)


def test_polar_forces_keep_their_arcs_and_limits() -> None:
    """Across a stop nothing is given of a force but what lies along the stop."""
    made = problem((0.5, 2.5), (-np.pi, np.pi))
    low, high = made.fins.minimum[0], made.fins.maximum[0]
    asked = [(1.0, 0.6), (1.0, 0.2), (1.0, 3.0), (1.0, -1.5), (2 * high, 2.5), (0.5 * low, 0.5)]
    held = [(1.0, 0.6), (np.cos(0.3), 0.5), (np.cos(0.5), 2.5), (low, 0.5), (high, 2.5), (low, 0.5)]
    force = np.array([[[t * np.cos(a), t * np.sin(a)]] * 2 for t, a in asked])
    found = polar(made, force)
    assert np.stack([found.size[:, 0], found.direction[:, 0]], axis=-1) == pytest.approx(np.array(held))
    assert found.direction[:, 1] == pytest.approx([a for _, a in asked])
    assert found.size[:, 1] == pytest.approx([min(max(t, low), high) for t, _ in asked])
    assert np.isnan(found.residual).all()


ARCS = ((0.5, 2.5), (-1.0, 1.0))
AHEAD = np.array([[np.cos(2.0), np.sin(2.0)], [np.cos(0.8), np.sin(0.8)]])


def test_where_turning_is_free_only_a_fin_at_rest_turns_away() -> None:
    made = problem(*ARCS, objective="power")
    low, high = made.fins.minimum, made.fins.maximum
    sizes = np.stack([low, low * (1.0 + 0.9 * REST), low * (1.0 + 1.1 * REST), 0.3 * high])
    command, cost = realize(made, polar(made, sizes[..., None] * AHEAD))
    assert command[:2, :, 2] == pytest.approx(np.array([[0.5, 0.0]] * 2))
    assert command[2:, :, 2] == pytest.approx(np.array([[2.0, 0.8]] * 2))
    meter = Objective("power").meter(Plant(layout_of(*ARCS)))
    assert cost[[0, 3]] == pytest.approx(meter(command[[0, 3]]), rel=4e-3)


@pytest.mark.parametrize(("rests", "still"), [(None, 0), (0.0, 1), (IDLE, 2)])
def test_where_turning_costs_a_fin_that_hardly_works_may_rest(rests: float | None, still: int) -> None:
    """Then it goes to its lower limits, and to the direction that costs least; `still` rows do."""
    made, layout = problem(*ARCS, objective="effort"), layout_of(*ARCS)
    low, high = made.fins.minimum, made.fins.maximum
    edge = low * (1.0 + REST) + IDLE * high
    sizes = np.stack([low, 0.999999 * edge, 1.000001 * edge, 0.3 * high])
    command, cost = realize(made, polar(made, sizes[..., None] * AHEAD), rests)
    if still:
        assert command[:still, :, 2] == pytest.approx(np.array([[0.5, 0.0]] * still))
        assert command[:still, :, :2] == pytest.approx(np.array([layout.lower[:, :2]] * still), abs=1e-4)
    assert command[still:, :, 2] == pytest.approx(np.array([[2.0, 0.8]] * (4 - still)))
    size = np.linalg.norm(Plant(layout).force(command), axis=-1)
    assert size[still:] == pytest.approx(sizes[still:], rel=2e-3)
    assert cost == pytest.approx(Objective("effort").meter(Plant(layout))(command), rel=5e-3)


CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)


def test_hulls_of_every_dimension() -> None:
    body = hull_of(np.concatenate([CUBE, CUBE.mean(axis=0, keepdims=True)]))
    assert body.dimension == 3 and len(body.vertices) == 8 and len(body.faces) == 12 and not len(body.outline)
    assert len(body.normals) == 6 and sorted(body.offsets.round(6)) == [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    assert ((np.cross(b - a, c - a) * (a - CUBE.mean(axis=0))).sum(-1) > 0.0).all()
    assert np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6 == pytest.approx(6.0)
    flat = hull_of(np.concatenate([CUBE[:4:1] * [0, 1, 1] + [5, 0, 0], [[5.0, 1.0, 1.0]]]))
    assert flat.dimension == 2 and len(flat.vertices) == 4 and not len(flat.faces)
    assert sorted(flat.outline) == [0, 1, 2, 3] and len(flat.normals) == 6
    line = hull_of(np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [4.0, 4.0, 4.0]]))
    assert line.dimension == 1 and line.outline.tolist() == [0, 1] and len(line.vertices) == 2
    assert sorted(line.vertices[:, 0]) == [1.0, 4.0]
    point = hull_of(np.full((3, 3), 2.0))
    assert point.dimension == 0 and len(point.outline) == 0 and point.vertices.tolist() == [[2.0] * 3]
    for hull, points in ((body, CUBE), (flat, flat.vertices), (line, line.vertices), (point, point.vertices)):
        assert np.linalg.norm(hull.normals, axis=1) == pytest.approx(1.0)
        beyond = points @ hull.normals.T - hull.offsets
        assert beyond.max(axis=0) == pytest.approx(0.0, abs=1e-9)  # every plane touches, none cuts


@pytest.mark.parametrize("size", [0.01, 1.0, 300.0])
@pytest.mark.parametrize(("thickness", "dimension"), [(0.5, 2), (2.0, 3)])
def test_a_hull_is_flat_up_to_a_share_of_its_size(size: float, thickness: float, dimension: int) -> None:
    slab = size * CUBE / 3.0
    slab[:, 0] *= 3.0 * FLAT * thickness
    assert hull_of(slab).dimension == dimension


def pair_per_axis(radius: Array) -> FinSets:
    """Three fins along axes (0, 1), (2, 3) and (4, 5): the set of wrenches is a product of discs."""
    columns = np.zeros((1, 3, 2, 6))
    for k in range(6):
        columns[0, k // 2, k % 2, k] = 1.0
    return FinSets(columns, radius[None], np.zeros((1, 3)), np.full((1, 3), np.pi))


def test_extents_of_a_product_of_discs() -> None:
    sets = pair_per_axis(np.array([1.0, 3.0, 2.0]))
    values, vectors = singular_values(sets)
    assert values[0] == pytest.approx([3.0, 3.0, 2.0, 2.0, 1.0, 1.0])
    assert np.abs(vectors[0, 2:4, :2]).sum() == pytest.approx(2.0, abs=1e-9)
    least, most = weakest(sets), strongest(sets)
    assert least.size == pytest.approx([1.0], rel=1e-6)
    assert np.hypot(*least.direction[0, :2]) == pytest.approx(1.0, abs=1e-3)
    assert most.size == pytest.approx([np.sqrt(14.0)], rel=1e-6)  # all at full thrust
    blocks = np.linalg.norm(most.direction.reshape(3, 2), axis=1)
    assert blocks == pytest.approx(np.array([1.0, 3.0, 2.0]) / np.sqrt(14.0), abs=1e-6)
    lame = weakest(pair_per_axis(np.array([1.0, 0.0, 2.0])))
    assert lame.size == 0.0 and np.hypot(*lame.direction[0, 2:4]) == pytest.approx(1.0)


def test_a_fin_with_stops_ends_a_set_behind_it() -> None:
    sets = pair_per_axis(np.array([1.0, 3.0, 2.0]))._replace(half=np.array([[np.pi, np.pi, 1.0]]))
    least = weakest(sets)
    assert least.size == pytest.approx([0.0], abs=1e-6)
    assert np.hypot(*least.direction[0, 4:]) == pytest.approx(1.0, abs=1e-3)


def test_polar_directions_beyond_half_a_turn() -> None:
    made = problem((0.5, 4.0))
    for asked, held in ((3.95, 3.95), (4.2, 4.0), (0.55, 0.55), (0.3, 0.5), (-1.5, 4.0), (-0.6, 0.5)):
        found = polar(made, np.array([[[np.cos(asked), np.sin(asked)]]]))
        off = np.cos(asked - held)
        assert found.direction == pytest.approx(held) and found.size == pytest.approx(off)


def test_the_one_axis_that_no_fin_acts_along_is_weakest() -> None:
    fixed = pair_per_axis(np.ones(3))._replace(half=np.array([[np.pi, np.pi, 0.0]]))
    least = weakest(fixed)
    assert least.size == 0.0 and np.abs(least.direction[0]) == pytest.approx(np.eye(6)[5], abs=1e-12)


@pytest.mark.parametrize(("half", "walks"), [(np.pi, 12), (3.0, 24), (1.0, 24)])
def test_both_ends_of_each_direction_are_tried_where_fins_have_stops(
    half: float, walks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six axes and six singular vectors; with full circles only, opposite directions are alike."""
    started: list[Array] = []

    def spy(sets: FinSets, direction: Array, tolerance: float) -> Largest:
        started.append(direction)
        return max_wrench_along(sets, direction, tolerance)

    monkeypatch.setattr(extent, "max_wrench_along", spy)
    sets = pair_per_axis(np.ones(3))._replace(half=np.array([[np.pi, np.pi, half]]))
    weakest(sets, n_random=0, n_walks=1)
    assert len(started) == 1 and len(started[0]) == walks
    if walks == 24:
        assert started[0][12:] == pytest.approx(-started[0][:12])
