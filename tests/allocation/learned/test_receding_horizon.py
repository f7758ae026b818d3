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
from finlab.allocation.learned.receding_horizon import (
    HORIZON,
    HorizonSettings,
    Plan,
    _changes,
    _detours,
    _drifts,
    _evaluate,
    plan_ahead,
)
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


# What the arrays say, one trajectory, tick and fin after the other.


def cost_by_loops(
    prepared: Prepared, previous: np.ndarray, force: np.ndarray, settings: HorizonSettings = HORIZON
) -> tuple[float, float]:
    """Cost and too fast turns of one trajectory of planar forces (H, n, 2)."""
    planar, wraps = prepared.planar, prepared.commands.wraps
    spent, too_fast, turned = np.zeros(settings.ticks), 0.0, 0.0
    for i, top in enumerate(planar.curves.maximum):
        points, since = previous[i, 2], 0
        for k in range(settings.ticks):
            thrust, direction = np.hypot(*force[k, i]), math.atan2(force[k, i, 1], force[k, i, 0])
            spent[k] += planar.curves.table[i, -1, 2] * math.sqrt(thrust / top)
            spent[k] += settings.overload_cost * max(thrust / top - 1.0, 0.0)
            if thrust <= max(settings.working_share * top, 1.5 * planar.curves.minimum[i]):
                continue
            spent[k] += planar.direction_cost[i] * direction**2
            here, there = (
                math.remainder(angle - planar.middle[i], math.tau) for angle in (points, direction)
            )
            turned_by = abs(math.remainder(there - here, math.tau) if wraps[i] else there - here)
            beyond_arc = 0.0 if wraps[i] else max(abs(there) - planar.half[i], 0.0)
            sooner = 1.0 - k / settings.ticks
            ticks = k + 1 - since
            too_fast += sooner * (max(turned_by - settings.max_turn * ticks, 0.0) + beyond_arc)
            turned += sooner * max(turned_by - settings.free_turn * ticks, 0.0)
            points, since = direction, k + 1
    lasting = settings.last_tick_weight
    mean = (spent.sum() + lasting * spent[-1]) / (settings.ticks + lasting)
    return mean + settings.turn_cost * turned + 1000.0 * too_fast, too_fast


def plan_by_loops(call: Call, settings: HorizonSettings = HORIZON) -> Plan | None:
    planar = call.prepared.planar
    before, now = (planar_force(call.prepared, command) for command in (call.previous, call.near))
    slow, working = _drifts(planar, now, call.target - wrench(call.prepared, before))
    ticks = range(settings.ticks)
    kept = np.array([before + (k + 1) * working for k in ticks])

    def along(start: np.ndarray, drift: np.ndarray, first: int = 0) -> np.ndarray:
        return np.array([start + (k + first) * drift for k in ticks])

    paths = [along(now, slow), along(now, working), along(before, slow, 1), kept]
    for goal in (planar_force(call.prepared, command) for command in call.far):
        paths += list(_changes(kept, along(goal, slow)[None], settings.changes))
    costs = [cost_by_loops(call.prepared, call.previous, path, settings) for path in paths]
    if min(costs)[1] > 0.0:
        for goal in _detours(planar, now, working, settings):
            paths += list(_changes(kept, along(goal, slow)[None], settings.detours))
        costs = [cost_by_loops(call.prepared, call.previous, path, settings) for path in paths]
    weighed = [cost * (1.0 - settings.stay_gain if k < 2 else 1.0) for k, (cost, _) in enumerate(costs)]
    best = int(np.argmin(weighed))
    if best < 2:
        return None
    ready = call.previous[:, 2].copy()
    least = np.maximum(settings.working_share * planar.curves.maximum, 1.5 * planar.curves.minimum)
    for i in range(len(ready)):
        for force in paths[best][:, i]:
            if np.hypot(*force) > least[i]:
                ready[i] = math.atan2(force[1], force[0])
                break
    first = np.minimum(np.linalg.norm(paths[best][0], axis=-1), planar.curves.maximum)
    command = planar.curves.lookup(first)
    command[:, 2] = ready
    return Plan(command, ready)


def planar_force(prepared: Prepared, command: np.ndarray) -> np.ndarray:
    return np.asarray(prepared.commands.fin.force(prepared.commands.clamp(command))[..., 1:])


def wrench(prepared: Prepared, force: np.ndarray) -> np.ndarray:
    """Normalized wrench (6,) of planar forces (n, 2)."""
    return np.einsum("nd,ndi->i", force, prepared.planar.columns)


@pytest.mark.parametrize("name", ["A", "penta", "restricted"])
def test_costs_are_those_of_plain_loops(name: str, learned: LearnedAllocator) -> None:
    prepared = learned.pipeline.prepare(load_layout(shipped_layouts()[name]))
    n, top = len(prepared.lower), prepared.planar.curves.maximum
    rng = np.random.default_rng(5)
    previous = rng.uniform(prepared.lower, prepared.upper)
    force = (
        rng.standard_normal((12, HORIZON.ticks, n, 2))
        * top[:, None]
        * rng.choice([0.0, 0.1, 1.0], (12, 1, n, 1))
    )
    force[6:, 1:] = force[6:, :1]  # some go on as they began
    found = _evaluate(prepared, previous, force, HORIZON)
    for k in range(12):
        cost, too_fast = cost_by_loops(prepared, previous, force[k])
        assert found.cost[k] == pytest.approx(cost, rel=1e-9)
        assert found.too_fast[k] == pytest.approx(too_fast, rel=1e-9, abs=1e-9)


def test_plans_are_those_of_plain_loops(calls: list[Call]) -> None:
    planned_ticks = [call for call in calls if call.plan is not None]
    for call in planned_ticks[::2] + calls[::17]:
        before = planar_force(call.prepared, call.previous)
        if np.linalg.norm(call.target - wrench(call.prepared, before)) > HORIZON.sudden_change:
            continue
        expected = plan_by_loops(call)
        assert (call.plan is None) == (expected is None)
        if call.plan is not None and expected is not None:
            np.testing.assert_allclose(call.plan.command, expected.command, atol=1e-6)
            np.testing.assert_allclose(call.plan.ready, expected.ready, atol=1e-6)


def test_changes_wait_and_then_go_evenly() -> None:
    start, goal = np.zeros((10, 1, 2)), np.ones((2, 10, 1, 2)) * [[[[1.0, 2.0]]], [[[3.0, 4.0]]]]
    found = _changes(start, goal, ((0, 1), (4, 3)))
    assert found.shape == (4, 10, 1, 2)
    at_once, later = np.ones(10), np.array([0, 0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1, 1])
    for path, share, end in zip(found, (at_once, at_once, later, later), (1.0, 3.0, 1.0, 3.0), strict=True):
        np.testing.assert_allclose(path[:, 0, 0], end * share)


def test_drifts_change_the_wrench_with_the_least_effort(calls: list[Call]) -> None:
    for call in calls[::20]:
        planar, now = call.prepared.planar, planar_force(call.prepared, call.near)
        top = planar.curves.maximum
        change = np.array([0.02, -0.01, 0.03, 0.01, 0.0, -0.02])
        weights = (top, np.maximum(np.linalg.norm(now, axis=-1), 1e-4 * top) ** 1.5)
        for drift, weight in zip(_drifts(planar, now, change), weights, strict=True):
            root = np.repeat(np.sqrt(weight), 2)
            least = root * (np.linalg.pinv(planar.columns.reshape(-1, 6).T * root) @ change)
            np.testing.assert_allclose(drift.ravel(), least, atol=1e-6)


def test_detours_keep_the_wrench(calls: list[Call]) -> None:
    call = calls[0]
    planar, now = call.prepared.planar, planar_force(call.prepared, call.near)
    drift = np.random.default_rng(0).standard_normal(now.shape)
    steps = _detours(planar, now, drift, HORIZON) - now
    n, sizes = len(now), HORIZON.detour_sizes
    assert steps.shape == (len(sizes) * n + HORIZON.random_detours, n, 2)
    for step in steps:
        assert np.abs(wrench(call.prepared, step)).max() < 1e-9
    by_fin = steps[: len(sizes) * n].reshape(len(sizes), n, n, 2)
    for i in range(n):
        across = np.array([-drift[i, 1], drift[i, 0]])
        shares = np.array([by_fin[k, i] / size for k, size in enumerate(sizes)])
        np.testing.assert_allclose(shares, np.broadcast_to(shares[0], shares.shape), atol=1e-9)
        assert shares[0, i] @ across > 0.5 * np.linalg.norm(shares[0, i]) * np.linalg.norm(across)
    length = np.linalg.norm(steps[len(sizes) * n :].reshape(-1, 2 * n), axis=1) / planar.curves.maximum.mean()
    np.testing.assert_allclose(length, np.resize([size for size in sizes if size > 0.0], len(length)))


def test_where_nothing_can_be_given_up_there_are_no_detours(learned: LearnedAllocator) -> None:
    prepared = learned.pipeline.prepare(load_layout(shipped_layouts()["A"]))
    planar = prepared.planar._replace(columns=np.random.default_rng(0).standard_normal((3, 2, 6)))
    assert _detours(planar, np.ones((3, 2)), np.ones((3, 2)), HORIZON).shape == (0, 3, 2)
