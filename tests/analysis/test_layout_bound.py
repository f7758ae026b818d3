"""The bound over all layouts holds, against exact values by facets, and is near what is known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import Bounds, KeepOut, layout_bound, optimize_layout
from finlab.analysis.climb import CLEARANCE
from finlab.analysis.keep_out import extreme_places, keep_out_rule
from finlab.analysis.moves import Moves
from finlab.analysis.pose_set import TOLERANCE, PoseSet
from finlab.analysis.zonotope_ball import ball_factor
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import weakest
from finlab.layout import Layout
from tests.analysis.zonotope_oracle import largest_ball

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""
QUARTER = (-0.5 * np.pi, 0.5 * np.pi)
"""A range of both angles that points everywhere, up to the sign."""
CUBE = Bounds((-0.2, 0.2), (-0.2, 0.2), (-0.2, 0.2), QUARTER, QUARTER)
"""A cube, all directions."""
FLAT = Bounds((-0.15, 0.15), (-0.22, 0.22), (-0.06, 0.06), QUARTER, QUARTER)
"""A box like that of a small vehicle, all directions."""
FLAT_BOTH_WAYS = replace(FLAT, mounting_angle=(-np.pi, np.pi), tilt=(-np.pi, np.pi))
"""The same box, where a thruster may also be reversed."""
MIDDLE = KeepOut((-0.1, 0.1), (-0.2, 0.2), (-0.05, 0.05))
"""What is in the middle of it."""
HULL = KeepOut((-0.1, 0.1), (-0.15, 0.15), (-0.04, 0.04))
"""What holds its electronics."""
AHEAD = KeepOut((0.0, 0.3), (-0.3, 0.3), (-0.1, 0.1))
"""The half ahead of it."""


def thrusters(shipped: Layouts, n: int) -> Layout:
    """Eight thrusters, or the last n of them."""
    heavy = shipped("bluerov2_heavy")
    return heavy if n == heavy.n else heavy.without(heavy.names[: heavy.n - n])


def half_range(layout: Layout) -> Array:
    """Half of the range of forces of each thruster (n,) [N]."""
    return np.asarray(0.5 * (layout.upper - layout.lower)[:, 0])


def unevenness_of(layout: Layout) -> float:
    """By what share the stronger way exceeds half the range, the same of all thrusters."""
    share = np.abs(layout.upper + layout.lower)[:, 0] / (layout.upper - layout.lower)[:, 0]
    assert share == pytest.approx(share[0])
    return float(share[0])


def with_limits(layout: Layout, least: float, most: float) -> Layout:
    """The layout with other limits of all thrusters [N]."""
    actuators = tuple(replace(one, force=(least, most)) for one in layout.actuators)
    return replace(layout, actuators=actuators)


def bound_of(layout: Layout, bounds: Bounds, **settings: object) -> float:
    """The bound for all actuators of a layout within the same bounds."""
    everywhere = dict.fromkeys(layout.names, bounds)
    return layout_bound(layout, layout.names, everywhere, mirror=(), **settings).value


def random_wrenches(random: np.random.Generator, shape: tuple[int, ...], bounds: Bounds) -> Array:
    """Scaled wrenches (*shape, 6) per newton at random places of a box, half of them near corners,
    in random directions."""
    low, high = bounds.pairs[:3].T
    share = random.random((*shape, 3))
    is_corner = random.random((*shape, 1)) < 0.5
    near_corner = np.round(share) + 0.02 * (0.5 - np.round(share)) * random.random((*shape, 3))
    share = np.where(is_corner, near_corner, share)
    place = low + share * (high - low)
    direction = random.standard_normal((*shape, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return np.concatenate([direction, np.cross(place, direction)], axis=-1) / SCALE


@pytest.mark.parametrize(("n", "count"), [(6, 100_000), (8, 20_000)])
@pytest.mark.parametrize("bounds", [CUBE, FLAT], ids=["cube", "flat"])
def test_no_random_layout_exceeds_it(shipped: Layouts, n: int, count: int, bounds: Bounds) -> None:
    layout = thrusters(shipped, n)
    bound = bound_of(layout, bounds)
    wrenches = random_wrenches(np.random.default_rng(n), (count, n), bounds)
    exact = largest_ball(wrenches * half_range(layout)[:, None], unevenness_of(layout))
    assert exact.max() <= bound
    # Each layout keeps a far nearer bound, by its own columns.
    factor, force = ball_factor(layout.lower[:, 0], layout.upper[:, 0], n, 6)
    columns = wrenches * force[:, None]
    information = np.swapaxes(columns, -1, -2) @ columns
    own = np.sqrt(factor / np.trace(np.linalg.inv(information), axis1=1, axis2=2))
    assert (exact <= own * (1.0 + 1e-6) + 1e-6).all()
    assert (exact / own).max() > 0.7, "the case is no test where all are far from it"
    assert own.max() <= bound


@pytest.mark.exhaustive
@pytest.mark.parametrize("bounds", [CUBE, FLAT], ids=["cube", "flat"])
def test_no_one_of_many_layouts_exceeds_it(shipped: Layouts, bounds: Bounds) -> None:
    layout = thrusters(shipped, 8)
    bound = bound_of(layout, bounds)
    force = half_range(layout)
    for seed in range(10):
        wrenches = random_wrenches(np.random.default_rng(seed), (10_000, 8), bounds)
        exact = largest_ball(wrenches * force[:, None], unevenness_of(layout))
        assert exact.max() <= bound


POSES = [
    pytest.param(n, turn, keep_outs, id=f"{n}-{turn}-{len(keep_outs)}")
    for n in (6, 8)
    for turn, keep_outs in ((180, ()), (90, (HULL,)), (25, (AHEAD, HULL)))
]
"""Numbers of thrusters, how far they turn [degrees], and keep-outs."""


def most_of_poses(
    shipped: Layouts, n: int, turn: float, keep_outs: tuple[KeepOut, ...], count: int
) -> float:
    """The largest share of the bound that random layouts of a search have, within what its angles
    and keep-outs leave."""
    layout = thrusters(shipped, n)
    bounds = {
        one.name: replace(Bounds.around(one, 0.1, np.radians(turn)), x=FLAT.x, y=FLAT.y, z=FLAT.z)
        for one in layout.actuators
    }
    moves = Moves(layout, layout.names, bounds, ())
    vectors = np.random.default_rng(n).uniform(moves.lower, moves.upper, (count, len(moves.start)))
    position = moves.positions(vectors)
    if keep_outs:
        # Those that stand in one are moved to the rear of the box, which is in none.
        is_inside = np.any([box.depth(position) > 0.0 for box in keep_outs], axis=0)
        vectors.reshape(count, n, 5)[is_inside, 0] = FLAT.x[0]
        position = moves.positions(vectors)
        assert all((box.depth(position) == 0.0).all() for box in keep_outs)
    columns = moves.sets(vectors).effectiveness[:, :, 0] * half_range(layout)[:, None]
    exact = largest_ball(columns, unevenness_of(layout))
    bound = layout_bound(layout, layout.names, bounds, mirror=(), keep_outs=keep_outs)
    return float(exact.max() / bound.value)


@pytest.mark.parametrize(("n", "turn", "keep_outs"), POSES)
def test_no_layout_of_a_search_exceeds_it(
    shipped: Layouts, n: int, turn: float, keep_outs: tuple[KeepOut, ...]
) -> None:
    assert 0.3 < most_of_poses(shipped, n, turn, keep_outs, 2000) <= 1.0


@pytest.mark.exhaustive
@pytest.mark.parametrize(("n", "turn", "keep_outs"), POSES)
def test_no_one_of_many_layouts_of_a_search_exceeds_it(
    shipped: Layouts, n: int, turn: float, keep_outs: tuple[KeepOut, ...]
) -> None:
    assert 0.3 < most_of_poses(shipped, n, turn, keep_outs, 100_000) <= 1.0


@pytest.mark.parametrize("n", [7, 8])
def test_nor_does_one_after_a_loss(shipped: Layouts, n: int) -> None:
    layout = thrusters(shipped, n)
    bound = bound_of(layout, FLAT, after_loss=True)
    wrenches = random_wrenches(np.random.default_rng(n), (5_000, n), FLAT)
    columns = wrenches * half_range(layout)[:, None]
    unevenness = unevenness_of(layout)
    after = [largest_ball(np.delete(columns, k, axis=1), unevenness) for k in range(n)]
    assert 0.0 < np.min(after, axis=0).max() <= bound < bound_of(layout, FLAT)


def test_the_oracle_agrees_with_the_search_for_the_weakest_direction(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    sets = force_sets(with_limits(layout, -40.0, 40.0))
    random = np.random.default_rng(0)
    moved = 0.2 * random.standard_normal(sets.effectiveness[:, :, 0].shape)
    sets.effectiveness[:, :, 0] += moved
    found = weakest(sets).size
    assert largest_ball(40.0 * sets.effectiveness[:, :, 0]) == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize(
    ("axes", "n", "best"),
    [(("Fx", "Fy", "Fz"), 3, 1.0), (("Fx", "Fy"), 4, 1.0 / np.tan(np.pi / 8.0))],
)
def test_it_is_the_optimum_where_that_is_known(
    shipped: Layouts, axes: tuple[str, ...], n: int, best: float
) -> None:
    """Three at right angles; four in a plane, evenly turned, as strong astern as ahead."""
    layout = with_limits(thrusters(shipped, n), -40.0, 40.0)
    bound = bound_of(layout, FLAT, axes=axes)
    assert bound == pytest.approx(best * 40.0, rel=3e-4)
    assert bound >= best * 40.0


@pytest.mark.parametrize("least", [-40.0, -30.0, -20.0])
def test_it_is_near_the_optimum_of_four_uneven_ones_in_a_plane(
    shipped: Layouts, least: float
) -> None:
    """The bound is just above the best of all directions in steps of five degrees."""
    layout = with_limits(thrusters(shipped, 4), least, 40.0)
    bound = bound_of(layout, FLAT, axes=("Fx", "Fy"))
    angle = np.radians(np.arange(0.0, 360.0, 5.0))
    grid = np.meshgrid([0.0], angle, angle, angle[:36], indexing="ij")
    angles = np.stack([one.ravel() for one in grid], axis=-1)
    angles[:, 1:] += 1e-6 * np.arange(1.0, 4.0)  # no two along one line
    columns = half_range(layout)[0] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    best = largest_ball(columns, unevenness_of(layout)).max()
    assert 0.95 * bound <= best <= bound


def test_a_keep_out_that_matters(shipped: Layouts) -> None:
    layout = thrusters(shipped, 6)
    free = bound_of(layout, FLAT)
    # One in the middle leaves all corners; the half ahead does not.
    assert bound_of(layout, FLAT, keep_outs=[MIDDLE]) == pytest.approx(free, rel=1e-9)
    behind = replace(FLAT, x=(-0.15, 0.0))
    kept_out = bound_of(layout, FLAT, keep_outs=[AHEAD])
    assert kept_out == pytest.approx(bound_of(layout, behind), rel=1e-9)
    assert kept_out < 0.97 * free
    with pytest.raises(LayoutError, match="expected some place"):
        bound_of(layout, FLAT, keep_outs=[KeepOut((-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0))])


@pytest.mark.parametrize("seed", range(4))
def test_extreme_places_enclose_what_keep_outs_leave(seed: int) -> None:
    random = np.random.default_rng(seed)
    box = np.array([[-1.0, 1.0]] * 3)
    keep_outs = []
    for _ in range(4):
        corner = random.uniform(-1.3, 0.6, 3)
        ends = np.stack([corner, corner + random.uniform(0.3, 1.2, 3)], axis=-1)
        keep_outs.append(KeepOut(*(tuple(pair) for pair in ends.tolist())))
    places = extreme_places(box, keep_outs)
    points = random.uniform(-1.0, 1.0, (4000, 3))
    depth = keep_out_rule(keep_outs, [0])(points[:, None], np.zeros((len(points), 1, 3, 3)))
    points = points[depth == 0.0]
    assert 0 < len(points) < 4000
    directions = random.standard_normal((200, 3))
    assert (
        (points @ directions.T).max(axis=0) <= (places @ directions.T).max(axis=0) + 1e-12
    ).all()
    at_places = keep_out_rule(keep_outs, [0])(places[:, None], np.zeros((len(places), 1, 3, 3)))
    assert (at_places == 0.0).all()


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.48, 0.64, 0.6), (0.0, 0.0, -1.0)])
def test_the_longest_wrench_over_a_range_of_directions(
    axis: tuple[float, float, float], is_mirrored: bool
) -> None:
    bounds = replace(FLAT, mounting_angle=(-0.3, 0.7), tilt=(-0.5, 0.2))
    poses = PoseSet.within(bounds, np.array(axis), 0.0, 0.01, is_mirrored=is_mirrored)
    random = np.random.default_rng(1)
    metric = random.standard_normal((6, 6))
    metric = metric + metric.T
    found = poses.longest(metric, range(6))
    angles = random.uniform((-0.3, -0.5), (0.7, 0.2), (20_000, 2))
    wrenches = poses.wrench_maps(range(6))[:, None] @ poses.directions(angles)[None, ..., None]
    sampled = ((metric @ wrenches) ** 2).sum(axis=(-1, -2)).max()
    best = ((found.columns @ metric) ** 2).sum(axis=-1).max()
    assert sampled <= found.bound
    assert best <= found.bound <= best * (1.0 + 1.01 * TOLERANCE)
    assert best >= sampled * (1.0 - 1e-3)


def test_directions_are_those_of_the_search(shipped: Layouts) -> None:
    """The poses of a search lie within the pose sets, of twins as well."""
    layout = shipped("bluerov2_heavy")
    names = ["front_right", "lift_rear_left"]
    bounds = {
        name: Bounds.around(layout.actuators[layout.index(name)], 0.05, 0.4) for name in names
    }
    bound = layout_bound(layout, names, bounds)
    metric = np.array(bound.metric)
    improvement = optimize_layout(layout, names, bounds, rounds=1, bound=True)
    assert improvement.moved == ("front_right", "front_left", "lift_rear_right", "lift_rear_left")
    sets = force_sets(improvement.layout)
    force = ball_factor(layout.lower[:, 0], layout.upper[:, 0], 8, 6).force
    lengths = ((sets.effectiveness[0, :, 0] * force[:, None] @ metric) ** 2).sum(axis=-1)
    assert (lengths <= np.array(bound.longest) * (1.0 + 1e-9)).all()
    assert improvement.bound == bound
    assert improvement.value_after <= bound.value
    assert improvement.gap == pytest.approx(bound.value / improvement.value_after - 1.0)


def test_more_rounds_tighten_it(shipped: Layouts) -> None:
    layout = thrusters(shipped, 6)
    values = [bound_of(layout, FLAT, rounds=rounds) for rounds in (1, 2, 4, 8, 40)]
    assert all(later <= earlier for earlier, later in zip(values, values[1:], strict=False))
    assert values[-1] < 0.99 * values[0]


def test_its_certificate_proves_it(shipped: Layouts) -> None:
    layout = thrusters(shipped, 8)
    everywhere = dict.fromkeys(layout.names, FLAT)
    bound = layout_bound(layout, layout.names, everywhere, mirror=())
    metric = np.array(bound.metric)
    assert np.allclose(metric, metric.T) and np.trace(metric) == pytest.approx(1.0)
    force = ball_factor(layout.lower[:, 0], layout.upper[:, 0], 8, 6).force
    wrenches = random_wrenches(np.random.default_rng(3), (100_000,), FLAT)
    longest = ((wrenches @ metric) ** 2).sum(axis=-1).max()
    assert longest <= (np.array(bound.longest) / force**2).min()
    assert bound.value == pytest.approx(np.sqrt(bound.factor * sum(bound.longest)), rel=1e-8)
    assert bound.axes == AXES


@pytest.mark.parametrize(
    ("n", "bounds", "mirror", "most"),
    [(6, FLAT, (), 0.08), (8, FLAT, None, 0.13), (8, FLAT_BOTH_WAYS, (), 0.1)],
    ids=["six", "pairs", "eight"],
)
def test_a_search_comes_near_it(
    shipped: Layouts, n: int, bounds: Bounds, mirror: tuple[()] | None, most: float
) -> None:
    layout = thrusters(shipped, n)
    everywhere = dict.fromkeys(layout.names, bounds)
    improvement = optimize_layout(
        layout, layout.names, everywhere, mirror=mirror, keep_outs=[HULL], bound=True
    )
    assert improvement.improved
    assert improvement.gap is not None and 0.0 <= improvement.gap <= most
    assert (HULL.depth(improvement.layout.position) == 0.0).all()
    first, second = np.triu_indices(n, k=1)
    position = improvement.layout.position
    distance = np.linalg.norm(position[first] - position[second], axis=1)
    assert distance.min() >= CLEARANCE - 1e-8
    assert improvement.to_dict()["bound"]["value"] > improvement.value_after


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("A", {}, "expected thrusters alone, got front_right, a fin"),
        ("catamaran", {}, "expected thrusters alone, got .*, a azimuth|an azimuth"),
        ("bluerov2_heavy", {"goal": "mission_power"}, "none of the power for a mission"),
        ("bluerov2_heavy", {"flow": [1, 0, 0, 0, 0, 0]}, "it holds at rest"),
    ],
)
def test_where_there_is_no_bound(
    shipped: Layouts, name: str, settings: dict[str, object], message: str
) -> None:
    layout = shipped(name)
    with pytest.raises(LayoutError, match=message):
        optimize_layout(layout, layout.names[:1], bound=True, **settings)


def test_too_few_thrusters_have_no_weakest_direction(shipped: Layouts) -> None:
    assert bound_of(thrusters(shipped, 5), FLAT) == 0.0
    assert bound_of(thrusters(shipped, 6), FLAT, after_loss=True) == 0.0
