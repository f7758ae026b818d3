"""Looking ahead: the first tick of a trajectory on which no fin will have to turn fast."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from finlab.allocation.learned import pipeline
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.receding_horizon import HORIZON, HorizonSettings, Plan, plan_ahead
from finlab.assets import shipped_layouts
from finlab.layout import load_layout

SECONDS = np.arange(120) * 0.1
AMPLITUDE = np.array([0.98, 0.98, 1.4, 0.175, 0.175, 0.175])
"""Of slow sines in all axes [N, N m]."""


class Call(NamedTuple):
    """One tick: what the pipeline asked, and what it was told."""

    prepared: Prepared
    previous: np.ndarray
    target: np.ndarray
    near: np.ndarray
    far: np.ndarray
    plan: Plan | None

    def ask(self, settings: HorizonSettings = HORIZON, **changes: object) -> Plan | None:
        return plan_ahead(*self[:5], settings=replace(settings, **changes))  # type: ignore[arg-type]


@pytest.fixture(scope="module", params=["A", "C"])
def calls(request: pytest.FixtureRequest, learned: LearnedAllocator) -> Iterator[list[Call]]:
    """Every tick of a slow path on a robot of four fins, on which thrusts pass zero."""
    layout = load_layout(shipped_layouts()[request.param])
    rng = np.random.default_rng(3)
    phase = rng.uniform(0.15, 0.6, 6) * SECONDS[:, None] + rng.uniform(0.0, 2.0 * math.pi, 6)
    seen: list[Call] = []

    def recorded(*given: object) -> Plan | None:
        plan = plan_ahead(*given)  # type: ignore[arg-type]
        seen.append(Call(*given, plan))  # type: ignore[arg-type]
        return plan

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "plan_ahead", recorded)
        previous = None
        for wrench in 0.7 * AMPLITUDE * np.sin(phase):
            previous = learned.allocate(layout, wrench, previous=previous).command
    yield seen


def planned(calls: list[Call]) -> list[tuple[Call, Plan]]:
    return [(call, call.plan) for call in calls if call.plan is not None]


def turn(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    return np.abs((new - old + math.pi) % (2.0 * math.pi) - math.pi)


def thrust(call: Call, command: np.ndarray) -> np.ndarray:
    force = call.prepared.commands.fin.force(call.prepared.commands.clamp(command))
    return np.linalg.norm(force, axis=-1)


def test_the_defaults_follow_from_each_other() -> None:
    half_circle = math.ceil(math.pi / HORIZON.free_turn)
    longest_change = max(ticks for _, ticks in HORIZON.changes)
    assert HORIZON.ticks == half_circle + longest_change
    assert HORIZON.free_turn == pytest.approx(3.5 * 0.1)  # a pole of 3.5 rad/s, ten ticks a second
    assert HORIZON.free_turn < HORIZON.max_turn == pipeline.TURNS[0]
    assert half_circle in [wait for wait, _ in HORIZON.changes]  # a fin at rest may come from anywhere
    for wait, ticks in HORIZON.changes + HORIZON.detours:
        assert wait >= 0 and ticks >= 1 and wait + ticks <= HORIZON.ticks
    assert sum(HORIZON.detour_sizes) == pytest.approx(0.0)
    assert 0.0 < max(HORIZON.detour_sizes) < 1.0
    assert HORIZON.random_detours % sum(size > 0.0 for size in HORIZON.detour_sizes) == 0
    shares = (HORIZON.working_share, HORIZON.stay_gain, HORIZON.turn_cost)
    assert all(0.0 < share < 1.0 for share in shares)


def test_some_ticks_are_planned_and_most_go_straight_on(calls: list[Call]) -> None:
    assert len(calls) == len(SECONDS) - 1
    assert 3 <= len(planned(calls)) <= len(calls) // 2


def test_a_plan_gives_the_next_wrench(calls: list[Call]) -> None:
    for call, plan in planned(calls):
        force = call.prepared.commands.fin.force(call.prepared.commands.clamp(plan.command))[..., 1:]
        given = np.tensordot(force, call.prepared.planar.columns.reshape(*force.shape, 6), 2)
        assert np.linalg.norm(given - call.target) < 0.05


def test_a_plan_lets_no_working_fin_turn_fast_at_once(calls: list[Call]) -> None:
    for call, plan in planned(calls):
        straight = turn(call.near[:, 2], call.previous[:, 2])
        working = thrust(call, plan.command) > 0.02
        fast = turn(plan.command[:, 2], call.previous[:, 2])[working]
        assert fast.max(initial=0.0) <= max(HORIZON.max_turn, straight.max()) + 1e-6
        np.testing.assert_array_equal(plan.command[:, 2], plan.ready)


def test_a_robot_that_does_the_same_on_goes_straight_on(calls: list[Call]) -> None:
    for call in calls[::10]:
        force = call.prepared.commands.fin.force(call.prepared.commands.clamp(call.near))[..., 1:]
        same = np.tensordot(force, call.prepared.planar.columns.reshape(*force.shape, 6), 2)
        assert plan_ahead(call.prepared, call.near, same, call.near, call.near[None]) is None


def test_no_path_is_seen_in_a_sudden_change(calls: list[Call]) -> None:
    for call, _ in planned(calls):
        before = call.prepared.commands.fin.force(call.prepared.commands.clamp(call.previous))[..., 1:]
        now = np.tensordot(before, call.prepared.planar.columns.reshape(*before.shape, 6), 2)
        change = (call.target - now) / np.linalg.norm(call.target - now)
        assert call._replace(target=now + 0.51 * change).ask() is None
        assert call._replace(target=now + 2.0 * change).ask() is None
    # A path that is nearly as fast is still followed with an eye to the next ticks.
    assert any(call._replace(target=call.target).ask(sudden_change=10.0) is not None for call in calls)


def test_what_nothing_costs_is_not_avoided(calls: list[Call]) -> None:
    """Each setting does what it says: where turns cost nothing, none is planned around."""
    ticks = [call for call, _ in planned(calls)]

    def left(**changes: object) -> int:
        return sum(call.ask(**changes) is not None for call in ticks)

    assert left() == len(ticks)
    assert left(stay_gain=0.999, max_turn=4.0) == 0
    assert left(free_turn=4.0, max_turn=4.0) < len(ticks)
    assert left(sudden_change=0.0) == 0


def test_dear_turns_are_slow(calls: list[Call]) -> None:
    def first_turns(cost: float) -> float:
        total = 0.0
        for call in calls:
            plan = call.ask(turn_cost=cost, max_turn=4.0)
            ready = call.near[:, 2] if plan is None else plan.ready
            working = thrust(call, call.near if plan is None else plan.command) > 0.02
            total += turn(ready, call.previous[:, 2])[working].sum()
        return total

    assert first_turns(10.0) < first_turns(0.0)
