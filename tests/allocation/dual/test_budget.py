"""Power budgets: what is given within them, beside cone programs, which share no line with the
library."""

import os
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from finlab.actuators.thrust_model import PowerTable
from finlab.actuators.thruster import Thruster
from finlab.allocation import Allocation, Allocator, Policy
from finlab.allocation.policy import PolicyName
from finlab.arrays import EXACT, Array
from finlab.errors import AllocationError
from finlab.layout import load_layout
from finlab.layout.layout import Bus, Layout
from finlab.physics import plant_of
from tests.oracle_budget import BudgetedPlant
from tests.oracle_fin_budget import BudgetedFins, FinCost
from tests.oracle_plant import OraclePlant
from tests.random_robots import beyond, load, random_plant, within
from tests.t200 import t200_rows

WATTS = 1e-6
"""Share by which a power may be off."""
MISS = 1e-5
"""By how much an error or a share may be off."""
MANY = int(os.environ.get("FINLAB_BUDGET_TARGETS", "0"))
"""Targets of each kind beside the judges, where there is time."""
END_MISS = 3e-3
"""The same where a fin is near to its least thrust: the judge lets it rest, which it cannot."""
ROBOTS = 9
"""Random robots of each kind."""
POLICIES: tuple[PolicyName, ...] = ("closest", "direction", "priority")
"""Of the answers that are checked."""


def is_convex(plant: OraclePlant) -> bool:
    """Whether the forces of all pods are convex sets."""
    for actuator in plant.actuators:
        low, high = actuator.limits
        if actuator.kind == "azimuth" and not actuator.turns_fully and high[0] - low[0] > np.pi:
            return False
    return True


class Question(NamedTuple):
    """A robot with the judge's model of it on the same scale, a wrench, and budgets that are mostly
    too small for it."""

    plant: OraclePlant
    allocator: Allocator
    """Of a layout with the budgets."""
    wrench: Array
    members: Array
    """Which actuators (b, n) each bus feeds."""
    watts: Array
    """Of the buses (b,) [W]."""

    def cones(self) -> BudgetedPlant:
        """The judge of thrusters and pods."""
        return BudgetedPlant(self.plant, self.members, self.watts)

    def check_power(self, answer: Allocation) -> None:
        """Each bus takes what it has at most."""
        power = self.plant.powers(answer.command)
        assert (self.members @ power <= self.watts * (1.0 + WATTS)).all()


def asked(kind: str, number: int, buses: int = 1) -> Question:
    """One bus feeds all actuators; of several each feeds some, and a few have none."""
    plant = random_plant(kind, number, 3)
    layout = load(plant.layout)
    allocator = Allocator(layout)
    plant.__dict__["scales"] = allocator.scale
    rng = np.random.default_rng([5, number])
    wrench = beyond(plant, rng, 1.5) if number % 3 == 0 else within(plant, rng)
    share = float(rng.uniform(0.2, 1.2))
    powers = plant.powers(allocator.allocate(wrench).command)
    if buses == 1:
        members = np.ones((1, layout.n), bool)
        watts = share * powers.sum(keepdims=True)
        return Question(
            plant, Allocator(replace(layout, power_w=float(watts[0]))), wrench, members, watts
        )
    bus_of = rng.integers(0, buses + (number % 2), layout.n)
    members = np.array([bus_of == bus for bus in range(buses)])
    members = members[members.any(axis=1)]
    watts = members @ powers * rng.uniform(0.2, 1.2, len(members)) + 0.05 * powers.mean()
    fed = []
    for row, most in zip(members, watts, strict=True):
        names = tuple(name for name, is_fed in zip(layout.names, row, strict=True) if is_fed)
        fed.append(Bus(f"bus {len(fed)}", float(most), names))
    return Question(plant, Allocator(replace(layout, buses=tuple(fed))), wrench, members, watts)


def miss_of(answer: Allocation) -> float:
    """What is missing, over the wrench scale."""
    return float(np.linalg.norm(answer.unallocated / answer.scale))


def check_beside_clarabel(question: Question) -> None:
    """Checks the answers by three policies."""
    allocator, wrench = question.allocator, question.wrench
    answer = allocator.allocate(wrench)
    question.check_power(answer)
    if miss_of(answer) <= EXACT:  # `reachable` is one that misses a thousandth, too
        least = question.cones().least_power(wrench)
        assert answer.power == pytest.approx(least, rel=WATTS)
    assert miss_of(answer) == pytest.approx(question.cones().least_miss(wrench), abs=MISS)

    answer = allocator.allocate(wrench, policy="direction")
    question.check_power(answer)
    assert answer.share == pytest.approx(question.cones().largest_share(wrench), abs=MISS)
    across = (answer.wrench - answer.share * wrench) / answer.scale
    assert float(np.linalg.norm(across)) <= MISS

    answer = allocator.allocate(wrench, policy="priority")
    question.check_power(answer)
    missing = np.abs(answer.unallocated / answer.scale)
    first = question.cones().least_miss(wrench, [2])
    assert missing[2] == pytest.approx(first, abs=MISS)
    if first <= MISS:
        then = question.cones()
        then.hold(wrench, [2], float(missing[2]) + 1e-9)
        turning = float(np.linalg.norm(missing[3:]))
        assert turning == pytest.approx(then.least_miss(wrench, [3, 4, 5]), abs=10 * MISS)


@pytest.mark.parametrize("buses", [1, 3])
@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
@pytest.mark.parametrize("number", range(ROBOTS))
def test_thrusters_and_pods_beside_clarabel(kind: str, number: int, buses: int) -> None:
    question = asked(kind, number, buses)
    if not is_convex(question.plant):
        pytest.skip("an arc wider than half a turn is no convex set")
    check_beside_clarabel(question)


@pytest.mark.skipif(not MANY, reason="FINLAB_BUDGET_TARGETS says how many targets; takes minutes")
@pytest.mark.parametrize("buses", [1, 3])
@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
def test_many_thrusters_and_pods_beside_clarabel(kind: str, buses: int) -> None:
    wrong = []
    asked_count = 0
    number = 0
    while asked_count < MANY:
        number += 1
        question = asked(kind, 100 + number, buses)
        if not is_convex(question.plant):
            continue
        asked_count += 1
        try:
            check_beside_clarabel(question)
        except AssertionError as error:
            wrong.append(f"{100 + number}: {str(error)[:200]}")
        except ValueError as error:  # the judge has no answer
            wrong.append(f"{100 + number}: {error}")
    assert not wrong, "\n".join(wrong)


def check_beside_hulls(question: Question) -> None:
    """Checks answers of fins, which no command can be better than on the hulls of their forces; and
    where none of them is near to its least thrust, as good."""
    allocator, wrench = question.allocator, question.wrench
    fins = BudgetedFins(question.plant, question.members, question.watts)
    answer = allocator.allocate(wrench)
    question.check_power(answer)
    worse = miss_of(answer) - fins.least_miss(wrench)
    assert -MISS <= worse <= (MISS if fins.are_beyond_least(answer.command) else END_MISS)
    if miss_of(answer) <= EXACT and fins.are_beyond_least(answer.command):
        assert answer.power == pytest.approx(fins.least_power(wrench), rel=WATTS)

    answer = allocator.allocate(wrench, policy="direction")
    question.check_power(answer)
    worse = fins.largest_share(wrench) - answer.share
    assert -MISS <= worse <= (MISS if fins.are_beyond_least(answer.command) else END_MISS)

    answer = allocator.allocate(wrench, policy="priority")
    question.check_power(answer)
    missing = np.abs(answer.unallocated / answer.scale)
    first = fins.least_miss(wrench, [2])
    worse = missing[2] - first
    assert -MISS <= worse <= (MISS if fins.are_beyond_least(answer.command) else END_MISS)


FINS = ("fins", "fins any shaft", "fins uneven")
"""Kinds of robots of fins whose arcs are half a turn at most."""


@pytest.mark.parametrize("buses", [1, 3])
@pytest.mark.parametrize("number", range(6))
def test_fins_beside_their_hulls(number: int, buses: int) -> None:
    check_beside_hulls(asked(FINS[number % 3], number, buses))


@pytest.mark.skipif(not MANY, reason="FINLAB_BUDGET_TARGETS says how many targets; takes minutes")
@pytest.mark.parametrize("buses", [1, 3])
def test_many_fins_beside_their_hulls(buses: int) -> None:
    wrong = []
    for number in range(100, 100 + MANY):
        try:
            check_beside_hulls(asked(FINS[number % 3], number, buses))
        except (AssertionError, ValueError) as error:  # or the judge has no answer
            wrong.append(f"{number}: {str(error)[:200]}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("fins any shaft", 111),  # once 19 % above a budget
        ("fins uneven", 105),
        ("fins uneven", 116),  # least forces take a good part of its budgets
        ("wide arcs", 110),  # once 60 % above
        ("wide arcs", 135),
        ("holes", 104),  # fins that cannot rest
    ],
)
def test_gaps_of_sets_leave_budgets_kept(kind: str, number: int) -> None:
    question = asked(kind, number, 3)
    for policy in POLICIES:
        answer = question.allocator.allocate(question.wrench, policy=policy)
        question.check_power(answer)


def test_fins_that_cannot_rest_take_as_little_as_they_can() -> None:
    question = asked("holes", 116)  # its budget is less than the least that its fins take
    least = sum(cost(cost.least) for cost in map(FinCost, question.plant.actuators))
    assert least > question.watts[0]
    for policy in POLICIES:
        answer = question.allocator.allocate(question.wrench, policy=policy)
        assert answer.power == pytest.approx(least, rel=0.05)
        assert any("no command within it was found" in note for note in answer.notes)


@pytest.mark.parametrize("policy", ["closest", "direction"])
def test_measured_propellers_take_what_they_have(policy: PolicyName) -> None:
    allocator = Allocator(load_layout("bluerov2"))  # its power is a table
    rng = np.random.default_rng(7)
    for _ in range(20):
        wrench = allocator.scale * rng.normal(size=6)
        free = allocator.allocate(wrench, policy=policy)
        watts = float(rng.uniform(0.2, 0.8)) * free.power
        answer = allocator.allocate(wrench, policy=policy, power=watts)
        assert answer.power == pytest.approx(watts, rel=WATTS)
        assert answer.power <= watts * (1.0 + 1e-9)


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


def _with_buses() -> Layout:
    """BlueROV2 with a bus for its front thrusters and one for the rear ones."""
    layout = load_layout("bluerov2_heavy")
    front = tuple(name for name in layout.names if "front" in name)
    rear = tuple(name for name in layout.names if "rear" in name)
    return replace(layout, buses=(Bus("front", 60.0, front), Bus("rear", 50.0, rear)))


def test_buses_of_a_layout_limit_and_are_named() -> None:
    layout = _with_buses()
    allocator = Allocator(layout)
    members = np.array([np.isin(layout.names, bus.actuators) for bus in layout.buses])
    wrench = [60.0, 20.0, 10.0, 0, 0, 4.0]
    for policy in ("closest", "direction", "priority"):
        answer = allocator.allocate(wrench, policy=policy)
        power = members @ plant_of(layout).power(answer.command)
        assert (power <= np.array([60.0, 50.0]) * (1.0 + WATTS)).all()
        assert "bus front" in answer.binding or "bus rear" in answer.binding
    lower = allocator.allocate(wrench, power={"rear": 20.0})
    assert members[1] @ plant_of(layout).power(lower.command) <= 20.0 * (1.0 + WATTS)
    assert members[0] @ plant_of(layout).power(lower.command) <= 60.0 * (1.0 + WATTS)
    free = Allocator(load_layout("bluerov2_heavy")).allocate(wrench)
    np.testing.assert_array_equal(allocator.allocate(wrench, power=np.inf).command, free.command)
    total = allocator.allocate(wrench, power=40.0)
    assert total.power == pytest.approx(40.0, rel=WATTS)
    with pytest.raises(AllocationError, match="has front, rear, got bus 'aft'"):
        allocator.allocate(wrench, power={"aft": 20.0})


def test_a_budget_of_a_layout_is_that_of_a_question() -> None:
    layout = load_layout("bluerov2_heavy")
    limited = Allocator(replace(layout, power_w=100.0))
    wrench = [60.0, 20.0, 10.0, 0, 0, 4.0]
    for _ in range(3):  # the first one, the one that prepares, and one that is prepared
        own = limited.allocate(wrench)
        asked_for = Allocator(layout).allocate(wrench, power=100.0)
        np.testing.assert_allclose(own.command, asked_for.command, rtol=0.0, atol=1e-9)
        assert own.binding == asked_for.binding == ("power",)
        assert own.bound <= own.power <= 100.0 * (1.0 + WATTS)
    batch = limited.allocate_batch([wrench, [10.0, 0, 0, 0, 0, 0]])
    np.testing.assert_allclose(batch.command[0], own.command, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "number", "policy"),
    [
        ("thrusters", 138, "priority"),  # its second group leaves the third no choice
        ("thrusters", 213, "priority"),
        ("thrusters", 246, "priority"),  # one bus bears a hundredth of what another does
        ("thrusters", 385, "direction"),  # one bus binds from far, two never do
        ("azimuths", 103, "priority"),
        ("azimuths", 372, "closest"),
    ],
)
def test_hard_cases_of_several_buses(kind: str, number: int, policy: PolicyName) -> None:
    question = asked(kind, number, 3)
    answer = question.allocator.allocate(question.wrench, policy=policy)
    question.check_power(answer)
    if policy == "closest":
        least = question.cones().least_miss(question.wrench)
        assert miss_of(answer) == pytest.approx(least, abs=MISS)
    elif policy == "direction":
        most = question.cones().largest_share(question.wrench)
        assert answer.share == pytest.approx(most, abs=MISS)
    else:
        least = question.cones().least_miss(question.wrench, [2])
        assert abs(answer.unallocated[2] / answer.scale[2]) == pytest.approx(least, abs=MISS)


def test_thrusters_keep_budgets_by_all_policies() -> None:
    allocator = Allocator(load_layout("bluerov2_heavy"))
    rng = np.random.default_rng(4)
    for _ in range(30):
        wrench = allocator.scale * rng.normal(size=6)
        for policy in POLICIES:
            answer = allocator.allocate(wrench, policy=policy, power=80.0)
            assert answer.power <= 80.0 * (1.0 + WATTS)
