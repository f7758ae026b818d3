"""What single fins can push: the farthest point of a sector, and sectors cut into convex parts."""

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.force_sets import MAX_CUT, ForceSets, convex_parts

Array = NDArray[np.float64]
HALVES = [0.0, 0.4, np.pi / 2, 1.9, 2.9, np.pi]


def fins(half: float, rows: int = 200) -> ForceSets:
    """Robots of one fin that pushes along x and y alone."""
    rng = np.random.default_rng(0)
    effectiveness = np.zeros((rows, 1, 2, 6))
    effectiveness[:, 0, 0, 0] = effectiveness[:, 0, 1, 1] = 1.0
    middle = rng.uniform(-np.pi, np.pi, (rows, 1))
    return ForceSets(effectiveness, np.full((rows, 1), 3.0), middle, np.full((rows, 1), half))


def pulls(rows: int = 200) -> Array:
    return np.random.default_rng(1).standard_normal((rows, 1, 2)) * 2.0


def sector(sets: ForceSets, row: int) -> Array:
    """Points (S, 2) all over one fin's sector, its rim and its tip included."""
    angle = sets.middle[row, 0] + np.linspace(-1.0, 1.0, 721) * sets.half[row, 0]
    boundary = sets.radius[row, 0] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.concatenate([boundary * share for share in np.linspace(0.0, 1.0, 60)])


@pytest.mark.parametrize("half", HALVES)
def test_farthest_is_the_farthest_point_of_the_sector(half: float) -> None:
    sets, pull = fins(half), pulls()
    normal = np.pad(pull[:, 0], ((0, 0), (0, 4)))
    reach, force = sets.farthest(normal)
    assert np.allclose((force * pull).sum((-1, -2)), reach)
    for row in range(0, 200, 20):
        best = (sector(sets, row) @ pull[row, 0]).max()
        assert best - 1e-9 <= reach[row] <= best + 1e-3


@pytest.mark.parametrize("count", [12, 48])
def test_an_uneven_fin_reaches_as_far_as_the_polygon_around_it(count: int) -> None:
    """Ellipses off their centres, by their polygons' corners; what is pushed lies on the polygon itself."""
    side = 2.0 * np.pi / count * np.arange(count)
    normals = np.stack([np.cos(side), np.sin(side)], axis=-1)
    rng, sets, pull = np.random.default_rng(4), fins(np.pi), pulls()
    long, short, tilt = rng.uniform(0.6, 0.8, 200), rng.uniform(0.3, 0.6, 200), rng.uniform(0.0, 3.0, 200)
    ahead = np.hypot(
        long[:, None] * np.cos(side - tilt[:, None]), short[:, None] * np.sin(side - tilt[:, None])
    )
    boundary = ahead + 0.15 * np.cos(side - 1.0)
    uneven = sets._replace(boundary=boundary[:, None])
    reach, force = uneven.farthest(np.pad(pull[:, 0], ((0, 0), (0, 4))))
    corners = np.linalg.solve(
        np.stack([normals, np.roll(normals, -1, axis=0)], axis=1)[None],
        3.0 * np.stack([boundary, np.roll(boundary, -1, axis=1)], axis=2)[..., None],
    )[..., 0]
    np.testing.assert_allclose(reach, np.einsum("rkc,rc->rk", corners, pull[:, 0]).max(1), rtol=1e-9)
    outward = (force[:, 0] @ normals.T) / (3.0 * boundary)
    np.testing.assert_allclose(outward.max(1), 1.0, rtol=1e-9)
    np.testing.assert_allclose(
        np.arctan2(force[:, 0, 1], force[:, 0, 0]), np.arctan2(pull[:, 0, 1], pull[:, 0, 0]), atol=1e-9
    )
    # A polygon farther out than the disc leaves the disc.
    plain = sets._replace(boundary=np.full((200, 1, count), 1.5))
    for found, known in zip(
        plain.farthest(np.pad(pull[:, 0], ((0, 0), (0, 4)))),
        sets.farthest(np.pad(pull[:, 0], ((0, 0), (0, 4)))),
        strict=True,
    ):
        np.testing.assert_allclose(found, known)


def five_fins(half: float) -> ForceSets:
    """Two robots of five fins with the same arcs."""
    effectiveness = np.random.default_rng(2).standard_normal((2, 5, 2, 6))
    middle = np.tile(np.linspace(-2.0, 2.0, 5), (2, 1))
    return ForceSets(effectiveness, np.ones((2, 5)), middle, np.full((2, 5), half))


@pytest.mark.parametrize(("half", "parts"), [(np.pi / 2, 1), (np.pi, 1), (2.0, 2**MAX_CUT)])
def test_only_wide_sectors_are_cut(half: float, parts: int) -> None:
    sets = five_fins(half)
    assert len(convex_parts(sets).radius) == 2 * parts
    # The same directions reach as far in the best part as in all of the sectors that were cut.
    cut = sets._replace(radius=np.where(np.arange(5) < MAX_CUT, sets.radius, 0.0))
    normal = np.random.default_rng(3).standard_normal((2, 6))
    in_parts = convex_parts(cut).farthest(np.tile(normal, (parts, 1)))[0].reshape(parts, 2)
    assert in_parts.max(axis=0) == pytest.approx(cut.farthest(normal)[0])


def test_fins_beyond_the_first_few_keep_their_hulls() -> None:
    assert (convex_parts(five_fins(2.0)).half[:, MAX_CUT:] == 2.0).all()


def test_a_fin_whose_stops_coincide_has_one_column() -> None:
    sets = five_fins(0.0)
    full = sets.full_effectiveness().reshape(2, 5, 2, 6)
    unit = np.stack([np.cos(sets.middle), np.sin(sets.middle)], axis=-1)
    assert full[:, :, 0] == pytest.approx((unit[..., None] * sets.effectiveness).sum(2))
    assert (full[:, :, 1] == 0.0).all()
