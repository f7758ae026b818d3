"""The cost beside the squared error: slopes, the quadratic that stands for it, and what it is worth."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.command_cost import CommandCost, EffortCost, command_cost
from finlab.arrays import Array
from finlab.layout import FinModelSpec, Layout, random_layout
from finlab.physics import Plant, plant_of
from finlab.physics.energy import EnergyMeter, EnergyWeights, command_energy, energy_scale
from finlab.physics.objective import Objective, PowerMeter

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.3, 0.4])
AIMS = [
    Objective("effort", EnergyWeights(1.0, 2.0, 0.4, 0.7)),
    Objective("effort", EnergyWeights(1.0, 2.0, 0.4, 0.7, 3.0)),
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
    slopes = cost.slopes(at)
    for i, k in np.ndindex(3, 3):
        offset = np.zeros((3, 3))
        offset[i, k] = 1e-6
        rise = (cost(at + offset) - cost(at - offset)) / 2e-6
        np.testing.assert_allclose(slopes[:, i, k], rise, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("aim", AIMS)
def test_the_bowl_touches_the_cost_and_is_convex(mixed: Plant, aim: Objective) -> None:
    cost, at = command_cost(mixed, aim, SIGMA, 0.7), mixed.sample(np.random.default_rng(0), (50,))
    bowl = cost.bowl(at)
    np.testing.assert_allclose(2 * bowl.slope, cost.slopes(at))
    assert (bowl.diagonal >= 0.0).all()
    product = bowl.diagonal[..., 0] * bowl.diagonal[..., 1]
    assert (bowl.mixed**2 <= product * (1 + 1e-9)).all()


def test_the_bowl_of_a_quadratic_effort_is_the_effort() -> None:
    plant = robot(*[FinModelSpec("drag")] * 3)
    cost = command_cost(plant, AIMS[0], SIGMA, 0.7)
    one, other = plant.sample(np.random.default_rng(0), (2, 5))
    bowl, move = cost.bowl(one), other - one
    rise = 2 * (bowl.slope * move).sum((1, 2)) + (bowl.diagonal * move * move).sum((1, 2))
    rise += 2 * (bowl.mixed * move[..., 0] * move[..., 1]).sum(1)
    np.testing.assert_allclose(cost(one) + rise, cost(other))


def test_along_a_stroke_the_bowl_of_power_bends_as_a_fifth_power() -> None:
    """All power is inertial where a fin has next to no drag: then P = c A^2 f^3."""
    plant = robot(FinModelSpec("lighthill", (("length", 0.01), ("width", 0.5))), limits="nominal")
    cost, at = command_cost(plant, Objective(), SIGMA, 1.0), np.array([[[0.3, 1.2, 0.0]]])
    bowl, (a, f) = cost.bowl(at), at[0, 0, :2]
    bend = bowl.diagonal[0, 0, 0] * a * a + bowl.diagonal[0, 0, 1] * f * f + 2 * bowl.mixed[0, 0] * a * f
    assert 2 * bend == pytest.approx(5 * 4 * cost(at)[0], rel=0.02)


def test_effort_counts_as_it_is() -> None:
    plant = robot(*[FinModelSpec("drag")] * 3)
    at = plant.sample(np.random.default_rng(0), (4,))
    cost = command_cost(plant, Objective("effort"), SIGMA, 1e-4)
    np.testing.assert_allclose(cost(at), 1e-4 * command_energy(at, plant.upper))
    np.testing.assert_allclose(
        EffortCost(EnergyMeter(plant.upper), 0.5)(at), 0.5 * command_energy(at, plant.upper)
    )


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
    slopes = np.empty(at.shape)
    for i, k in np.ndindex(at.shape[1:]):
        offset = np.zeros(at.shape[1:])
        offset[i, k] = 1e-6
        slopes[:, i, k] = (cost(at + offset) - cost(at - offset)) / 2e-6
    return slopes


def test_the_bowl_of_the_inertial_effort_bends_as_a_fifth_power() -> None:
    """Of s^5, half the second derivative is 10 s^3: 0.4 times the squared slope over the value."""
    plant = robot(*[FinModelSpec("drag")] * 3)
    at, scale = plant.sample(np.random.default_rng(1), (6,)), energy_scale(plant.upper)
    plain, whole = (EffortCost(EnergyMeter(plant.upper, aim.weights), 0.7) for aim in AIMS[:2])
    a, f = at[..., 0] / scale[:, 0], at[..., 1] / scale[:, 1]
    inertial = 0.7 * 3.0 * a**2 * f**3
    np.testing.assert_allclose(whole(at) - plain(at), inertial.sum(-1))
    slopes = differences(whole, at) - differences(plain, at)
    expected = 0.4 * slopes**2 / inertial[..., None]
    found, base = whole.bowl(at), plain.bowl(at)
    np.testing.assert_allclose(found.diagonal - base.diagonal, expected, rtol=1e-5, atol=1e-7)
    expected = 0.4 * slopes[..., 0] * slopes[..., 1] / inertial
    np.testing.assert_allclose(found.mixed - base.mixed, expected, rtol=1e-5)


@pytest.mark.parametrize("copper_loss", [0.0, 0.3])
def test_the_bowl_of_power_is_each_fins_own(mixed: Plant, copper_loss: float) -> None:
    cost = command_cost(mixed, Objective(copper_loss=copper_loss), SIGMA, 0.7)
    at = mixed.sample(np.random.default_rng(2), (6,))
    slopes, bowl = differences(cost, at), cost.bowl(at)
    meter = Objective(copper_loss=copper_loss).meter(mixed)
    assert isinstance(meter, PowerMeter)
    power = cost.weight * meter.fins(at)
    np.testing.assert_allclose(power.sum(-1), cost(at))
    np.testing.assert_allclose(bowl.slope, 0.5 * slopes, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(bowl.diagonal, 0.4 * slopes**2 / power[..., None], rtol=1e-5, atol=1e-8)
    expected = 0.4 * slopes[..., 0] * slopes[..., 1] / power
    np.testing.assert_allclose(bowl.mixed, expected, rtol=1e-5, atol=1e-8)


def test_a_fin_that_takes_no_power_has_a_flat_bowl() -> None:
    plant = robot(FinModelSpec("drag"), limits="nominal")
    bowl = command_cost(plant, Objective(), SIGMA, 0.7).bowl(np.array([[[0.0, 0.0, 0.3]]]))
    assert all((values == 0.0).all() for values in bowl)


def test_fins_that_take_milliwatts_count_by_their_own_full_load() -> None:
    plant = robot(*[FinModelSpec("lighthill", (("length", 0.03),))] * 3, limits="nominal")
    assert plant.power(plant.upper[None]).max() < 1.0
    full = command_cost(plant, Objective(), 1e-6 * SIGMA, 1e-4)(plant.upper[None])
    np.testing.assert_allclose(full, 1e-4 * 10 * 3)
