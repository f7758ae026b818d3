"""The search in force space: exact where exact is possible, inside the limits, at the least cost."""

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.force_space import PlanarProblem, descend, polar, realize
from finlab.layout import Layout
from finlab.physics import Plant
from finlab.physics.objective import Name, Objective
from tests.forces.conftest import SIGMA, problem_of
from tests.random_fins import random_robot

Array = NDArray[np.float64]
LAWS = ("drag", "lighthill", "soft")


def robots(
    limits: str, kinds: tuple[str, ...] = ("drag", "lighthill"), n_fins: int | tuple[int, int] = (2, 6)
) -> list[Layout]:
    return [
        random_robot(np.random.default_rng(seed), kinds, n_fins=n_fins, limits=limits) for seed in range(10)
    ]


def reachable(layout: Layout, n: int = 20, seed: int = 7) -> Array:
    """Normalized wrenches (n, 6) of random commands."""
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (n,))) / SIGMA


def full(problem: PlanarProblem, rows: int) -> Array:
    return np.tile(problem.fins.maximum, (rows, 1))


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize("kinds", [("drag", "lighthill"), LAWS])
def test_reaches_what_can_be_reached(kinds: tuple[str, ...], objective: Name) -> None:
    error = []
    for layout in robots("nominal", kinds):
        problem, target = problem_of(layout, Objective(objective)), reachable(layout)
        planar = descend(problem, target, full(problem, len(target)), 40)
        error.append(np.linalg.norm(planar.residual, axis=1))
    errors = np.concatenate(error)
    assert np.quantile(errors, 0.9) < 1e-3
    if objective == "power":
        assert np.quantile(errors, 0.97) < 1e-6
        assert "soft" in kinds or errors.max() < 1e-5


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize("scale", [0.0, 1.0, 50.0])
@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_forces_keep_the_limits_wherever_the_target_lies(limits: str, scale: float, objective: Name) -> None:
    for layout in robots(limits, LAWS):
        problem = problem_of(layout, Objective(objective))
        target = scale * reachable(layout)
        planar = descend(problem, target, full(problem, len(target)), 6)
        boundary = problem.fins.boundary(planar.direction)
        assert (planar.size >= boundary.smallest - 1e-12).all()
        assert (planar.size <= boundary.largest + 1e-12).all()
        command, cost = realize(problem, planar)
        assert np.isfinite(command).all() and np.isfinite(cost).all()
        turned = np.remainder(planar.direction - problem.fins.middle + np.pi, 2 * np.pi) - np.pi
        assert (np.abs(turned) <= problem.fins.half + 1e-9).all()
        assert (command[..., :2] >= layout.lower[:, :2] - 1e-9).all()
        assert (command[..., :2] <= layout.upper[:, :2] + 1e-9).all()


def test_is_cheaper_than_the_pseudo_inverse() -> None:
    ratio = []
    for layout in robots("nominal", n_fins=(4, 5)):
        for aim, most in ((Objective("power"), 1.004), (Objective("effort"), 1.02)):
            problem = problem_of(layout, aim)
            target = 0.5 * reachable(layout)
            effectiveness = np.stack(np.split(problem.effectiveness, 2), axis=1).reshape(-1, 6)
            force = (target @ np.linalg.pinv(effectiveness)).reshape(len(target), -1, 2)
            size = np.linalg.norm(force, axis=-1)
            planar = descend(problem, target, size, 30)
            inside = ((size >= problem.fins.minimum) & (size <= problem.fins.maximum)).all(1)
            exact = np.linalg.norm(planar.residual, axis=1) < 1e-4
            assert exact[inside].mean() > 0.9
            change = realize(problem, planar)[1] / realize(problem, polar(problem, force))[1]
            assert change[inside & exact].max() < most
            ratio.append(change[inside & exact])
    ratios = np.concatenate(ratio)
    assert len(ratios) > 200 and ratios.mean() < 0.95
