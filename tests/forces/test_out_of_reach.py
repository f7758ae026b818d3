"""The nearest wrench within reach: held against its own proof of optimality and against a general solver."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.assets import shipped_layouts
from finlab.forces.fin_sets import planar_sets
from finlab.forces.force_space import PlanarProblem
from finlab.forces.out_of_reach import Nearest, nearest, nearest_along, nearest_in_turn
from finlab.layout import load_layout, random_layout
from tests.forces.conftest import problem_of

GROUPS = [
    np.array([False, False, True, False, False, False]),
    np.array([True, True, False, True, True, True]),
]


def drawn(seed: int, limits: str) -> tuple[PlanarProblem, np.ndarray]:
    """A layout in force space and a wrench that is mostly out of its reach, normalized."""
    rng = np.random.default_rng(seed)
    layout = random_layout(rng, n_fins=int(rng.integers(2, 8)), limits=limits)  # type: ignore[arg-type]
    return problem_of(layout), rng.standard_normal(6) * rng.choice([0.5, 3.0, 8.0])


def paired(planar: PlanarProblem) -> np.ndarray:
    """Normalized wrench per newton (n, 2, 6) of each fin's horizontal and vertical force."""
    return np.stack(np.split(planar.effectiveness, 2), axis=1)


def farthest(planar: PlanarProblem, pull: np.ndarray) -> float:
    """How far the fins can push along pulls (n, 2), sectors wider than half a turn taken whole."""
    angle = np.arctan2(pull[:, 1], pull[:, 0]) - planar.fins.middle
    excess = np.abs((angle + np.pi) % (2 * np.pi) - np.pi) - planar.fins.half
    share = np.where(excess > 0.0, np.maximum(np.cos(np.minimum(excess, np.pi / 2)), 0.0), 1.0)
    return float((planar.fins.maximum * np.linalg.norm(pull, axis=1) * share).sum())


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_no_wrench_within_reach_is_nearer(limits: str) -> None:
    proven = 0
    for seed in range(5000, 5020):
        planar, target = drawn(seed, limits)
        found = nearest(planar_sets(planar), target[None])
        assert (np.linalg.norm(found.force[0], axis=1) <= planar.fins.maximum * (1 + 1e-9)).all()
        missing = target - found.wrench[0]
        # The plane across what is missing separates the target from all that the fins can do.
        gap = farthest(planar, paired(planar) @ missing) - missing @ found.wrench[0]
        convex = ((planar.fins.half <= np.pi / 2) | (planar.fins.half > 3.14)).all()
        if convex:
            assert abs(gap) < 1e-3 * (1.0 + missing @ missing)
            proven += 1
    assert proven >= 8


def test_many_targets_are_answered_like_single_ones() -> None:
    planar, target = drawn(5003, "varied")
    many = nearest(planar_sets(planar), np.stack([target, -target, 0.1 * target]))
    for row, wanted in enumerate((target, -target, 0.1 * target)):
        np.testing.assert_allclose(
            many.wrench[row], nearest(planar_sets(planar), wanted[None]).wrench[0], atol=1e-4
        )


def test_an_axis_that_is_ignored_costs_nothing() -> None:
    planar = problem_of(load_layout(shipped_layouts()["A"]))
    target = np.array([30.0, 0.0, 30.0, 0.0, 0.0, 0.0])
    heave = nearest(
        planar_sets(planar), target[None], np.array([np.inf, np.inf, 1.0, np.inf, np.inf, np.inf])
    )
    both = nearest(planar_sets(planar), target[None])
    assert heave.wrench[0, 2] > both.wrench[0, 2] + 0.1


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_groups_are_served_strictly_in_order(limits: str) -> None:
    for seed in range(5020, 5035):
        planar, target = drawn(seed, limits)
        first = nearest(planar_sets(planar), target[None], np.where(GROUPS[0], 1.0, np.inf)).wrench[0]
        served = nearest_in_turn(planar_sets(planar), target, GROUPS).wrench[0]
        assert abs(served[2] - target[2]) < abs(first[2] - target[2]) + 2e-3


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_the_direction_is_kept_and_no_more_can_be_had(limits: str) -> None:
    out_of_reach = 0
    for seed in range(5040, 5055):
        planar, target = drawn(seed, limits)
        wrench = nearest_along(planar_sets(planar), target).wrench[0]
        share = float(wrench @ target / (target @ target))
        assert -1e-6 <= share <= 1.0 + 1e-6
        assert np.linalg.norm(wrench - share * target) < 2e-3
        if share < 0.99:
            out_of_reach += 1
            beyond = (share + 0.01) * target
            assert np.linalg.norm(nearest(planar_sets(planar), beyond[None]).wrench[0] - beyond) > 1e-4
    assert out_of_reach >= 4


def test_a_general_solver_finds_nothing_nearer() -> None:
    planar = problem_of(load_layout(shipped_layouts()["penta"]))
    target = 4.0 * np.array([6.0, -4.0, 5.0, 1.0, 2.0, -3.0])
    effectiveness, top = paired(planar).reshape(-1, 6), planar.fins.maximum
    found = minimize(
        lambda y: 0.5 * ((y @ effectiveness - target) ** 2).sum(),
        np.zeros(len(effectiveness)),
        jac=lambda y: effectiveness @ (y @ effectiveness - target),
        constraints={"type": "ineq", "fun": lambda y: top**2 - (y.reshape(-1, 2) ** 2).sum(1)},
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-12},
    )
    mine = 0.5 * ((nearest(planar_sets(planar), target[None]).wrench[0] - target) ** 2).sum()
    assert mine == pytest.approx(found.fun, rel=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_along_a_direction_that_the_fins_do_not_have_nothing_is_given(seed: int) -> None:
    """Two fins push along four of six axes; next to nothing beside them is let pass."""
    sets = planar_sets(problem_of(random_layout(np.random.default_rng(seed), n_fins=2)))
    flat = sets.effectiveness.reshape(4, 6)
    along = flat.T @ np.array([0.4, 0.1, -0.2, 0.3])
    size = float(np.linalg.norm(along))
    beside = np.linalg.svd(flat)[2][-1]
    for share, given in ((0.0, True), (1e-6, True), (2e-3, False), (0.1, False), (0.5, False)):
        found = nearest_along(sets, along + share * size * beside)
        assert bool(found.force.any()) == bool(found.wrench.any()) == given
        if given:
            np.testing.assert_allclose(found.wrench[0], along, atol=1e-3 * size)
    nothing = nearest_along(sets, np.zeros(6))
    assert not nothing.force.any() and not nothing.wrench.any() and not nothing.multiplier.any()


def test_a_group_that_would_spoil_an_earlier_one_ends_the_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    sets, asked = planar_sets(problem_of(load_layout(shipped_layouts()["penta"]))), []
    groups = [np.isin(np.arange(6), axes) for axes in ([0, 1, 2], [3], [4, 5])]
    target = np.array([0.3, 0.1, 0.2, 0.05, 0.0, 0.02])

    def spoiling(*arguments: Any) -> Nearest:
        asked.append(arguments)
        found = nearest(*arguments)
        return found._replace(force=0.5 * found.force) if len(asked) == 2 else found

    monkeypatch.setattr("finlab.forces.out_of_reach.nearest", spoiling)
    found = nearest_in_turn(sets, target, groups)
    assert len(asked) == 2
    np.testing.assert_array_equal(found.force, nearest(*asked[0]).force)
    np.testing.assert_allclose(found.wrench[0, :3], target[:3], atol=1e-5)


def test_where_forces_are_unique_the_weakest_fin_sets_the_share() -> None:
    """Three fins span all six axes: the share of a target is what the most loaded of them can give."""
    checked = 0
    for seed in range(5100, 5140):
        rng = np.random.default_rng(seed)
        planar = problem_of(random_layout(rng, n_fins=3))
        target = rng.standard_normal(6) * 6.0
        flat = paired(planar).reshape(6, 6)
        if np.linalg.cond(flat) > 50.0:
            continue
        load = np.linalg.norm(np.linalg.solve(flat.T, target).reshape(3, 2), axis=1) / planar.fins.maximum
        found = nearest_along(planar_sets(planar), target).wrench[0]
        np.testing.assert_allclose(found, target * min(1.0, 1.0 / load.max()), atol=1e-4)
        checked += 1
    assert checked > 20
