"""What ipopt sees of a robot by formulas, against the plant that scores its answers."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.baselines.plant_in_casadi import plant_formulas, plant_in_casadi
from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import Plant
from finlab.physics.effort import EffortWeights
from finlab.physics.objective import Objective

casadi = pytest.importorskip("casadi", reason="method ipopt is an optional extra")

SIGMA = np.array([1.4, 1.2, 2.0, 0.35, 0.3, 0.4])


@pytest.mark.parametrize(
    "objective",
    [
        Objective("power", copper_loss=0.3),
        Objective("effort"),
        Objective("effort", EffortWeights(1.0, 0.7, 0.3, 0.4)),
    ],
)
def test_formulas_are_the_plant(objective: Objective) -> None:
    """Wrench and cost of random commands; every fin has a law and limits of its own."""
    layout = load_layout("A")
    laws = ("drag", "lighthill", "soft", "drag")
    limits = [Limits((0.05, 0.5), (0.1, 1.5 + 0.3 * i), (-1.0, 1.5 + 0.4 * i)) for i in range(4)]
    fins = zip(layout.fins, laws, limits, strict=True)
    layout = replace(
        layout, actuators=tuple(replace(f, model=FinModelSpec(law), limits=ends) for f, law, ends in fins)
    )
    plant = Plant(layout)
    symbols, wrenches, costs = plant_formulas(casadi, plant, objective)
    formulas = casadi.Function("formulas", [symbols], [wrenches, costs])
    command = plant.sample(np.random.default_rng(0), (8,))
    cost = objective.meter(plant)(command)
    for row in range(8):
        wrench, own = (np.array(part).ravel() for part in formulas(command[row].ravel()))
        np.testing.assert_allclose(wrench, plant.wrench(command[row]), atol=1e-9)
        assert own[0] == pytest.approx(cost[row], rel=1e-9)


@pytest.fixture(params=[Objective("power", copper_loss=0.3), Objective("effort")], ids=["power", "effort"])
def asked(request: pytest.FixtureRequest) -> tuple[Plant, CommandCost]:
    """A robot of two fins, and a cost that is as large as its errors."""
    arc = Limits((0.1, 0.5), (0.3, 1.4), (0.3, 1.7))
    fins = (
        Fin("a", (0.2, 0.1, 0.0), 0.4, model=FinModelSpec("lighthill")),
        Fin("b", (-0.3, 0.2, 0.1), 2.0, limits=arc),
    )
    plant = Plant(Layout("two", fins))
    return plant, command_cost(plant, request.param, SIGMA, 0.7)


def upper_half_by_differences(
    plant: Plant, cost: CommandCost, target: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Second derivatives (6, 6) of the squared normalized error plus cost at a command (6,)."""

    def value(command: np.ndarray) -> float:
        command = command.reshape(1, 2, 3)
        return float((((plant.wrench(command)[0] - target) / SIGMA) ** 2).sum() + cost(command)[0])

    result, step = np.zeros((6, 6)), 1e-4 * np.eye(6)
    for i, j in np.ndindex(6, 6):
        if i <= j:
            pairs = [(p, q) for p in (1, -1) for q in (1, -1)]
            result[i, j] = sum(p * q * value(at + p * step[i] + q * step[j]) for p, q in pairs) / 4e-8
    return result


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_the_hessian_is_that_of_error_and_cost(asked: tuple[Plant, CommandCost], factor: float) -> None:
    plant, cost = asked
    target = np.array([0.4, -0.3, 0.5, 0.1, 0.0, 0.1])
    _, curvature = plant_in_casadi(casadi, plant, cost, SIGMA)
    for at in plant.lower + np.array([[0.5], [0.3]])[:, :, None] * plant.width:
        found = np.array(curvature(at.ravel(), target, factor, []).full())
        expected = factor * upper_half_by_differences(plant, cost, target, at.ravel())
        np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())


def test_at_the_limits_the_hessian_looks_inwards(asked: tuple[Plant, CommandCost]) -> None:
    plant, cost = asked
    target = np.array([0.4, -0.3, 0.5, 0.1, 0.0, 0.1])
    _, curvature = plant_in_casadi(casadi, plant, cost, SIGMA)
    for at in (plant.lower, plant.upper):
        found = np.array(curvature(at.ravel(), target, 3.0, []).full())
        expected = 3.0 * upper_half_by_differences(plant, cost, target, at.ravel())
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_the_function_that_asks_the_plant_knows_its_slopes(asked: tuple[Plant, CommandCost]) -> None:
    plant, cost = asked
    called, _ = plant_in_casadi(casadi, plant, cost, SIGMA)
    command = plant.sample(np.random.default_rng(3), (1,))
    answer = np.array(called(command.ravel()).full()).ravel()
    np.testing.assert_allclose(answer, [*plant.wrench(command)[0], cost(command)[0]])
    jacobian = np.array(called.jacobian()(command.ravel(), answer).full())
    assert jacobian.shape == (7, 6)
    for k, offset in enumerate(1e-6 * np.eye(6).reshape(6, 1, 2, 3)):
        more, less = (
            np.append(plant.wrench(command + s * offset)[0], cost(command + s * offset)) for s in (1, -1)
        )
        np.testing.assert_allclose(jacobian[:, k], (more - less) / 2e-6, rtol=1e-6, atol=1e-8)
