"""The numerical parts of the model-based methods against independent references."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.box_least_squares import solve_box_quadratics
from finlab.allocation.baselines.single_target import Problem
from finlab.allocation.command_cost import EffortCost, command_cost
from finlab.allocation.weighted_descent import DescentOptions, descend
from finlab.layout import Fin, FinModelSpec, Layout, random_layout
from finlab.physics import plant_of
from finlab.physics.energy import EnergyMeter, EnergyWeights, command_energy
from finlab.physics.objective import Objective

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


def _layout(*specs: FinModelSpec) -> Layout:
    rng = np.random.default_rng(len(specs))
    return Layout(
        "mixed",
        tuple(
            Fin(f"fin_{i}", tuple(rng.uniform(-0.3, 0.3, 3).tolist()), float(rng.uniform(-3, 3)), model=spec)
            for i, spec in enumerate(specs)
        ),
    )


def test_feasible_wraps_full_turns_and_clips_the_rest() -> None:
    rng = np.random.default_rng(1)
    layout = random_layout(rng, n_fins=5, limits="varied")
    plant = plant_of(layout)
    wild = rng.normal(scale=20.0, size=(100, 5, 3))
    tame = plant.feasible(wild)
    assert (tame >= plant.lower).all() and (tame <= plant.upper).all()
    turns = (tame - wild)[:, plant.full_turn, 2] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    np.testing.assert_array_equal(plant.feasible(tame), tame)


@pytest.mark.parametrize("n_variables", [1, 6, 15, 48])
def test_box_quadratics_agree_with_scipy(n_variables: int) -> None:
    rng = np.random.default_rng(n_variables)
    matrix = rng.normal(size=(40, 6, n_variables))
    right = 3.0 * rng.normal(size=(40, 6))
    lower, upper = -rng.uniform(0, 1, (40, n_variables)), rng.uniform(0, 1, (40, n_variables))
    weight = 1e-2
    hessian = np.einsum("bki,bkj->bij", matrix, matrix) + weight * np.eye(n_variables)
    gradient = -np.einsum("bki,bk->bi", matrix, right)
    found = solve_box_quadratics(hessian, gradient, lower, upper)
    assert (found >= lower).all() and (found <= upper).all()
    for i in range(len(found)):
        stacked = np.vstack([matrix[i], np.sqrt(weight) * np.eye(n_variables)])
        padded = np.concatenate([right[i], np.zeros(n_variables)])
        expected = lsq_linear(stacked, padded, (lower[i], upper[i]), method="bvls", tol=1e-14).x
        np.testing.assert_allclose(found[i], expected, atol=1e-6)


def test_box_quadratics_meet_their_optimality_conditions() -> None:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(500, 6, 12))
    hessian = np.einsum("bki,bkj->bij", matrix, matrix) + 1e-4 * np.eye(12)
    gradient = 5.0 * rng.normal(size=(500, 12))
    x = solve_box_quadratics(hessian, gradient, -np.ones((500, 12)), np.ones((500, 12)))
    slope = np.einsum("bij,bj->bi", hessian, x) + gradient
    assert np.abs(x - np.clip(x - slope, -1, 1)).max() < 1e-7


def test_a_fixed_variable_stays() -> None:
    x = solve_box_quadratics(
        np.eye(2)[None], np.array([[-1.0, -1.0]]), np.zeros((1, 2)), np.array([[0.0, 5.0]])
    )
    np.testing.assert_allclose(x, [[0.0, 1.0]])


@pytest.mark.parametrize("energy_tradeoff", [0.0, 1e-3])
def test_descent_lowers_its_objective_and_reports_it(energy_tradeoff: float) -> None:
    rng = np.random.default_rng(3)
    plant = plant_of(random_layout(rng, n_fins=4, limits="varied"))
    start = plant.sample(rng, (50,))
    target = plant.wrench(plant.sample(rng, (50,)))

    def objective(command: np.ndarray) -> np.ndarray:
        error = (((plant.wrench(command) - target) / SIGMA) ** 2).sum(-1)
        return error + energy_tradeoff * command_energy(command, plant.upper)

    end = descend(
        plant, start, target, SIGMA, DescentOptions(), EffortCost(EnergyMeter(plant.upper), energy_tradeoff)
    )
    np.testing.assert_allclose(end.objective, objective(end.command), rtol=1e-9)
    assert (end.objective <= objective(start)).all()
    assert np.median(objective(end.command)) < 0.05 * np.median(objective(start))


def test_energy_in_the_descent_finds_cheaper_commands() -> None:
    rng = np.random.default_rng(4)
    plant = plant_of(random_layout(rng, n_fins=5))
    start, target = plant.sample(rng, (50,)), plant.wrench(plant.sample(rng, (50,)))
    costs = None, EffortCost(EnergyMeter(plant.upper), 1e-4)
    plain, cheap = (
        descend(plant, start, target, SIGMA, DescentOptions(n_steps=60), cost).command for cost in costs
    )
    assert command_energy(cheap, plant.upper).mean() < 0.95 * command_energy(plain, plant.upper).mean()


@pytest.mark.parametrize("copper_loss", [0.0, 0.5])
def test_power_in_the_descent_finds_sparing_commands(copper_loss: float) -> None:
    rng = np.random.default_rng(4)
    plant = plant_of(_layout(FinModelSpec("drag"), FinModelSpec("lighthill"), FinModelSpec("soft")))
    start, target = plant.sample(rng, (50,)), 0.5 * plant.wrench(plant.sample(rng, (50,)))
    costs = None, command_cost(plant, Objective(copper_loss=copper_loss), SIGMA, 1e-3)
    plain, sparing = (
        descend(plant, start, target, SIGMA, DescentOptions(n_steps=60), cost) for cost in costs
    )
    assert costs[1] is not None
    np.testing.assert_allclose(
        sparing.objective, (((sparing.wrench - target) / SIGMA) ** 2).sum(-1) + costs[1](sparing.command)
    )
    power = [plant.power(end.command, copper_loss).sum(-1).mean() for end in (plain, sparing)]
    assert power[1] < 0.9 * power[0]


AIMS = [
    Objective("effort"),
    Objective("effort", EnergyWeights(0.5, 2.0, 0.3, 0.7, 1.5)),
    Objective("power"),
    Objective("power", copper_loss=0.4),
]


@pytest.mark.parametrize("aim", AIMS)
def test_single_target_derivatives_match_finite_differences(aim: Objective) -> None:
    rng = np.random.default_rng(5)
    plant = plant_of(random_layout(rng, n_fins=3, limits="varied"))
    cost = command_cost(plant, aim, SIGMA, 1e-2)
    problem = Problem(plant, rng.normal(size=6), SIGMA, cost=cost)
    x = rng.uniform(0.2, 0.8, problem.n_free)
    step = 1e-6 * np.eye(problem.n_free)
    numeric = np.array([(problem.residual(x + d) - problem.residual(x - d)) / 2e-6 for d in step]).T
    np.testing.assert_allclose(problem.residual_slope(x), numeric, atol=1e-6)
    value, gradient = problem.objective(x)
    numeric = np.array([(problem.objective(x + d)[0] - problem.objective(x - d)[0]) / 2e-6 for d in step])
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-5)
    command = problem.command(x)
    expected = (problem.residual(x) ** 2).sum() + cost(command[None])[0]
    assert value == pytest.approx(float(expected))
    np.testing.assert_allclose(problem.position(command), x)
