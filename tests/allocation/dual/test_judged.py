"""The default method on random robots of all kinds, against judges that were written apart from it."""

import numpy as np
import pytest

import finlab
from finlab.arrays import Array
from tests.least_power import conic_optimum, farthest, least_known, least_miss, lower_bound
from tests.mixed_robots import (
    KINDS,
    beyond,
    bluerov2_heavy,
    fins_with_a_tail,
    load,
    random_plant,
    random_robot,
    with_rates,
    within,
)
from tests.own_plant import OwnPlant

REACHED = 1e-3


def missing(plant: OwnPlant, commands: Array, wrench: Array) -> float:
    return float(np.linalg.norm((plant.wrench(commands) - wrench) / plant.scales))


def test_a_heavy_takes_the_watts_of_clarabel() -> None:
    plant, rng = OwnPlant(bluerov2_heavy()), np.random.default_rng(4)
    allocator = finlab.Allocator(load(plant.layout))
    for _ in range(10):
        wrench = within(plant, rng)
        commands = plant.commands_of(allocator.allocate(wrench))
        assert missing(plant, commands, wrench) <= 1e-6
        assert plant.excess(commands) == 0.0
        assert plant.power(commands) <= 1.00001 * conic_optimum(plant, wrench)[0]


def test_a_heavy_beyond_reach_keeps_the_direction_or_comes_nearest() -> None:
    plant, rng = OwnPlant(bluerov2_heavy()), np.random.default_rng(5)
    allocator = finlab.Allocator(load(plant.layout))
    for times in (1.2, 2.0, 3.0):
        wrench = beyond(plant, rng, times)
        along = plant.commands_of(allocator.allocate(wrench, policy="direction"))
        most = farthest(plant, wrench)
        assert missing(plant, along, most * wrench) <= 2e-3
        near = plant.commands_of(allocator.allocate(wrench))
        assert missing(plant, near, wrench) <= 1.0005 * least_miss(plant, wrench)


@pytest.mark.parametrize("number", [0, 1, pytest.param(2, marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("kind", KINDS)
def test_exact_within_limits_at_the_least_watts(kind: str, number: int) -> None:
    plant, rng = random_plant(kind, number, 7), np.random.default_rng(number)
    allocator = finlab.Allocator(load(plant.layout))
    most = plant.power(np.array([each.limits[1] for each in plant.actuators]))
    for _ in range(2):
        wrench = within(plant, rng)
        result = allocator.allocate(wrench, flow=plant.flow)
        commands = plant.commands_of(result)
        assert missing(plant, commands, wrench) <= REACHED
        assert plant.excess(commands) == 0.0
        watts = plant.power(commands)
        assert result.power == pytest.approx(watts, rel=1e-6)
        if kind == "rudders" or watts <= 1.001 * lower_bound(plant, wrench):
            continue
        best = least_known(plant, wrench, 4)
        assert best is None or watts <= 1.01 * best + 1e-4 * most


@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "fins", "mixed"])
def test_a_random_robot_beyond_reach_keeps_the_direction(kind: str) -> None:
    plant, rng = random_plant(kind, 3, 7), np.random.default_rng(0)
    allocator = finlab.Allocator(load(plant.layout))
    for times in (1.2, 3.0):
        wrench = beyond(plant, rng, times)
        commands = plant.commands_of(allocator.allocate(wrench, policy="direction"))
        assert missing(plant, commands, wrench / times) <= 2e-3


def test_fins_of_mixed_laws_have_no_dear_answers() -> None:
    for number in range(4):
        plant, rng = OwnPlant(fins_with_a_tail(number, 3)), np.random.default_rng(number)
        wrench = within(plant, rng)
        commands = plant.commands_of(finlab.Allocator(load(plant.layout)).allocate(wrench))
        assert missing(plant, commands, wrench) <= REACHED
        assert plant.power(commands) <= 1.01 * lower_bound(plant, wrench)


@pytest.mark.parametrize("period", [0.02, 0.2])
@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "fins", "mixed"])
def test_ticks_of_a_wandering_wrench(kind: str, period: float) -> None:
    """No limit and no rate is broken, and an answer that misses is the nearest, or the farthest in its
    direction, among those that may follow."""
    plant, rng = OwnPlant(with_rates(random_robot(kind, 1, 7))), np.random.default_rng(1)
    allocator = finlab.Allocator(load(plant.layout), period_s=period)
    first, last = within(plant, rng), within(plant, rng)
    before: Array | None = None
    for share in np.linspace(0.0, 1.0, 6):
        wrench = (1.0 - share) * first + share * last
        options = {} if before is None else {"previous": before}
        commands = plant.commands_of(allocator.allocate(wrench, **options))
        assert plant.excess(commands) == 0.0
        if before is not None:
            assert plant.rate_excess(before, commands, period) <= 1e-9
            error, near = missing(plant, commands, wrench), plant.after(before, period)
            if error > REACHED and error > least_miss(near, wrench, 33) + 2e-3:
                most = min(farthest(near, wrench, 33), 1.0)
                assert missing(plant, commands, most * wrench) <= 1e-2 * np.linalg.norm(wrench / plant.scales)
        before = commands
