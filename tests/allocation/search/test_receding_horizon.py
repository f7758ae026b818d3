"""The receding horizon: what turns, energies and overloads cost, and when the robot leaves its way."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.search.prepared import Prepared
from finlab.allocation.search.receding_horizon import HORIZON, choose, evaluate, plan_ahead, turns_beyond
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.forces.fin_envelope import COST
from finlab.layout import Fin, Layout, Limits
from tests.allocation.conftest import Flip

TICKS = HORIZON.ticks


@pytest.fixture
def one(effort: SearchAllocator) -> Prepared:
    """A single fin that may point anywhere."""
    return effort.pipeline.prepare(Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)))


def trajectory(prepared: Prepared, share: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Forces (1, H, 1, 2) of the largest thrust times shares (H,), along directions (H,)."""
    thrust = share * prepared.planar.fins.maximum
    return np.stack([thrust * np.cos(direction), thrust * np.sin(direction)], axis=-1)[None, :, None]


def straight(share: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    return np.full(TICKS, share), np.zeros(TICKS)


def previous(direction: float = 0.0) -> np.ndarray:
    return np.array([[0.3, 1.0, direction]])


def test_the_horizon_holds_half_a_circle_at_rest_and_the_longest_change() -> None:
    longest = max(ramp for _, ramp in HORIZON.changes)
    assert TICKS == math.ceil(math.pi / HORIZON.free_turn) + longest == 17


@pytest.mark.parametrize(
    ("turn", "beyond_max", "beyond_free"),
    [(0.34, 0, 0), (0.36, 0, 0.01), (0.49, 0, 0.14), (0.51, 0.01, 0.16)],
)
def test_turns_cost_beyond_what_a_servo_follows(
    one: Prepared, turn: float, beyond_max: float, beyond_free: float
) -> None:
    direction = np.zeros((1, TICKS, 1))
    direction[0, 5:] = turn
    works = np.ones((1, TICKS, 1), dtype=bool)
    fast, paid = turns_beyond(one, np.zeros(1), direction, works)
    np.testing.assert_allclose([fast.sum(), paid.sum()], [beyond_max, beyond_free], atol=1e-12)
    np.testing.assert_allclose([fast[0, 5, 0], paid[0, 5, 0]], [beyond_max, beyond_free], atol=1e-12)


def test_a_fin_at_rest_turns_over_its_rest(one: Prepared) -> None:
    direction, works = np.zeros((1, TICKS, 1)), np.ones((1, TICKS, 1), dtype=bool)
    direction[0, 7:] = 1.4  # at rest for three ticks, so four turns of 0.35 lead there
    works[0, 4:7] = False
    fast, paid = turns_beyond(one, np.zeros(1), direction, works)
    assert fast.sum() == 0.0 and paid.sum() == pytest.approx(0.0, abs=1e-12)
    works[0, 6] = True
    direction[0, 6] = 0.0
    fast, _ = turns_beyond(one, np.zeros(1), direction, works)
    assert fast.sum() == pytest.approx(1.4 - 0.5)


def test_a_stop_in_the_way_counts_as_too_fast(effort: SearchAllocator) -> None:
    arc = Limits(zero_direction=(-0.5, 0.5))
    prepared = effort.pipeline.prepare(Layout("arc", (Fin("a", (0.0, 0.0, 0.0), 0.0, arc),)))
    direction, works = np.full((1, TICKS, 1), 0.7), np.ones((1, TICKS, 1), dtype=bool)
    fast, _ = turns_beyond(prepared, np.array([0.5]), direction, works)
    np.testing.assert_allclose(fast, 0.2)


def test_the_last_tick_lasts(one: Prepared) -> None:
    """Full thrust to the end against full thrust that falls to a quarter, which takes half the energy."""
    share, direction = straight()
    full = evaluate(one, previous(), trajectory(one, share, direction)).cost[0]
    share[-1] = 0.25
    quarter = evaluate(one, previous(), trajectory(one, share, direction)).cost[0]
    whole = one.planar.fins.table[-1, COST]
    assert full == pytest.approx(whole)
    assert full - quarter == pytest.approx(0.5 * whole * (1 + 10) / (17 + 10))


def test_a_turn_costs_energy_and_a_late_one_less(one: Prepared) -> None:
    share, direction = straight()
    one = one._replace(planar=one.planar._replace(direction_cost=np.zeros(1)))
    still = evaluate(one, previous(), trajectory(one, share, direction)).cost[0]
    costs = []
    for tick in (0, 8):
        turned = direction.copy()
        turned[tick:] = 0.45
        found = evaluate(one, previous(), trajectory(one, share, turned))
        assert found.too_fast[0] == 0.0
        costs.append(found.cost[0] - still)
    dear = 0.07 * one.planar.fins.table[-1, COST] * 0.1
    assert costs == pytest.approx([dear, dear * (1 - 8 / 17)])


@pytest.mark.parametrize("direction", [0.6, -1.2, 2.0])
def test_where_a_fin_points_costs_its_square_while_it_works(one: Prepared, direction: float) -> None:
    share, ahead = straight()
    cost = [
        evaluate(one, previous(angle), trajectory(one, share, ahead + angle)).cost[0]
        for angle in (0.0, direction)
    ]
    assert cost[1] - cost[0] == pytest.approx(one.planar.direction_cost[0] * direction**2)
    idle = np.full(TICKS, 1e-6)
    rest = [
        evaluate(one, previous(angle), trajectory(one, idle, ahead + angle)).cost[0]
        for angle in (0.0, direction)
    ]
    assert rest[1] == pytest.approx(rest[0])


def test_power_grows_faster_than_force(search: SearchAllocator) -> None:
    """A quarter of the thrust takes an eighth of the power, and half of the effort."""
    layout = Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),))
    prepared = search.pipeline.prepare(layout)
    whole = prepared.planar.fins.table[-1, COST]
    cost = evaluate(prepared, previous(), trajectory(prepared, *straight(0.25))).cost[0]
    assert cost == pytest.approx(whole / 8.0)


def test_a_fast_turn_is_avoided_at_any_price(one: Prepared) -> None:
    share, direction = straight()
    direction[4:] = 0.6
    found = evaluate(one, previous(), trajectory(one, share, direction))
    assert found.too_fast[0] == pytest.approx(0.1 * (1 - 4 / 17))
    assert found.cost[0] > 10 * one.planar.fins.table[-1, COST]


def test_what_a_fin_cannot_give_costs_dearly(one: Prepared) -> None:
    whole = one.planar.fins.table[-1, COST]
    share, direction = straight(2.0)
    cost = evaluate(one, previous(), trajectory(one, share, direction)).cost[0]
    assert cost == pytest.approx(math.sqrt(2.0) * whole + 3.0)


@pytest.mark.parametrize(("share", "works"), [(1.9e-4, False), (2.1e-4, True)])
def test_a_fin_that_hardly_pushes_may_point_anywhere(
    effort: SearchAllocator, share: float, works: bool
) -> None:
    rest = Limits((0.0, 0.6), (0.0, 2.1))
    prepared = effort.pipeline.prepare(Layout("rest", (Fin("a", (0.0, 0.0, 0.0), 0.0, rest),)))
    found = evaluate(prepared, previous(), trajectory(prepared, *straight(share)))
    assert found.works.all() == found.works.any() == works


@pytest.mark.parametrize(("gain", "chosen"), [(0.0, 0), (0.008, 0), (0.012, 2)])
def test_the_way_is_left_only_for_a_gain(gain: float, chosen: int) -> None:
    cost = np.array([1.0, 1.1, 1.0 - gain, 1.2])
    assert choose(cost, 2) == chosen
    assert cost[0] == 1.0


def test_sudden_changes_are_not_predicted(flip: Flip) -> None:
    prepared, before, target, near, far = flip
    wrench = prepared.commands.wrench(before[None])[0]
    direction = (target - wrench) / np.linalg.norm(target - wrench)
    eager = replace(
        HORIZON, stay_gain=1.0 - 1e-12
    )  # leaves for nothing: None means that nothing was predicted
    for size, predicted in ((0.49, True), (0.51, False)):
        reached = wrench + size * direction
        settings = replace(eager, stay_gain=-1e9)
        plan = plan_ahead(prepared, before, reached, near, far, settings)
        assert (plan is not None) == predicted
    assert plan_ahead(prepared, before, target, near, far, eager) is None


def test_the_plan_gives_the_next_tick_within_the_limits(flip: Flip) -> None:
    prepared, before, target, near, far = flip
    plan = plan_ahead(prepared, before, target, near, far, replace(HORIZON, stay_gain=-1e9))
    assert plan is not None
    np.testing.assert_array_equal(plan.command[:, 2], plan.ready)
    assert (plan.command[:, :2] >= prepared.plant.lower[:, :2] - 1e-12).all()
    assert (plan.command[:, :2] <= prepared.plant.upper[:, :2] + 1e-12).all()
