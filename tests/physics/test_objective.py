"""What is kept least: watts, or the paper's effort; their slopes, and what a direction costs."""

from pathlib import Path

import numpy as np
import pytest

from finlab.physics import Plant
from finlab.physics.objective import Name, command_effort, cost_meter
from tests.random_fins import KINDS, random_robot

OBJECTIVES = [
    "power",
    "effort",
]


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_a_meters_slopes_are_differences(objective: Name, tmp_path: Path) -> None:
    plant = Plant(random_robot(np.random.default_rng(3), KINDS, tmp_path, n_fins=6))
    meter = cost_meter(objective, plant)
    command = plant.sample(np.random.default_rng(0), (7,))
    gradient = meter.gradient(command)
    assert gradient.shape == command.shape and meter(command).shape == (7,)
    for i in range(6):
        for axis in range(3):
            step = np.zeros((6, 3))
            step[i, axis] = 1e-6
            difference = (meter(command + step) - meter(command - step)) / 2e-6
            np.testing.assert_allclose(gradient[:, i, axis], difference, rtol=1e-5, atol=1e-6)


def test_what_each_objective_counts() -> None:
    layout = random_robot(np.random.default_rng(4), ("drag",), n_fins=3)
    plant = Plant(layout)
    command = plant.sample(np.random.default_rng(0), (4,))
    np.testing.assert_allclose(cost_meter("power", plant)(command), plant.power(command).sum(-1))
    effort = command_effort(command, layout.upper)
    np.testing.assert_allclose(cost_meter("effort", plant)(command), effort)
