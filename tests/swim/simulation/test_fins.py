"""Forces of moving fins: the mean, and within the cycle."""

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.physics import Plant
from finlab.swim.simulation.devices import ActuatorForce
from finlab.swim.vehicle.fin_motion import FinMotion
from tests.ripple_force import RippleForce

STEP_S = 0.01
"""A step of the simulation [s]."""


@pytest.fixture(scope="module")
def pair() -> Layout:
    """Two fins."""
    return load_layout(shipped_layouts()["pair"])


def flapping(layout: Layout, amplitude: float, frequency: float, direction: float) -> FinMotion:
    """Fins that have followed a command for long."""
    motion = FinMotion(layout)
    motion.value[0] = amplitude
    motion.value[1] = frequency
    motion.value[2] = direction
    return motion


def cycle_mean(
    force: ActuatorForce, motion: FinMotion, cycles: int = 10, skip: int = 5
) -> np.ndarray:
    """Mean force (3,) of the first fin over whole cycles."""
    command = motion.command.copy()
    per_cycle = round(1.0 / (command[0, 1] * STEP_S))
    forces = []
    for _ in range((cycles + skip) * per_cycle):
        steps = motion.steps(command, STEP_S, 1)
        forces.append(force.of_fins(steps, STEP_S)[0, 0])
    return np.mean(forces[skip * per_cycle :], axis=0)


def test_a_fin_that_hangs_still_gives_nothing(pair: Layout) -> None:
    motion = flapping(pair, 0.4, 1.5, 0.8)
    command = motion.command.copy()
    command[0] = np.nan
    steps = motion.steps(command, STEP_S, 3)
    assert (ActuatorForce(pair, motion).of_fins(steps, STEP_S)[:, 0] == 0.0).all()


@pytest.mark.parametrize("name", ["A", "mixed"])
def test_steady_fins_give_the_plants_force(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    motion = FinMotion(layout)
    command = np.tile([0.4, 1.3, 0.7], (layout.n_fins, 1))
    steps = motion.steps(command, STEP_S, 400)
    force = ActuatorForce(layout, motion).of_fins(steps, STEP_S)[-1]
    wanted = np.linalg.norm(Plant(layout).body_forces(command), axis=1)
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), wanted, rtol=1e-6)


@pytest.mark.parametrize("direction", [0.0, 1.1])
def test_ripple_has_the_mean_of_the_fin_law(pair: Layout, direction: float) -> None:
    still, motion = (flapping(pair, 0.45, 2.0, direction) for _ in range(2))
    steps = still.steps(still.command, STEP_S, 1)
    mean = ActuatorForce(pair, still).of_fins(steps, STEP_S)[0, 0]
    ripple = cycle_mean(RippleForce(pair, motion), motion)
    np.testing.assert_allclose(ripple, mean, atol=0.01 * np.linalg.norm(mean))
