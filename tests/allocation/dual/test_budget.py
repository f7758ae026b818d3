"""Power budgets: what is given within them, beside cone programs and SLSQP, which share no line with
the library."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from finlab.actuators.thrust_model import PowerTable
from finlab.actuators.thruster import Thruster
from finlab.allocation import Allocation, Allocator, Policy
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.layout import load_layout
from finlab.physics import plant_of
from tests.oracle_budget import BudgetedPlant, least_miss_by_slsqp
from tests.oracle_plant import OraclePlant
from tests.random_robots import beyond, load, random_plant, within
from tests.t200 import t200_rows

WATTS = 1e-6
"""Share by which a power may be off."""
MISS = 1e-5
"""By how much an error or a share may be off."""
ROBOTS = 9
"""Random robots of each kind."""


def is_convex(plant: OraclePlant) -> bool:
    """Whether the forces of all pods are convex sets."""
    for actuator in plant.actuators:
        low, high = actuator.limits
        if actuator.kind == "azimuth" and not actuator.turns_fully and high[0] - low[0] > np.pi:
            return False
    return True


def asked(kind: str, number: int) -> tuple[OraclePlant, Allocator, Array, float]:
    """A robot with the judge's model of it on the same scale, a wrench, and a budget that is
    mostly too small for it."""
    plant = random_plant(kind, number, 3)
    allocator = Allocator(load(plant.layout))
    plant.__dict__["scales"] = allocator.scale
    rng = np.random.default_rng([5, number])
    wrench = beyond(plant, rng, 1.5) if number % 3 == 0 else within(plant, rng)
    watts = allocator.allocate(wrench).power * float(rng.uniform(0.2, 1.2))
    return plant, allocator, wrench, watts


def cones(plant: OraclePlant, watts: float) -> BudgetedPlant:
    """The judge of one bus for all."""
    return BudgetedPlant(plant, np.ones((1, len(plant.actuators)), bool), np.array([watts]))


def miss_of(answer: Allocation) -> float:
    """What is missing, over the wrench scale."""
    return float(np.linalg.norm(answer.unallocated / answer.scale))


@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
@pytest.mark.parametrize("number", range(ROBOTS))
def test_thrusters_and_pods_beside_clarabel(kind: str, number: int) -> None:
    plant, allocator, wrench, watts = asked(kind, number)
    if not is_convex(plant):
        pytest.skip("an arc wider than half a turn is no convex set")
    answer = allocator.allocate(wrench, power=watts)
    assert answer.power <= watts * (1.0 + WATTS)
    if answer.reachable:
        least = cones(plant, watts).least_power(wrench)
        assert answer.power == pytest.approx(least, rel=MISS)
    assert miss_of(answer) == pytest.approx(cones(plant, watts).least_miss(wrench), abs=MISS)

    answer = allocator.allocate(wrench, power=watts, policy="direction")
    assert answer.power <= watts * (1.0 + WATTS)
    assert answer.share == pytest.approx(cones(plant, watts).largest_share(wrench), abs=MISS)
    across = (answer.wrench - answer.share * wrench) / answer.scale
    assert float(np.linalg.norm(across)) <= MISS

    answer = allocator.allocate(wrench, power=watts, policy="priority")
    assert answer.power <= watts * (1.0 + WATTS)
    missing = np.abs(answer.unallocated / answer.scale)
    first = cones(plant, watts).least_miss(wrench, [2])
    assert missing[2] == pytest.approx(first, abs=MISS)
    if first <= MISS:
        then = cones(plant, watts)
        then.hold(wrench, [2], float(missing[2]) + 1e-9)
        turning = float(np.linalg.norm(missing[3:]))
        assert turning == pytest.approx(then.least_miss(wrench, [3, 4, 5]), abs=10 * MISS)


@pytest.mark.parametrize("number", range(2))
def test_fins_beside_slsqp(number: int) -> None:
    plant, allocator, wrench, watts = asked("fins any shaft", number)
    answer = allocator.allocate(wrench, power=watts)
    assert answer.power <= watts * (1.0 + WATTS)
    known = least_miss_by_slsqp(plant, wrench, watts)
    assert miss_of(answer) <= known + MISS
    assert known <= miss_of(answer) + 1e-3  # or else SLSQP has found nothing near it


def _most_surge(allocator: Allocator, watts: float) -> float:
    """The most surge [N] of two thrusters astern and two ahead, all at 45 degrees, by trying all
    forces of the front ones."""
    plant = plant_of(allocator.layout)
    command = np.zeros((allocator.layout.n, 3))

    def power(astern: float, ahead: float) -> float:
        command[:4, 0] = -astern, -astern, ahead, ahead
        return float(plant.power(command).sum())

    most = 0.0
    for astern in np.linspace(7.0, 10.0, 601):
        ahead = float(brentq(lambda force, a=astern: power(a, force) - watts, 1.0, 30.0))
        most = max(most, 2.0 * np.sqrt(0.5) * (astern + ahead))
    return most


def test_as_much_surge_as_a_battery_gives() -> None:
    layout = load_layout("bluerov2")
    model = PowerTable(t200_rows(12))
    actuators = tuple(
        replace(each, force=(-28.48, 36.42), model=model)
        for each in layout.actuators
        if isinstance(each, Thruster)
    )
    allocator = Allocator(replace(layout, actuators=actuators))
    answer = allocator.allocate([150, 0, 0, 0, 0, 0], power=12 * 18, policy="direction")
    assert answer.power == pytest.approx(216.0, rel=WATTS)
    # 39.63 N by all rows of the maker's table, of which these are every tenth
    assert answer.wrench[0] == pytest.approx(39.63, rel=0.005)
    assert answer.wrench[0] == pytest.approx(_most_surge(allocator, 216.0), rel=WATTS)
    assert answer.binding == ("power",)
    assert not answer.reachable


def test_a_budget_that_is_large_enough_changes_nothing() -> None:
    allocator = Allocator(load_layout("bluerov2"))
    for policy in ("closest", "direction", "priority"):
        for wrench in ([30, 10, 0, 0, 0, 2], [1000, 0, 0, 0, 0, 0]):
            free = allocator.allocate(wrench, policy=policy)
            budgeted = allocator.allocate(wrench, policy=policy, power=1e5)
            np.testing.assert_array_equal(free.command, budgeted.command)
            assert "power" not in budgeted.binding


def test_batches_losses_and_free_axes_are_those_of_single_answers() -> None:
    allocator = Allocator(load_layout("bluerov2"))
    wrenches = np.array([[150, 20, 10, 0, 0, 5], [20, 0, 0, 0, 0, 0], [0, 90, 60, 0, 0, 0.0]])
    question = {"lost": ("rear_left",), "free": ("Tx",), "policy": "direction", "power": 120.0}
    batch = allocator.allocate_batch(wrenches, **question)
    for wrench, command in zip(wrenches, batch.command, strict=True):
        single = allocator.allocate(wrench, **question)
        np.testing.assert_allclose(command, single.command, atol=1e-9)
        assert single.power <= 120.0 * (1.0 + WATTS)
    assert (batch.power <= 120.0 * (1.0 + WATTS)).all()


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_ticks_keep_rates_and_the_budget(policy: str) -> None:
    allocator = Allocator(load_layout("catamaran"))
    layout = allocator.layout
    previous = np.clip(0.0, layout.lower, layout.upper)
    step = layout.rates * allocator.settings.period_s
    for tick in range(12):
        wrench = np.array([60.0 + 40.0 * np.sin(tick), 40.0 * np.cos(tick), 0, 0, 0, 20.0])
        answer = allocator.allocate(wrench, previous=previous, policy=policy, power=60.0)
        change = np.abs(answer.command - previous)
        change = np.where(np.isclose(change, 2 * np.pi, atol=1.0), 0.0, change)
        assert (change <= step * (1.0 + 1e-6) + 1e-9).all()
        assert answer.power <= 60.0 * (1.0 + WATTS)
        previous = answer.command


def test_what_no_budget_is_kept_for() -> None:
    allocator = Allocator(load_layout("bluerov2"))
    wrench = [20.0, 0, 0, 0, 0, 0]
    for power in (0.0, -1.0, float("nan"), True, "200", 1e13):
        with pytest.raises(AllocationError, match="power: expected watts above 0"):
            allocator.allocate(wrench, power=power)  # type: ignore[arg-type]
    with pytest.raises(AllocationError, match="no budget is kept yet for policy 'falling'"):
        allocator.allocate(wrench, power=100.0, policy=Policy("falling"))
    with pytest.raises(AllocationError, match="with the setting robust"):
        allocator.with_settings(robust=10.0).allocate(wrench, power=100.0)
    with pytest.raises(AllocationError, match="robots with rudders"):
        Allocator(load_layout("torpedo")).allocate(wrench, power=100.0)
    with pytest.raises(AllocationError, match="method 'px4' keeps no budget"):
        Allocator(load_layout("bluerov2"), "px4").allocate(wrench, power=100.0)
