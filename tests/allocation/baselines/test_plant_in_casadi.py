"""What ipopt sees of a robot by formulas, against the plant that scores its answers."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.baselines.plant_in_casadi import plant_formulas
from finlab.layout import FinModelSpec, Limits, load_layout
from finlab.physics import Plant
from finlab.physics.objective import Name, cost_meter

casadi = pytest.importorskip("casadi", reason="method ipopt is an optional extra")


@pytest.mark.parametrize(
    "objective",
    [
        "power",
        "effort",
    ],
)
def test_formulas_are_the_plant(objective: Name) -> None:
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
    cost = cost_meter(objective, plant)(command)
    for row in range(8):
        wrench, own = (np.array(part).ravel() for part in formulas(command[row].ravel()))
        np.testing.assert_allclose(wrench, plant.wrench(command[row]), atol=1e-9)
        assert own[0] == pytest.approx(cost[row], rel=1e-9)
