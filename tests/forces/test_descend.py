"""The cheapest exact forces, judged by the conditions of an optimum, whatever the steps that lead there."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finlab.forces.fin_envelope import COST, MOBILITY
from finlab.forces.force_space import Planar, PlanarProblem, descend, realize
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.layout.angles import wrapped
from finlab.physics import Plant, make_law
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
        pull = (planar.multiplier @ problem.effectiveness.T).reshape(20, 2, -1)
        along = pull[:, 0] * np.cos(planar.direction) + pull[:, 1] * np.sin(planar.direction)
        across = pull[:, 1] * np.cos(planar.direction) - pull[:, 0] * np.sin(planar.direction)
        scale = np.abs(along).max(1, keepdims=True)
        excess = (along - planar.size / np.exp(planar.row[..., MOBILITY])) / scale
        boundary, offset = fins.boundary(planar.direction), wrapped(planar.direction - fins.middle)
        most = planar.size >= boundary.largest * (1.0 - 1e-9)
        least = planar.size <= boundary.smallest * (1.0 + 1e-9)
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
        boundary = problem.fins.boundary(planar.direction)
        inside = ((planar.size < 0.999 * boundary.largest) & (planar.size > 1.5 * boundary.smallest)).all(1)
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
