"""Answers where jets meet: exact by the plant, as cheap as many starts find, within what policies
promise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize

import finlab
from finlab import Allocator, Azimuth, Layout, PowerLaw
from finlab.arrays import Array
from finlab.interaction.jets import Jets
from finlab.physics import Plant
from finlab.research.random_layouts import (
    random_azimuth,
    random_jet_robot,
    random_shaft_fin,
    random_thruster,
)

KINDS = {
    "thrusters": [random_thruster],
    "azimuths": [random_azimuth],
    "fins": [random_shaft_fin],
    "all": None,
}
"""Kind of robot -> makers of its actuators; None makes any."""


def robot(seed: int, kinds: list | None) -> tuple[Allocator, Array]:
    """A random robot with jets, and three wrenches within its reach."""
    rng = np.random.default_rng([41, seed])
    layout = replace(random_jet_robot(rng, "robot", (4, 8), kinds), interaction=Jets())
    plant = Plant(layout)
    return Allocator(layout), plant.wrench(plant.sample(rng, (3,)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_answers_are_exact_by_the_plant(kind: str, seed: int) -> None:
    allocator, targets = robot(seed, KINDS[kind])
    plant = Plant(allocator.layout)
    for target in targets:
        result = allocator.allocate(target)
        missed = (plant.wrench(result.command) - target) / allocator.scale
        assert np.linalg.norm(missed) <= 1e-6
        assert result.bound is None or result.bound <= result.power
        lower = allocator.layout.lower
        upper = allocator.layout.upper
        assert ((result.command >= lower) & (result.command <= upper)).all()


def pods(places: list[tuple[float, float]]) -> Layout:
    """Pods with jets at places x, y [m]."""
    parts = [
        Azimuth(
            f"p{i}",
            (x, y, 0.0),
            (0.0, 0.0, 1.0),
            (1.0, 0.0, 0.0),
            (0.0, 50.0),
            PowerLaw(1.0),
            diameter=0.1,
        )
        for i, (x, y) in enumerate(places)
    ]
    return Layout("pods", tuple(parts), axes=("Fx", "Fy", "Tz"), interaction=Jets())


def least_of_starts(layout: Layout, target: Array, count: int = 16) -> float:
    """Least power that sequential quadratic programming of scipy finds from many starts."""
    plant = Plant(layout)
    best = np.inf
    lower = layout.lower[:, :2].ravel()
    upper = layout.upper[:, :2].ravel()

    def full(x: Array) -> Array:
        return np.pad(x.reshape(layout.n, 2), ((0, 0), (0, 1)))

    def missed(x: Array) -> Array:
        return (plant.wrench(full(x)) - target)[[0, 1, 5]]

    for start in np.random.default_rng(0).uniform(lower, upper, (count, len(lower))):
        found = minimize(
            lambda x: plant.power(full(x)).sum(),
            start,
            method="SLSQP",
            bounds=list(zip(lower, upper, strict=True)),
            constraints={"type": "eq", "fun": missed},
            options={"maxiter": 200},
        )
        if np.abs(missed(found.x)).max() < 1e-4:
            best = min(best, float(found.fun))
    return best


@pytest.mark.parametrize("surge", [40.0, 60.0])
@pytest.mark.parametrize(
    "places", [[(0.5, 0), (0, 0), (-0.5, 0)], [(0.4, 0.2), (0.4, -0.2), (-0.4, 0.2), (-0.4, -0.2)]]
)
def test_jets_in_line_are_turned_aside(places: list[tuple[float, float]], surge: float) -> None:
    layout = pods(places)
    target = np.array([surge, 0, 0, 0, 0, 0])
    result = Allocator(layout).allocate(target)
    assert result.reachable
    assert result.power <= 1.02 * least_of_starts(layout, target)


@pytest.fixture(scope="module")
def heavy() -> Allocator:
    """Eight thrusters with jets, whose effect is uncertain."""
    return Allocator(replace(finlab.load_layout("bluerov2_heavy"), interaction=Jets(uncertain=0.1)))


WRENCH_OUT_OF_REACH = [400.0, 0.0, 100.0, 0.0, 0.0, 5.0]
"""A wrench that these thrusters cannot give [N, N m]."""


def test_direction_stays_on_the_ray(heavy: Allocator) -> None:
    result = heavy.allocate(WRENCH_OUT_OF_REACH, policy="direction")
    along = WRENCH_OUT_OF_REACH / heavy.scale
    wrench = result.wrench / heavy.scale
    share = float(along @ wrench / (along @ along))
    assert 0.15 < share < 1.0
    assert np.linalg.norm(wrench - share * along) <= 2e-6


def test_priority_serves_its_first_group(heavy: Allocator) -> None:
    result = heavy.allocate(WRENCH_OUT_OF_REACH, policy="priority")
    assert_allclose(result.wrench[2:], WRENCH_OUT_OF_REACH[2:], atol=1e-3)


def test_closest_misses_no_more_than_the_others(heavy: Allocator) -> None:
    closest = heavy.allocate(WRENCH_OUT_OF_REACH).err_norm
    for policy in ("direction", "priority"):
        assert closest <= heavy.allocate(WRENCH_OUT_OF_REACH, policy=policy).err_norm + 1e-6


def test_ticks_stay_within_rates_and_arrive(heavy: Allocator) -> None:
    layout = heavy.layout
    rates = layout.rates * heavy.settings.period_s
    result = heavy.allocate([0.0] * 6)
    for _ in range(15):
        before = result
        result = heavy.allocate([60, 0, 20, 0, 0, 1], previous=result)
        assert (np.abs(result.command - before.command) <= rates + 1e-9).all()
    assert result.err_norm <= 1e-6


def test_one_and_many_give_the_same(heavy: Allocator) -> None:
    targets = np.array([[40.0, 0, 20, 0, 0, 1], [0, 30, 0, 0, 0, 0], WRENCH_OUT_OF_REACH])
    batch = heavy.allocate_batch(targets)
    for k, target in enumerate(targets):
        assert_allclose(batch.command[k], heavy.allocate(target).command, atol=1e-9)


def test_what_is_lost_takes_nothing(heavy: Allocator) -> None:
    lost = heavy.layout.names[0]
    result = heavy.allocate([20, 0, 10, 0, 0, 0.5], lost=[lost])
    assert result.reachable and np.isnan(result.command[0]).all()


def test_answers_say_what_is_not_known(heavy: Allocator) -> None:
    result = heavy.allocate([40, 0, 20, 0, 0, 1], flow=[1.0, 0, 0, 0, 0, 0])
    assert any("open_water" in note for note in result.notes)
    assert result.expected_miss.max() > 0.1
    assert any("laws" in note and "jets" in note for note in result.notes)
