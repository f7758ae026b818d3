"""What is kept least: watts, or the paper's effort; their slopes, and what a direction costs."""

from pathlib import Path

import numpy as np
import pytest

from finlab.layout import FinModelSpec, Limits
from finlab.physics import Plant, make_law
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights, command_energy
from finlab.physics.objective import Objective
from tests.random_fins import KINDS, random_robot, write_fin_table

INERTIAL = EnergyWeights(0.0, 0.0, 0.0, 0.0, 1.0)

OBJECTIVES = [
    Objective(),
    Objective("power", copper_loss=1.5),
    Objective("effort"),
    Objective("effort", EnergyWeights(2.0, 0.5, 0.3, 0.7, 1.1)),
    Objective("effort", INERTIAL),
]


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_a_meters_slopes_are_differences(objective: Objective, tmp_path: Path) -> None:
    plant = Plant(random_robot(np.random.default_rng(3), KINDS, tmp_path, n_fins=6))
    meter = objective.meter(plant)
    command = plant.sample(np.random.default_rng(0), (7,))
    slopes = meter.slopes(command)
    assert slopes.shape == command.shape and meter(command).shape == (7,)
    for i in range(6):
        for axis in range(3):
            step = np.zeros((6, 3))
            step[i, axis] = 1e-6
            difference = (meter(command + step) - meter(command - step)) / 2e-6
            np.testing.assert_allclose(slopes[:, i, axis], difference, rtol=1e-5, atol=1e-6)


def test_what_each_objective_counts() -> None:
    layout = random_robot(np.random.default_rng(4), ("drag",), n_fins=3)
    plant = Plant(layout)
    command = plant.sample(np.random.default_rng(0), (4,))
    np.testing.assert_allclose(Objective().meter(plant)(command), plant.power(command).sum(-1))
    effort = command_energy(command, layout.upper, DEFAULT_WEIGHTS)
    np.testing.assert_allclose(Objective("effort").meter(plant)(command), effort)
    assert Objective().convex and not Objective("effort").convex
    np.testing.assert_array_equal(Objective().direction_cost(layout.upper), np.zeros(3))


@pytest.mark.parametrize("loss", [0.0, 5.0])
def test_measured_power_is_told_as_it_is(loss: float, tmp_path: Path) -> None:
    limits, law = Limits(), make_law(FinModelSpec())
    told = make_law(write_fin_table(tmp_path / "told.csv", law, limits, power=True, points=(13, 13, 13)))
    plain = make_law(write_fin_table(tmp_path / "plain.csv", law, limits))
    command = np.random.default_rng(0).uniform(limits.lower, limits.upper, (50, 3))
    expected = 1.3 * np.asarray(law.power(command)) + 0.05
    np.testing.assert_allclose(told.power(command, loss), expected, rtol=0.02, atol=0.02)
    np.testing.assert_allclose(plain.power(command, loss), law.power(command, loss), rtol=1e-12)
    for table in (told, plain):
        slopes = table.power_slopes(command, loss)
        for axis in range(3):
            step = np.eye(3)[axis] * 1e-6
            difference = (table.power(command + step, loss) - table.power(command - step, loss)) / 2e-6
            np.testing.assert_allclose(slopes[:, axis], difference, rtol=1e-4, atol=1e-5)
