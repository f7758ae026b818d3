"""The learned method with other energies: inertial power instead of the paper's proxy."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.physics.energy import DEFAULT_WEIGHTS, POWER_WEIGHTS, command_energy

TARGETS = ([4.0, 0, 0, 0, 0, 0], [3.0, 0, 1.0, 0, 0, 0.3], [1.0, 0.5, -0.5, 0.1, 0.1, 0.2])


@pytest.fixture(scope="module")
def layout() -> Layout:
    return load_layout(shipped_layouts()["A"])


@pytest.mark.parametrize("target", TARGETS)
def test_less_power_at_the_same_error(layout: Layout, target: list[float]) -> None:
    usual, sparing, analytic = (
        allocator.allocate(layout, target)
        for allocator in (
            load_allocator(),
            load_allocator(energy_weights=POWER_WEIGHTS),
            load_allocator("analytic"),
        )
    )
    upper = layout.upper
    power = [float(command_energy(each.command, upper, POWER_WEIGHTS)) for each in (usual, sparing, analytic)]
    assert sparing.reachable
    assert power[1] < 0.85 * min(power[0], power[2])


def test_power_is_amplitude_squared_times_frequency_cubed() -> None:
    upper = np.array([[0.6, 2.0, np.pi]])
    command = np.array([[0.3, 1.0, 2.0]])
    assert command_energy(command, upper, POWER_WEIGHTS) == pytest.approx(0.5**2 * 0.5**3)
    both = replace(DEFAULT_WEIGHTS, inertial=2.0)
    usual = command_energy(command, upper)
    assert command_energy(command, upper, both) == pytest.approx(usual + 2 * 0.5**5)
