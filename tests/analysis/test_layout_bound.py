"""The bound over all layouts holds, against exact values by facets, and is near what is known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import Bounds, KeepOut, layout_bound, optimize_layout
from finlab.analysis.climb import CLEARANCE
from finlab.analysis.keep_out import extreme_places, keep_out_rule
from finlab.analysis.layout_bound import inradius_factor
from finlab.analysis.pose_set import TOLERANCE, PoseSet
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import weakest
from finlab.layout import Layout
from tests.analysis.planar_factor import MULTIPLIERS, pair_index, relations, sums_of_triples
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


def counted_force(layout: Layout, m: int = 6) -> Array:
    """Half of the range of forces of each thruster (n,) [N]; of as many as axes the weaker way."""
    least = layout.lower[:, 0]
    most = layout.upper[:, 0]
    return np.minimum(-least, most) if layout.n == m else 0.5 * (most - least)


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
    force = counted_force(layout)
    wrenches = random_wrenches(np.random.default_rng(n), (count, n), bounds)
    columns = wrenches * force[:, None]
    exact = largest_ball(columns)
    assert exact.max() <= bound
    # Each layout keeps a far nearer bound, by its own columns.
    information = np.swapaxes(columns, -1, -2) @ columns
    own = np.sqrt(inradius_factor(n, 6) / np.trace(np.linalg.inv(information), axis1=1, axis2=2))
    assert (exact <= own * (1.0 + 1e-6) + 1e-6).all()
    assert (exact / own).max() > 0.8, "the case is no test where all are far from it"
    assert own.max() <= bound


@pytest.mark.exhaustive
@pytest.mark.parametrize("bounds", [CUBE, FLAT], ids=["cube", "flat"])
def test_no_one_of_many_layouts_exceeds_it(shipped: Layouts, bounds: Bounds) -> None:
    layout = thrusters(shipped, 8)
    bound = bound_of(layout, bounds)
    force = counted_force(layout)
    for seed in range(10):
        wrenches = random_wrenches(np.random.default_rng(seed), (10_000, 8), bounds)
        assert largest_ball(wrenches * force[:, None]).max() <= bound


@pytest.mark.parametrize("n", [7, 8])
def test_nor_does_one_after_a_loss(shipped: Layouts, n: int) -> None:
    layout = thrusters(shipped, n)
    bound = bound_of(layout, FLAT, after_loss=True)
    force = counted_force(layout)
    wrenches = random_wrenches(np.random.default_rng(n), (5_000, n), FLAT)
    columns = wrenches * force[:, None]
    if n == 7:
        columns = wrenches * np.minimum(-layout.lower[:, 0], layout.upper[:, 0])[:, None]
    after = [largest_ball(np.delete(columns, k, axis=1)) for k in range(n)]
    assert 0.0 < np.min(after, axis=0).max() <= bound < bound_of(layout, FLAT)


def test_the_oracle_agrees_with_the_search_for_the_weakest_direction(shipped: Layouts) -> None:
    layout = shipped("bluerov2_heavy")
    even = [replace(one, force=(-40.0, 40.0)) for one in layout.actuators]
    sets = force_sets(replace(layout, actuators=tuple(even)))
    random = np.random.default_rng(0)
    moved = 0.2 * random.standard_normal(sets.effectiveness[:, :, 0].shape)
    sets.effectiveness[:, :, 0] += moved
    found = weakest(sets).size
    assert largest_ball(40.0 * sets.effectiveness[:, :, 0]) == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize("n", MULTIPLIERS)
def test_the_planar_factor_is_proved_and_attained(n: int) -> None:
    index = pair_index(n)
    form = sums_of_triples(n)
    angles = np.sort(np.random.default_rng(n).uniform(0.0, np.pi, n))
    size = np.random.default_rng(n).uniform(0.5, 2.0, n)
    crosses = np.array([size[a] * size[b] * np.sin(angles[b] - angles[a]) for a, b in index])
    total = form.copy()
    for gaps, relation in relations(n):
        assert abs(crosses @ relation @ crosses) < 1e-12, "a relation does not hold"
        total += MULTIPLIERS[n][gaps] * relation
    factor = inradius_factor(n, n - 2)
    assert np.linalg.eigvalsh(total)[-1] <= factor * (1.0 + 1e-9)
    even = np.array([2.0 / n * np.sin(np.pi / n * (b - a)) for a, b in index])
    assert even @ even == pytest.approx(1.0)
    assert even @ form @ even == pytest.approx(factor)
    assert factor < inradius_factor(n + 1, n - 1) and factor < 3.0 * (n - 2)


def test_the_factors_are_attained() -> None:
    """By orthogonal columns, by a simplex, and by four even directions of a plane."""
    simplex = np.linalg.svd(np.eye(7) - 1.0 / 7.0)[0][:, :6] * np.sqrt(7.0 / 6.0)
    even = np.pi / 4.0 * np.arange(4)
    for columns in (np.eye(6), simplex, np.stack([np.cos(even), np.sin(even)], axis=-1)):
        information = columns.T @ columns
        factor = inradius_factor(*columns.shape)
        bound = np.sqrt(factor / np.trace(np.linalg.inv(information)))
        assert largest_ball(columns[None])[0] == pytest.approx(bound, rel=1e-9)


@pytest.mark.parametrize(
    ("axes", "n", "best"),
    [(("Fx", "Fy", "Fz"), 3, 1.0), (("Fx", "Fy"), 4, 1.0 / np.tan(np.pi / 8.0))],
)
def test_it_is_the_optimum_where_that_is_known(
    shipped: Layouts, axes: tuple[str, ...], n: int, best: float
) -> None:
    """Three at right angles; four in a plane, evenly turned."""
    layout = thrusters(shipped, n)
    force = counted_force(layout, len(axes))[0]
    bound = bound_of(layout, FLAT, axes=axes)
    assert bound == pytest.approx(best * force, rel=3e-4)
    assert bound >= best * force


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
    force = counted_force(layout)
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
    force = counted_force(layout)
    wrenches = random_wrenches(np.random.default_rng(3), (100_000,), FLAT)
    longest = ((wrenches @ metric) ** 2).sum(axis=-1).max()
    assert longest <= (np.array(bound.longest) / force**2).min()
    assert bound.value == pytest.approx(np.sqrt(bound.factor * sum(bound.longest)), rel=1e-8)
    assert bound.axes == AXES


@pytest.mark.parametrize(
    ("n", "bounds", "mirror", "most"),
    [(6, FLAT, (), 0.08), (8, FLAT, None, 0.15), (8, FLAT_BOTH_WAYS, (), 0.15)],
    ids=["six", "pairs", "eight"],
)
def test_a_search_comes_near_it(
    shipped: Layouts, n: int, bounds: Bounds, mirror: tuple[()] | None, most: float
) -> None:
    layout = thrusters(shipped, n)
    everywhere = dict.fromkeys(layout.names, bounds)
    improvement = optimize_layout(
        layout, layout.names, everywhere, mirror=mirror, searches=2, keep_outs=[HULL], bound=True
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
