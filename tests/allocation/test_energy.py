"""The energy proxy, by hand."""

import numpy as np
import pytest

from finlab.physics.energy import EnergyWeights, command_energy, fin_energy

UPPER = np.array([0.5, 2.0, np.pi])


def test_by_hand() -> None:
    command = np.array([0.25, 2.0, -np.pi / 2])  # normalized: 0.5, 1, -0.5
    assert fin_energy(command, UPPER) == pytest.approx(0.25 + 1.0 + 0.1 * 0.25 + 0.5)
    weights = EnergyWeights(amplitude=2.0, frequency=3.0, zero_direction=4.0, product=5.0)
    assert fin_energy(command, UPPER, weights) == pytest.approx(0.5 + 3.0 + 1.0 + 2.5)


def test_a_robot_s_energy_is_the_sum_over_its_working_fins() -> None:
    one = np.array([0.25, 2.0, -np.pi / 2])
    command = np.stack([one, np.full(3, np.nan), one])
    assert command_energy(command, np.stack([UPPER] * 3)) == pytest.approx(2 * 1.775)
    assert command_energy(np.stack([command, command]), UPPER).shape == (2,)


def test_an_arc_below_zero_costs_no_negative_energy() -> None:
    upper = np.array([0.5, 2.0, -1.0])
    assert fin_energy(np.array([0.1, 0.2, -2.0]), upper) == pytest.approx(0.04 + 0.01 + 0.1 * 4 + 0.02)
    assert np.isfinite(fin_energy(np.array([0.1, 0.2, 0.0]), np.array([0.5, 2.0, 0.0])))
