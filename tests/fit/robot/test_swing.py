"""Forces that swing within the beat: no mean, and those of a rigid plate where the simulation has them."""

import numpy as np
import pytest

from finlab.fit.robot.swim import STEP_S
from finlab.fit.robot.swing import MOMENTS, TERMS, swing_forces
from finlab.layout import Layout, load_layout
from finlab.sim.actuator_force import ActuatorForce
from finlab.vehicle.fin_motion import FinMotion
from tests.ripple import RippleForce


@pytest.fixture(scope="module")
def pair() -> Layout:
    return load_layout("pair")


def test_fins_that_beat_steadily_have_no_mean(pair: Layout) -> None:
    command = np.tile([[0.5, 1.0, 0.7], [0.3, 2.0, -2.0]], (80, 1, 1))
    found = swing_forces(pair, command)
    assert found.shape == (80, 2, 2, TERMS)
    swings = found[40:]  # the servos have come to rest; four and eight whole beats
    largest = np.abs(swings).max(axis=(0, 2))
    assert (largest[0] > 0.05).all()
    assert (np.abs(swings.mean(axis=0)).max(axis=1) <= 0.01 * largest + 1e-9).all()


def test_a_plates_water_and_drag_are_those_of_the_simulation(pair: Layout) -> None:
    rng = np.random.default_rng(0)
    command = np.repeat(pair.lower + rng.random((12, 2, 3)) * (pair.upper - pair.lower), 5, axis=0)
    found = swing_forces(pair, command)
    fins = FinMotion(pair)
    ripple, mean = RippleForce(pair, fins), ActuatorForce(pair, fins)
    dt = STEP_S / MOMENTS
    for k, row in enumerate(command):
        true = np.zeros((2, 3))
        for _ in range(MOMENTS):
            fins.step(row, dt)
            pulses = mean.of_fins(dt) * (1.0 - np.cos(2.0 * fins.phase))[:, None]
            true += (ripple.of_fins(dt) - pulses) / MOMENTS
        np.testing.assert_allclose(found[k, :, :, 0] + found[k, :, :, 2], true[:, 1:], atol=1e-9)
