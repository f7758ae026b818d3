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


def test_the_function_that_asks_the_plant_knows_its_slopes(asked: tuple[Plant, CommandCost]) -> None:
    plant, cost = asked
    called = plant_in_casadi(casadi, plant, cost)
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
