"""Power budgets from tick to tick, and bounds within budgets: beside the laws written a second time,
cone programs, and a robot that can be computed by hand."""

import ctypes
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.dual.budget import _on_the_way
from finlab.allocation.policy import PolicyName
from finlab.allocation.power_budget import PowerBudget
from finlab.arrays import Array
from finlab.core.calls import budget_record
from finlab.layout.layout import Bus
from tests.allocation.dual.test_budget import POLICIES, asked
from tests.core.internal_functions import Robot, at, functions, in_the_core, question_of
from tests.oracle_plant import OraclePlant
from tests.random_robots import load, random_robot, with_rates

WITHIN = 1e-8
"""Share by which a power counts as within its budget."""
TICKS = 12
"""Of a loop."""


def crossed_pods(power_w: float) -> dict[str, Any]:
    """A pod and a thruster that turn and push slowly."""
    model: dict[str, Any] = {"type": "power_law", "forward": 1.0, "reverse": 1.0}
    pod: dict[str, Any] = {
        "type": "azimuth",
        "turn_axis": [0, 0, 1],
        "zero": [1, 0, 0],
        "force_n": [0, 100],
    }
    pod |= {"rate_n_s": 100.0, "turn_rate_deg_s": 90.0, "model": model}
    actuators = [
        {**pod, "name": "bow", "position_m": [3.0, 0.5, 0.0]},
        {**pod, "name": "stern", "position_m": [-3.0, 0.0, 0.0]},
        {
            "name": "tunnel",
            "type": "thruster",
            "position_m": [2.0, 0.0, 0.0],
            "axis": [0.0, 1.0, 0.0],
            "force_n": [-60.0, 60.0],
            "rate_n_s": 60.0,
            "model": model,
        },
    ]
    axes = ["Fx", "Fy", "Tz"]
    return {
        "format": "finlab-layout",
        "version": 2,
        "name": "crossed",
        "axes": axes,
        "actuators": actuators,
        "power_w": power_w,
    }


def check_loop(layout: dict[str, Any], watts: Array, members: Array, policy: PolicyName) -> None:
    """Checks that a tick after one within the budgets is within them, and that they bind."""
    plant = OraclePlant(layout)
    parsed = load(layout)
    names = parsed.names
    buses = tuple(
        Bus(f"b{k}", float(most), tuple(n for n, is_fed in zip(names, fed, strict=True) if is_fed))
        for k, (most, fed) in enumerate(zip(watts, members, strict=True))
    )
    allocator = Allocator(replace(parsed, power_w=None, buses=buses))
    counts = np.isin(np.array(["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]), parsed.axes)
    rng = np.random.default_rng(9)
    wrench = np.zeros(6)
    previous = None
    fullest = 0.0
    for tick in range(TICKS):
        if tick % 4 == 0:
            aim = allocator.scale * rng.normal(size=6) * counts
        wrench = 0.5 * wrench + 0.5 * aim
        command = allocator.allocate(wrench, previous=previous, policy=policy).command
        shares = members @ plant.powers(command) / watts
        assert (shares <= 1.0 + WITHIN).all(), (tick, shares - 1.0)
        fullest = max(fullest, float(shares.max()))
        previous = command
    assert fullest >= 0.999


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
def test_pods_stay_within_a_budget(share: float, policy: PolicyName) -> None:
    layout = crossed_pods(1.0)
    watts = np.array([share * (2.0 * 100.0**1.5 + 60.0**1.5)])
    check_loop(layout, watts, np.ones((1, 3), bool), policy)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
def test_several_buses_stay_within_their_budgets(kind: str, policy: PolicyName) -> None:
    """Where pods' forces in the last part of a gap of a tick's sets once took more."""
    layout = with_rates(random_robot(kind, 1, 11))
    plant = OraclePlant(layout)
    rng = np.random.default_rng(4)
    most = np.max([plant.powers(plant.draw(rng)) for _ in range(100)], axis=0)
    bus_of = np.arange(len(most)) % 3
    members = np.array([bus_of == bus for bus in range(3)])
    members = members[members.any(axis=1)]
    check_loop(layout, 0.08 * members @ most, members, policy)


def test_what_is_nearest_to_a_ray_keeps_the_budget() -> None:
    """Only 10 N ahead may leave in a tick, so that rates allow no share of the wrench alone."""
    model: dict[str, Any] = {"type": "power_law", "forward": 1.0, "reverse": 1.0}
    thruster: dict[str, Any] = {
        "type": "thruster",
        "position_m": [0, 0, 0],
        "force_n": [-50, 50],
        "model": model,
    }
    thruster |= {"rate_n_s": 100.0}
    layout = {
        "format": "finlab-layout",
        "version": 2,
        "name": "two",
        "axes": ["Fx", "Fy"],
        "actuators": [
            {**thruster, "name": "ahead", "axis": [1, 0, 0]},
            {**thruster, "name": "port", "axis": [0, 1, 0]},
        ],
    }
    previous = np.zeros((2, 3))
    previous[:, 0] = 40.0, 4.0
    wrench = [10, 50, 0, 0, 0, 0]
    free = Allocator(load(layout)).allocate(wrench, previous=previous, policy="direction")
    np.testing.assert_allclose(free.command[:, 0], [30.0, 14.0], rtol=1e-9)  # as far as rates go
    tight = Allocator(replace(load(layout), power_w=float(30.0**1.5 + 8.0**1.5)))
    answer = tight.allocate(wrench, previous=previous, policy="direction")
    ahead, port = answer.command[:, 0]
    assert ahead == pytest.approx(30.0, abs=1e-2)
    assert port == pytest.approx(8.0, abs=1e-2)
    assert ahead**1.5 + port**1.5 <= (30.0**1.5 + 8.0**1.5) * (1.0 + WITHIN)


def brought_within(robot: Robot, command: Array, **fields: Any) -> tuple[Array, Array]:
    """Commands that the last resort makes of these, and the buses' shares there."""
    question, _kept = question_of(np.zeros(6), fields)
    address = ctypes.c_void_p(question.ctypes.data)
    work = robot.work()
    core = functions()
    assert core.fl_prepare_question(at(robot.block), work, address)
    made = command.copy()
    share = np.zeros(8)
    budget = ctypes.c_void_p(int(question["budget"][0]))
    core.fl_budget_shares(at(robot.block), work, budget, at(made), at(share))
    core.fl_come_within_budget(at(robot.block), work, address, at(made), at(share))
    return made, share


@pytest.mark.parametrize("is_tick", [False, True])
def test_the_last_resort_goes_as_far_as_each_bus_allows(is_tick: bool) -> None:
    layout = crossed_pods(1.0)
    plant = OraclePlant(layout)
    robot = in_the_core(replace(load(layout), power_w=None))
    members = np.array([[True, True, False], [False, False, True]])
    command = np.array([[0.1, 50.0, 0.0], [-0.1, 45.0, 0.0], [30.0, 0.0, 0.0]])
    powers = members @ plant.powers(command)
    watts = powers * [0.8, 1.1]  # the first bus exceeds
    fields: dict[str, Any] = {"budget": budget_record(members, watts)}
    if is_tick:
        fields["previous"] = np.array([[0.0, 42.0, 0.0], [0.0, 44.0, 0.0], [32.0, 0.0, 0.0]])
    made, share = brought_within(robot, command, **fields)
    taken = members @ plant.powers(made) / watts
    np.testing.assert_allclose(share[:2], taken, rtol=1e-6)
    assert taken[0] == pytest.approx(1.0, abs=1e-6)
    assert taken[0] <= 1.0 + WITHIN
    np.testing.assert_array_equal(made[2], command[2])  # whose bus did not exceed
    if is_tick:
        assert plant.rate_excess(fields["previous"], made, 0.1) <= 1e-6


def test_the_last_resort_takes_least_where_rates_leave_no_command_within() -> None:
    layout = crossed_pods(1.0)
    plant = OraclePlant(layout)
    robot = in_the_core(replace(load(layout), power_w=None))
    previous = np.array([[0.0, 60.0, 0.0], [0.0, 60.0, 0.0], [0.0, 0.0, 0.0]])
    watts = np.array([100.0])
    record = budget_record(np.ones((1, 3), bool), watts)
    made, share = brought_within(robot, previous, previous=previous, budget=record)
    np.testing.assert_allclose(made[:2, 1], 50.0, rtol=1e-9)  # 10 N less in a tick
    assert share[0] * 100.0 == pytest.approx(plant.power(made), rel=1e-6)


def test_python_goes_as_far_from_the_tick_before_as_a_budget_allows() -> None:
    """Where laws are known to Python alone, and the core cannot correct what it is off."""
    layout = random_robot("fins uneven", 1, 11)
    plant = OraclePlant(layout)
    parsed = load(layout)
    method: Any = Allocator(parsed)._whole.method  # type: ignore[attr-defined]
    before = 0.7 * parsed.lower + 0.3 * parsed.upper
    beyond = 0.2 * parsed.lower + 0.8 * parsed.upper
    members = np.ones((1, parsed.n), bool)
    for share, is_kept in ((0.5, True), (-0.1, False)):
        least = plant.power(before)
        watts = np.array([least + share * (plant.power(beyond) - least)])
        made = _on_the_way(method, PowerBudget(("all",), members, watts), before, beyond)
        assert (made is not None) == is_kept
        if made is not None:
            assert plant.power(made) == pytest.approx(watts[0], rel=1e-8)
            assert plant.power(made) <= watts[0] * (1.0 + WITHIN)


@pytest.mark.parametrize("number", [0, 2, 3, 6, 7])
def test_bounds_count_the_multipliers_of_several_buses(number: int) -> None:
    """Without them the dual proves less, down to nothing."""
    question = asked("thrusters", number, 3)
    answer = question.allocator.allocate(question.wrench)
    assert answer.bound is not None
    least = question.cones().least_power(answer.wrench)
    assert answer.bound <= min(least * (1.0 + 1e-5), answer.power)
    assert answer.bound >= 0.9999 * least


def test_bounds_of_ticks_and_batches_count_them() -> None:
    question = asked("thrusters", 0, 3)
    allocator = question.allocator
    single = allocator.allocate(question.wrench)
    batch = allocator.allocate_batch(np.stack([question.wrench, 0.1 * question.wrench]))
    tick = allocator.allocate(question.wrench, previous=single.command)
    assert batch.bound is not None
    for bound, power in ((batch.bound[0], batch.power[0]), (tick.bound, tick.power)):
        assert bound is not None
        assert 0.9999 * power <= bound <= power
