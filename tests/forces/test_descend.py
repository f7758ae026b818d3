"""The cheapest exact forces, judged by the conditions of an optimum, whatever the steps that lead there."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces import force_space
from finlab.forces.envelopes import Envelopes, Projected
from finlab.forces.fin_envelope import COST, MOBILITY
from finlab.forces.force_space import IDLE, Planar, PlanarProblem, descend, realize
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.layout.angles import wrapped
from finlab.physics import Plant, make_law
from finlab.physics.objective import Objective
from tests.forces.conftest import SIGMA, problem_of
from tests.random_fins import random_robot, write_fin_table

Array = NDArray[np.float64]


def robot(seed: int, limits: str = "nominal", n_fins: int = 5) -> Layout:
    return random_robot(np.random.default_rng(seed), ("drag", "lighthill"), n_fins=n_fins, limits=limits)


def reachable(layout: Layout, rows: int, seed: int = 7) -> Array:
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (rows,))) / SIGMA


def solved(problem: PlanarProblem, target: Array, works: Array | None = None) -> Planar:
    return descend(problem, target, np.tile(problem.fins.maximum, (len(target), 1)), 60, works)


def cost(planar: Planar) -> Array:
    total: Array = planar.row[..., COST].sum(-1)
    return total


def test_each_fin_pushes_as_far_as_the_pull_on_it_pays() -> None:
    """The conditions of Karush, Kuhn and Tucker, fin by fin: inside its limits the pull is the marginal cost
    along the force; at the largest force it is more, at the smallest less, at a stop it may point past it."""
    found: dict[str, list[Array]] = {name: [] for name in ("inner", "turning", "held", "stopped")}
    for seed, limits in [(seed, limits) for seed in range(12) for limits in ("nominal", "varied")]:
        problem, plant = problem_of(robot(seed, limits)), Plant(robot(seed, limits))
        command = plant.sample(np.random.default_rng(7), (20,))
        command[10:, :, :2] = plant.upper[:, :2]  # fins at full load, most of which the search turns
        planar, fins = solved(problem, plant.wrench(command) / SIGMA), problem.fins
        pull = (planar.multiplier @ problem.columns.T).reshape(20, 2, -1)
        along = pull[:, 0] * np.cos(planar.direction) + pull[:, 1] * np.sin(planar.direction)
        across = pull[:, 1] * np.cos(planar.direction) - pull[:, 0] * np.sin(planar.direction)
        scale = np.abs(along).max(1, keepdims=True)
        excess = (along - planar.size / np.exp(planar.row[..., MOBILITY])) / scale
        rim, offset = fins.rim(planar.direction), wrapped(planar.direction - fins.middle)
        most, least = planar.size >= rim.largest * (1.0 - 1e-9), planar.size <= rim.smallest * (1.0 + 1e-9)
        stopped = (fins.half < np.pi) & (np.abs(offset) > fins.half - 1e-9)
        exact = np.linalg.norm(planar.residual, axis=1) < 1e-6
        plain = (exact & ~(most | least | stopped).any(1))[:, None] & np.ones_like(most)
        found["inner"].append(np.abs(excess)[plain])
        found["turning"].append((np.abs(across) / scale)[plain])
        found["held"].append(excess[exact[:, None] & most & ~stopped])
        found["stopped"].append((np.sign(offset) * across / scale)[exact[:, None] & stopped & ~least])
    inner, turning, held, stopped = (np.concatenate(part) for part in found.values())
    assert len(inner) > 500 and np.quantile(inner, 0.9) < 1e-3 and np.quantile(turning, 0.9) < 1e-4
    assert len(held) > 20 and np.quantile(held, 0.05) > 0.0
    assert len(stopped) > 20 and np.quantile(stopped, 0.05) > 0.0


def test_multipliers_are_what_each_axis_of_the_target_costs() -> None:
    """The envelope theorem: the least cost's derivative by the target, by differences of whole answers."""
    compared = []
    for seed in range(6):
        layout = robot(seed)
        problem, target = problem_of(layout), 0.6 * reachable(layout, 6, seed)
        planar = solved(problem, target)
        rim = problem.fins.rim(planar.direction)
        inside = ((planar.size < 0.999 * rim.largest) & (planar.size > 1.5 * rim.smallest)).all(1)
        fine = inside & (np.linalg.norm(planar.residual, axis=1) < 1e-7)
        for axis in range(6):
            step = 5e-2 * np.eye(6)[axis]
            more, less = (solved(problem, target + s * step) for s in (1.0, -1.0))
            slope = (cost(more) - cost(less)) / 0.1
            exact = np.linalg.norm(more.residual, axis=1) + np.linalg.norm(less.residual, axis=1) < 1e-6
            scale = np.linalg.norm(planar.multiplier, axis=1)
            compared.append((np.abs(slope - planar.multiplier[:, axis]) / scale)[fine & exact])
    off = np.concatenate(compared)
    assert len(off) > 60 and np.median(off) < 0.02 and np.quantile(off, 0.9) < 0.05


def test_no_other_exact_forces_cost_less() -> None:
    """A step in the null space of the fins' columns keeps the wrench and never saves anything."""
    rng = np.random.default_rng(0)
    for seed in range(5):
        layout = robot(seed, n_fins=6)
        problem, target = problem_of(layout), 0.5 * reachable(layout, 10)
        planar = solved(problem, target)
        force = planar.size * np.exp(1j * planar.direction)
        null = np.linalg.svd(problem.columns.T)[2][6:]
        for _ in range(10):
            step = rng.normal(size=(10, len(null))) @ null * rng.uniform(0.02, 0.3)
            other = force + step[:, :6] + 1j * step[:, 6:]
            size, direction = np.abs(other), np.angle(other)
            rim = problem.fins.rim(direction)
            possible = ((size <= rim.largest) & (size >= rim.smallest)).all(1)
            dearer = problem.fins.lookup(rim, size)[..., COST].sum(-1) >= cost(planar) * (1.0 - 2e-4)
            assert dearer[possible & (np.linalg.norm(planar.residual, axis=1) < 1e-6)].all()


def test_fins_that_have_to_rest_do_and_the_others_are_a_robot_without_them() -> None:
    """The same cost as the smaller robot's own, but for what the resting fins cannot go below."""
    layout = robot(1, n_fins=6)
    fins = problem_of(layout).fins.without_rest()
    problem = problem_of(layout)._replace(fins=fins)
    works = np.ones((12, 6))
    works[:, 2] = 0.0
    small = layout.without([layout.names[2]])
    target = 0.5 * reachable(small, 12)
    planar = solved(problem, target, works)
    assert (planar.size[:, 2] <= 1e-6 * fins.maximum[2]).all()
    alone = problem_of(small)
    expected = solved(alone._replace(fins=alone.fins.without_rest()), target)
    exact = np.linalg.norm(expected.residual, axis=1) < 1e-7
    assert exact.sum() >= 6
    assert np.linalg.norm(planar.residual, axis=1)[exact] == pytest.approx(np.zeros(exact.sum()), abs=1e-6)
    np.testing.assert_allclose(cost(planar)[exact], cost(expected)[exact], rtol=2e-3)
    others = [0, 1, 3, 4, 5]
    np.testing.assert_allclose(
        planar.size[exact][:, others], expected.size[exact], atol=0.02 * fins.maximum[0]
    )
    # Where every row rests other fins, each is as it would be alone.
    works = 1.0 - np.eye(6)
    target = np.repeat(target[:1], 6, axis=0)
    many = solved(problem, target, works)
    assert (np.diag(many.size) <= 1e-6 * fins.maximum).all()
    np.testing.assert_allclose(many.size[2], solved(problem, target[:1], works[2:3]).size[0], atol=1e-3)


def test_to_go_on_from_forces_leads_to_the_same_optimum() -> None:
    """Power has one: from sizes, from forces anywhere, one row alone or many."""
    layout = robot(3)
    problem, target = problem_of(layout), 0.6 * reachable(layout, 8)
    planar = solved(problem, target)
    start = np.random.default_rng(1).normal(size=(8, 2, 5)) * problem.fins.maximum
    again = descend(problem, target, start, 60)
    np.testing.assert_allclose(cost(again), cost(planar), rtol=2e-3)
    exact = np.linalg.norm(again.residual, axis=1) < 1e-6
    assert exact.mean() >= 0.8
    for row in range(8):
        alone = solved(problem, target[row : row + 1])
        assert cost(alone)[0] == pytest.approx(cost(planar)[row], rel=1e-3)
    shared = descend(problem, target[:1], np.tile(problem.fins.maximum, (3, 1)), 60)
    np.testing.assert_allclose(cost(shared), cost(planar)[0], rtol=1e-3)


def test_forces_along_the_shafts_count(tmp_path: Path) -> None:
    """Measured fins push along their shafts, too: what remains is what the plant says remains."""
    limits = Limits()
    spec = write_fin_table(
        tmp_path / "fin.csv", make_law(FinModelSpec()), limits, sideways=0.3, points=(9, 9, 17)
    )
    base = robot(2, n_fins=5)
    fins = tuple(
        Fin(fin.name, fin.position, fin.mounting_angle, limits, spec if i < 3 else FinModelSpec())
        for i, fin in enumerate(base.fins)
    )
    layout = Layout("sideways", fins)
    problem, plant, target = problem_of(layout), Plant(layout), reachable(layout, 25)
    assert problem.fins.pushes_sideways
    planar = solved(problem, 0.7 * target)
    command, _ = realize(problem, planar)
    left = 0.7 * target - plant.wrench(command) / SIGMA
    exact = np.linalg.norm(planar.residual, axis=1) < 1e-3
    assert exact.mean() > 0.6
    assert np.abs(left - planar.residual)[exact].max() < 0.05
    ignored = problem._replace(along_shaft=np.zeros_like(problem.along_shaft))
    wrong = solved(ignored, 0.7 * target)
    off = 0.7 * target - plant.wrench(realize(ignored, wrong)[0]) / SIGMA
    assert np.median(np.linalg.norm(off, axis=1)) > 5.0 * np.median(np.linalg.norm(left, axis=1))


@pytest.mark.parametrize("name", ["power", "effort"])
def test_the_cost_that_is_told_is_that_of_the_commands(name: str) -> None:
    for seed, limits in ((0, "nominal"), (1, "varied"), (2, "varied")):
        layout = robot(seed, limits)
        objective = Objective("power" if name == "power" else "effort")
        problem = problem_of(layout, objective)
        planar = solved(problem, 0.6 * reachable(layout, 15))
        meter = objective.meter(Plant(layout))
        for rests in (None, 0.0, IDLE):
            command, told = realize(problem, planar, rests)
            full = float(meter(layout.upper[None])[0])
            assert np.abs(told - meter(command)).max() < 5e-3 * full
            moved = np.linalg.norm(Plant(layout).force(command), axis=-1)
            working = planar.size > 5e-3 * problem.fins.maximum
            assert np.abs(moved - planar.size)[working].max() < 5e-3 * problem.fins.maximum.max()


@pytest.mark.parametrize("rows", [1, 5])
def test_forces_that_settle_are_searched_no_longer(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method needs a few steps, however many are allowed."""
    layout, projected = robot(3), []
    problem, target = problem_of(layout), 0.5 * reachable(layout, rows)
    whole = Envelopes.project

    def spy(self: Envelopes, force: Array, size: Array) -> Projected:
        projected.append(len(force))
        return whole(self, force, size)

    monkeypatch.setattr(Envelopes, "project", spy)
    found = descend(problem, target, np.tile(problem.fins.maximum, (rows, 1)), 60)
    assert np.linalg.norm(found.residual, axis=1).max() < 1e-6
    assert 3 < len(projected) < 15


def test_the_last_steps_deliver_what_fins_at_their_limits_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    """After two quadratic problems much is missing where fins are held; two of Newton's steps leave a
    twentieth of that, and no row is worse for them."""

    def missing() -> Array:
        found = []
        for seed in range(10):
            layout = robot(seed, "varied")
            problem, target = problem_of(layout), reachable(layout, 20)
            planar = descend(problem, target, np.tile(problem.fins.maximum, (20, 1)), 2)
            found.append(np.linalg.norm(planar.residual, axis=1))
        return np.concatenate(found)

    after = missing()
    monkeypatch.setattr(force_space, "LAST_STEPS", 0)
    before = missing()
    assert (after <= before + 1e-9).all()
    assert np.quantile(after, 0.95) < 0.06 * np.quantile(before, 0.95)
