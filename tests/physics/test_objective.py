"""What is kept least: watts, or the paper's effort; their slopes, and what a direction costs."""

from pathlib import Path

import numpy as np
import pytest

from finlab.physics import Plant
from finlab.physics.objective import EffortMeter, Name, command_effort, cost_meter, fin_effort
from tests.random_fin_robots import KINDS, random_robot_of_fins


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_a_meters_slopes_are_differences(objective: Name, tmp_path: Path) -> None:
    plant = Plant(random_robot_of_fins(np.random.default_rng(3), KINDS, tmp_path, n_fins=6))
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
    layout = random_robot_of_fins(np.random.default_rng(4), ("drag",), n_fins=3)
    plant = Plant(layout)
    command = plant.sample(np.random.default_rng(0), (4,))
    np.testing.assert_allclose(cost_meter("power", plant)(command), plant.power(command).sum(-1))
    effort = command_effort(command, layout.upper)
    np.testing.assert_allclose(cost_meter("effort", plant)(command), effort)


COMMAND_MAX = np.array([[0.6, 2.1, np.pi], [0.4, 3.0, -0.5], [0.5, 1.0, 0.0]])
"""Upper limits (3, 3) of three fins."""


def random_commands(rows: int) -> np.ndarray:
    """Commands (rows, 3, 3) of these fins."""
    return np.random.default_rng(0).uniform(0.05, 0.9, (rows, 3, 3)) * [1.0, 2.0, 3.0]


def test_each_term_by_hand() -> None:
    half = np.array([0.3, 0.7, np.pi / 4])  # 1/2, 1/3 and 1/4 of the first fin's limits
    assert fin_effort(half, COMMAND_MAX[0]) == pytest.approx(1 / 4 + 1 / 9 + 0.1 / 16 + 1 / 6)


def test_a_robots_energy_is_the_sum_over_fins() -> None:
    command = random_commands(5)
    fins = np.stack([fin_effort(command[:, i], COMMAND_MAX[i]) for i in range(3)], axis=1)
    np.testing.assert_allclose(EffortMeter(COMMAND_MAX)(command), fins.sum(1))
    np.testing.assert_allclose(command_effort(command, COMMAND_MAX), fins.sum(1))
    command[2, 1] = np.nan  # a lost fin costs nothing
    fins[2, 1] = 0.0
    np.testing.assert_allclose(command_effort(command, COMMAND_MAX), fins.sum(1))
