"""What single actuators can push: the farthest point of a sector, sectors cut into convex parts, and
arcs with zones between them."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab import Azimuth, PowerLaw
from finlab.analysis.capability import capability
from finlab.core.ray_reach import block_of_planes
from finlab.forces.force_sets import (
    ForceSets,
    Shape,
    assembled,
    convex_parts,
    force_sets,
    shapes_of,
)
from finlab.forces.reach import max_wrench_along_exactly
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics import Plant, plant_of

Array = NDArray[np.float64]
CUT = 3
"""How many of several wide sectors are cut."""
HALF_ANGLES = [0.4, np.pi / 2, 1.9, 2.9, np.pi]
"""Half of the angle of a sector [rad]: narrow to a whole disc."""


def sectors(effectiveness: Array, radius: Array, middle: Array, half: float) -> ForceSets:
    """Robots of fins with arcs of one width."""
    none = np.zeros_like(middle)
    n_parts = np.full(middle.shape, 2 if 0.5 * np.pi < half < np.pi else 1)
    return ForceSets(
        effectiveness, radius, middle, none + half, n_parts, none, block_of_planes(middle.shape[1])
    )


def fins(half: float, rows: int = 200) -> ForceSets:
    """Robots of one fin that pushes along x and y alone."""
    rng = np.random.default_rng(0)
    effectiveness = np.zeros((rows, 1, 2, 6))
    effectiveness[:, 0, 0, 0] = effectiveness[:, 0, 1, 1] = 1.0
    return sectors(
        effectiveness, np.full((rows, 1), 3.0), rng.uniform(-np.pi, np.pi, (rows, 1)), half
    )


def random_prices(rows: int = 200) -> Array:
    """Prices (rows, 1, 2) of forces."""
    return np.random.default_rng(1).standard_normal((rows, 1, 2)) * 2.0


def sector(sets: ForceSets, row: int) -> Array:
    """Points (S, 2) all over one fin's sector, its rim and its tip included."""
    angle = (
        sets.sector_center[row, 0] + np.linspace(-1.0, 1.0, 721) * sets.sector_half_angle[row, 0]
    )
    boundary = sets.radius[row, 0] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.concatenate([boundary * share for share in np.linspace(0.0, 1.0, 60)])


@pytest.mark.parametrize("half", HALF_ANGLES)
def test_farthest_is_the_farthest_point_of_the_sector(half: float) -> None:
    sets = fins(half)
    pull = random_prices()
    normal = np.pad(pull[:, 0], ((0, 0), (0, 4)))
    reach, force = sets.farthest(normal)
    assert np.allclose((force * pull).sum((-1, -2)), reach)
    for row in range(0, 200, 20):
        best = (sector(sets, row) @ pull[row, 0]).max()
        assert best - 1e-9 <= reach[row] <= best + 1e-3


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_polygon_reaches_to_its_best_corner(turn: float) -> None:
    corners = np.array([[3.0, 1.0], [2.0, 4.0], [1.0, 1.0], [2.5, -0.5]])
    line = np.array([[-1.0, 0.0], [2.0, 0.0]]) @ [
        [np.cos(turn), np.sin(turn)],
        [-np.sin(turn), np.cos(turn)],
    ]
    for polygon in (corners, line):
        sets = assembled(
            [[Shape(np.eye(2, 3), 1.0, 0.0, 0.0, (polygon,))]], np.eye(3, 6)[None, None]
        )
        pull = random_prices()[:, 0]
        reach, force = sets.tile(200).farthest(np.pad(pull, ((0, 0), (0, 4))))
        np.testing.assert_allclose(reach, (polygon @ pull.T).max(axis=0), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose((force[:, 0] * pull).sum(-1), reach, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("half", [0.8, 2.5, np.pi])
def test_an_uneven_fin_reaches_as_far_as_its_law(half: float) -> None:
    """Its polygon, and those of both halves of a wide arc, beside the forces of many commands."""
    numbers = {"k": 3.0, "p": 1.5, "x0": 0.9, "q": 4.0, "e": 0.2, "phi_e": 1.0, "d": 0.1}
    limits = Limits(zero_direction=(0.3 - half, 0.3 + half))
    fin = Fin(
        "fin", (0.0, 0.0, 0.0), 0.0, limits, FinModelSpec("soft", tuple(sorted(numbers.items())))
    )
    layout = Layout("one", (fin,))
    axes = [np.linspace(low, high, 20) for low, high in zip(fin.lower, fin.upper, strict=True)]
    axes[2] = np.linspace(*limits.zero_direction, 501)
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    force = np.concatenate([Plant(layout).wrench(command)[:, 1:3], np.zeros((1, 2))])
    angle = np.arange(60) * 2.0 * np.pi / 60
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    sets = force_sets(layout)
    parts = convex_parts(sets)
    ahead = (
        [sets.sector_center[0, 0], *parts.sector_center[:, 0]]
        if len(parts.radius) > 1
        else [sets.sector_center[0, 0]]
    )
    for number, part in enumerate(
        [sets, *(parts.take(np.array([k])) for k in range(len(ahead) - 1))]
    ):
        turned = (np.arctan2(force[:, 1], force[:, 0]) - ahead[number] + np.pi) % (
            2.0 * np.pi
        ) - np.pi
        own = force[
            (np.abs(turned) <= part.sector_half_angle[0, 0] + 1e-6) | (force == 0.0).all(-1)
        ]
        reach = part.tile(60).farthest(np.pad(normal, ((0, 0), (1, 3))))[0]
        np.testing.assert_allclose(
            reach, (own @ normal.T).max(axis=0), atol=2e-3 * sets.radius[0, 0]
        )


def five_fins(half: float) -> ForceSets:
    """Two robots of five fins with the same arcs."""
    effectiveness = np.random.default_rng(2).standard_normal((2, 5, 2, 6))
    middle = np.tile(np.linspace(-2.0, 2.0, 5), (2, 1))
    return sectors(effectiveness, np.ones((2, 5)), middle, half)


@pytest.mark.parametrize(("half", "parts"), [(np.pi / 2, 1), (np.pi, 1), (2.0, 2**CUT)])
def test_only_wide_sectors_are_cut(half: float, parts: int) -> None:
    sets = five_fins(half)
    assert len(convex_parts(sets).radius) == 2 * parts
    # The same directions reach as far in the best part as in all of the sectors that were cut.
    cut = sets._replace(radius=np.where(np.arange(5) < CUT, sets.radius, 0.0))
    normal = np.random.default_rng(3).standard_normal((2, 6))
    in_parts = convex_parts(cut).farthest(np.tile(normal, (parts, 1)))[0].reshape(parts, 2)
    assert in_parts.max(axis=0) == pytest.approx(cut.farthest(normal)[0])


def test_fins_beyond_the_first_few_keep_their_hulls() -> None:
    assert (convex_parts(five_fins(2.0)).sector_half_angle[:, CUT:] == 2.0).all()


def test_a_fin_whose_stops_coincide_has_one_column() -> None:
    sets = five_fins(0.0)
    full = sets.full_effectiveness().reshape(2, 5, 2, 6)
    unit = np.stack([np.cos(sets.sector_center), np.sin(sets.sector_center)], axis=-1)
    assert full[:, :, 0] == pytest.approx((unit[..., None] * sets.effectiveness).sum(2))
    assert (full[:, :, 1] == 0.0).all()


ZONED = Azimuth(
    "pod",
    (0.0, 0.0, 0.0),
    turn_axis=(0.0, 0.0, 1.0),
    zero=(1.0, 0.0, 0.0),
    force=(0.0, 10.0),
    model=PowerLaw(1.0),
    arc=tuple(tuple(np.deg2rad(ends)) for ends in ((-170.0, -70.0), (20.0, 50.0), (90.0, 175.0))),
)
"""A pod with three arcs."""


def zoned_robot(seed: int, count: int) -> Layout:
    """Some pods with three arcs and a free one, at random places."""
    random = np.random.default_rng(seed)
    free = replace(ZONED, name="free", position=(0.3, 0.1, 0.0), arc=(-np.pi, np.pi))
    pods = []
    for k in range(count):
        place = tuple(random.uniform(-1.0, 1.0, 2)) + (0.0,)
        pods.append(replace(ZONED, name=f"pod_{k}", position=place))
    return Layout("zoned", (*pods, free), axes=("Fx", "Fy", "Tz"))


def test_a_set_with_zones_holds_what_its_arcs_hold() -> None:
    """Forces of random commands lie in a part; what each part has at its rim is within an arc."""
    shape = shapes_of(Layout("one", (ZONED,)))[0]
    hull, *parts = shape.polygons
    assert shape.n_parts == len(parts) == 3
    command = commands_within(Layout("one", (ZONED,)), 4000)
    force = plant_of(Layout("one", (ZONED,))).force(command)[:, 0, 1:]
    inside = np.array([contains(corners, force) for corners in parts])
    assert inside.any(axis=0).all() and (inside.sum(axis=0) == 1).mean() > 0.99
    assert contains(hull, force).all()
    for corners, ends in zip(parts, ZONED.arcs, strict=True):
        angle = np.arctan2(corners[:, 1], corners[:, 0])
        is_rim = np.linalg.norm(corners, axis=1) > 1.0
        assert (angle[is_rim] >= ends[0] - 1e-9).all() and (angle[is_rim] <= ends[1] + 1e-9).all()
        assert np.linalg.norm(corners, axis=1).max() == pytest.approx(10.0)
        assert (angle[is_rim].min(), angle[is_rim].max()) == pytest.approx(ends, abs=0.02)


def commands_within(layout: Layout, count: int) -> Array:
    """Random commands within all arcs and limits, as the plant samples them."""
    return plant_of(layout).sample(np.random.default_rng(0), (count,))


def contains(corners: Array, points: Array) -> NDArray[np.bool_]:
    """Which points are within a convex polygon, but for a thousandth of its size."""
    ahead = np.roll(corners, -1, axis=0) - corners
    offset = points[:, None] - corners
    left = ahead[:, 0] * offset[..., 1] - ahead[:, 1] * offset[..., 0]
    side = np.linalg.norm(ahead, axis=1) * 0.02
    return (left >= -side).all(axis=1) | (left <= side).all(axis=1)


@pytest.mark.parametrize(("seed", "count"), [(0, 1), (1, 2)])
def test_zones_are_left_out_of_reach_and_of_the_plot(seed: int, count: int) -> None:
    """Beside the best of the answers of all choices of arcs, one arc each."""
    layout = zoned_robot(seed, count)
    turn = np.linspace(0.0, 2.0 * np.pi, 13)[:-1]
    directions = np.zeros((len(turn), 6))
    directions[:, 0] = np.cos(turn)
    directions[:, 1] = np.sin(turn)
    best = np.zeros(len(turn))
    for chosen in product(ZONED.arcs, repeat=count):
        robot = layout
        for pod, arc in zip(layout.names, chosen, strict=False):
            robot = robot.replace_actuator(pod, arc=arc)
        best = np.maximum(best, max_wrench_along_exactly(force_sets(robot), directions)[0][0])
    found = max_wrench_along_exactly(force_sets(layout), directions)[0][0]
    assert found == pytest.approx(best, rel=5e-4, abs=1e-3)
    ends = layout
    for pod in layout.names[:count]:
        ends = ends.replace_actuator(pod, arc=ZONED.turn_range)
    without_zones = max_wrench_along_exactly(force_sets(ends), directions)[0][0]
    assert (without_zones > found + 0.1).any(), "no zone matters in this case"
    # A load from a heading, clockwise from ahead, is held by a push towards it.
    headings = np.rad2deg(-turn) % 360.0
    plot = capability(layout, None, headings)
    assert plot.values[0] == pytest.approx(best, rel=5e-4, abs=1e-3)
