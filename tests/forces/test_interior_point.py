"""The convex solver: its forces lie within the fins' sets and satisfy the conditions of an optimum."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize as scipy_minimize

from finlab.forces.force_sets import ForceSets
from finlab.forces.interior_point import minimize
from tests.exhaustive import crossed
from tests.forces.test_force_sets import HALVES, fins, sector

Array = NDArray[np.float64]

GAP = 1e-11


def robots(half: float, rows: int = 40, n: int = 5, scale: float = 1.0) -> ForceSets:
    rng = np.random.default_rng(5)
    effectiveness = scale * rng.standard_normal((rows, n, 2, 6))
    middle = rng.uniform(-np.pi, np.pi, (rows, n))
    return ForceSets(effectiveness, rng.uniform(0.5, 3.0, (rows, n)), middle, np.full((rows, n), half))


@pytest.mark.parametrize(
    ("half", "scale", "far"), crossed(HALVES, [1e-3, 1.0, 1e3], [0.2, 5.0, 1e4], every=5)
)
def test_no_force_within_the_sets_gains_more(half: float, scale: float, far: float) -> None:
    """At the optimum each fin's force is the farthest that its set has along the pull."""
    sets = robots(half, scale=scale)
    rng = np.random.default_rng(6)
    size = far * scale * 10.0
    wanted = rng.standard_normal((40, 6)) * size
    c = rng.uniform(0.1, 10.0, (40, 6))
    force, multiplier = minimize(sets, wanted, c, GAP)
    assert multiplier == pytest.approx((wanted - sets.wrench(force)) / c, abs=1e-5 * (scale + size))
    gain = sets.pull(multiplier)
    alone = ForceSets(
        np.tile(np.eye(2), (40, 5, 1, 1)).reshape(200, 1, 2, 2),
        *(f.reshape(200, 1) for f in (sets.radius, sets.middle, sets.half)),
    )
    reach, _ = alone.farthest(gain.reshape(200, 2))
    used = (gain * force).sum(-1).reshape(200)
    assert reach == pytest.approx(used, abs=1e-6 * scale * (scale + size))


@pytest.mark.parametrize("half", HALVES)
def test_the_answer_is_the_nearest_point_of_the_sector(half: float) -> None:
    sets = fins(half)
    wanted = np.pad(np.random.default_rng(1).standard_normal((200, 2)) * 4.0, ((0, 0), (0, 4)))
    force = minimize(sets, wanted, np.ones(6), GAP)[0][:, 0]
    for row in range(0, 200, 40):
        distance = np.linalg.norm(sector(sets, row) - wanted[row, :2], axis=-1).min()
        mine = np.linalg.norm(force[row] - wanted[row, :2])
        assert mine <= distance + 1e-6
        if half <= np.pi / 2 or half == np.pi:  # a wide sector counts with its hull
            assert mine >= distance - 0.03  # how far apart the points are


@pytest.mark.filterwarnings("error")
def test_robots_without_anything_to_push_with() -> None:
    sets = robots(1.0)
    wanted = np.random.default_rng(7).standard_normal((40, 6))
    for dead in (
        sets._replace(radius=np.zeros((40, 5))),
        sets._replace(effectiveness=np.zeros((40, 5, 2, 6))),
        sets._replace(effectiveness=np.repeat(sets.effectiveness[:, :1], 5, axis=1)),
        sets._replace(half=np.zeros((40, 5)), middle=np.zeros((40, 5))),
    ):
        for c in (np.ones(6), np.array([1.0, *(1e-9,) * 5])):
            force, multiplier = minimize(dead, wanted, c, GAP)
            assert np.isfinite(force).all() and np.isfinite(multiplier).all()
            assert (np.linalg.norm(force, axis=-1) <= dead.radius * (1 + 1e-9)).all()


@pytest.mark.parametrize("far", [0.3, 3.0, 30.0])
def test_uneven_fins_within_their_polygons_against_scipy(far: float) -> None:
    """Polygons off their centres, in discs that cut some corners: SciPy finds nothing better."""
    rng, count, n = np.random.default_rng(5), 12, 3
    side = 2.0 * np.pi * np.arange(count) / count
    normals = np.stack([np.cos(side), np.sin(side)])
    boundary = 0.75 + 0.2 * np.cos(side - rng.uniform(0.0, 6.0, (6, n, 1)))
    effectiveness = rng.standard_normal((6, n, 2, 6))
    radius = rng.uniform(0.5, 2.0, (6, n))
    sets = ForceSets(effectiveness, radius, np.zeros((6, n)), np.full((6, n), np.pi), boundary)
    wanted = far * rng.standard_normal((6, 6))
    found, _ = minimize(sets, wanted, np.ones(6), GAP)
    for row in range(6):
        most = (boundary[row] * radius[row, :, None]).ravel()

        def value(flat: Array, row: int = row) -> float:
            missed = wanted[row] - flat @ effectiveness[row].reshape(2 * n, 6)
            return float(0.5 * missed @ missed)

        def room(flat: Array, row: int = row, most: Array = most) -> Array:
            force = flat.reshape(n, 2)
            inside = radius[row] ** 2 - (force**2).sum(1)
            return np.concatenate([most - (force @ normals).ravel(), inside])

        own = found[row].ravel()
        assert room(own).min() > -1e-7
        best = scipy_minimize(
            value,
            0.0 * own,
            method="SLSQP",
            constraints={"type": "ineq", "fun": room},
            options={"ftol": 1e-12},
        )
        assert value(own) <= best.fun * (1.0 + 1e-6) + 1e-9  # it may stop early, but not beyond its limits
        assert room(best.x).min() > -1e-6
