"""The cost beside the squared error: slopes, the quadratic that stands for it, and what it is worth."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.arrays import Array
from finlab.layout import FinModelSpec, Layout, random_layout
from finlab.physics import Plant, plant_of
from finlab.physics.effort import EffortWeights, command_effort
from finlab.physics.objective import Objective

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.3, 0.4])
AIMS = [
    Objective("effort", EffortWeights(1.0, 2.0, 0.4, 0.7)),
    Objective("power"),
    Objective("power", copper_loss=0.3),
]


def robot(*models: FinModelSpec, limits: str = "varied") -> Plant:
    layout = random_layout(np.random.default_rng(3), n_fins=len(models), limits=limits)  # type: ignore[arg-type]
    fins = (replace(fin, model=model) for fin, model in zip(layout.fins, models, strict=True))
    return plant_of(Layout("robot", tuple(fins)))


@pytest.fixture
def mixed() -> Plant:
    return robot(FinModelSpec("drag"), FinModelSpec("lighthill"), FinModelSpec("soft", (("e", 0.2),)))


@pytest.mark.parametrize("aim", AIMS)
def test_slopes_agree_with_differences(mixed: Plant, aim: Objective) -> None:
    cost, at = command_cost(mixed, aim, SIGMA, 0.7), mixed.sample(np.random.default_rng(0), (5,))
    gradient = cost.gradient(at)
    for i, k in np.ndindex(3, 3):
        offset = np.zeros((3, 3))
        offset[i, k] = 1e-6
        rise = (cost(at + offset) - cost(at - offset)) / 2e-6
        np.testing.assert_allclose(gradient[:, i, k], rise, rtol=1e-6, atol=1e-8)


def test_effort_counts_as_it_is() -> None:
    plant = robot(*[FinModelSpec("drag")] * 3)
    at = plant.sample(np.random.default_rng(0), (4,))
    cost = command_cost(plant, Objective("effort"), SIGMA, 1e-4)
    np.testing.assert_allclose(cost(at), 1e-4 * command_effort(at, plant.upper))


@pytest.mark.parametrize("copper_loss", [0.0, 0.3])
def test_strong_fins_at_full_load_count_as_much_as_weak_ones(copper_loss: float) -> None:
    """A fin of five times the length takes thousands of times the power; its full load is ten usual ones."""
    aim = Objective(copper_loss=copper_loss)
    for length in (0.2, 1.0):
        plant = robot(*[FinModelSpec("lighthill", (("length", length),))] * 3, limits="nominal")
        full = command_cost(plant, aim, SIGMA, 1e-4)(plant.upper[None])
        np.testing.assert_allclose(full, 1e-4 * 10 * 3)


def test_for_a_robot_that_is_weak_beside_the_yardstick_cost_counts_less() -> None:
    plant = robot(*[FinModelSpec("drag")] * 3)
    usual, weak = (
        command_cost(plant, Objective("effort"), sigma, 1e-4).weight for sigma in (SIGMA, 1e3 * SIGMA)
    )
    assert usual == 1e-4 and 0.0 < weak < 1e-7
    error = plant.wrench(plant.upper) / (1e3 * SIGMA)
    assert weak < (error @ error) * 1e-2


def differences(cost: CommandCost, at: Array) -> Array:
    """Derivatives (B, n, 3) of what commands (B, n, 3) cost, by central differences."""
    gradient = np.empty(at.shape)
    for i, k in np.ndindex(at.shape[1:]):
        offset = np.zeros(at.shape[1:])
        offset[i, k] = 1e-6
        gradient[:, i, k] = (cost(at + offset) - cost(at - offset)) / 2e-6
    return gradient
