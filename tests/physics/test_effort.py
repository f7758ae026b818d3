"""The energy proxy `J_en`: by hand, over fins, and its slopes."""

import numpy as np
import pytest

from finlab.physics.objective import EffortMeter, command_effort, effort_scale, fin_effort

UPPER = np.array([[0.6, 2.1, np.pi], [0.4, 3.0, -0.5], [0.5, 1.0, 0.0]])


def commands(rows: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(0.05, 0.9, (rows, 3, 3)) * [1.0, 2.0, 3.0]


def test_each_term_by_hand() -> None:
    half = np.array([0.3, 0.7, np.pi / 4])  # 1/2, 1/3 and 1/4 of the first fin's limits
    assert fin_effort(half, UPPER[0]) == pytest.approx(1 / 4 + 1 / 9 + 0.1 / 16 + 1 / 6)


def test_a_robots_energy_is_the_sum_over_fins() -> None:
    command = commands(5)
    fins = np.stack([fin_effort(command[:, i], UPPER[i]) for i in range(3)], axis=1)
    np.testing.assert_allclose(EffortMeter(UPPER)(command), fins.sum(1))
    np.testing.assert_allclose(command_effort(command, UPPER), fins.sum(1))
    command[2, 1] = np.nan  # a failed fin costs nothing
    fins[2, 1] = 0.0
    np.testing.assert_allclose(command_effort(command, UPPER), fins.sum(1))


def test_slopes_are_those_of_differences() -> None:
    upper = np.where(UPPER == 0.0, 1.0, UPPER)  # differences of huge energies are not exact
    command, meter = commands(4), EffortMeter(upper)
    gradient = meter.gradient(command)
    for i in range(3):
        for k in range(3):
            step = np.zeros((3, 3))
            step[i, k] = 1e-6 * effort_scale(upper)[i, k]
            difference = (meter(command + step) - meter(command - step)) / (2.0 * step[i, k])
            np.testing.assert_allclose(gradient[:, i, k], difference, rtol=1e-5, atol=1e-6)
