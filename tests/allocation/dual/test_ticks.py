"""A tick is the same question, asked of what the drives allow: limits and rates hold whatever
comes, policies are those of a robot with such limits, bounds are no more than the power, and
turning costs as `calm` says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocation, Allocator
from finlab.allocation.policy import POLICY_NAMES
from finlab.allocation.question import MAX_WRENCH
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.interaction.jets import Jets
from finlab.layout import Layout, load_layout
from finlab.layout.load import parse_layout
from finlab.physics import plant_of
from tests.hostile_robots import hostile_robot
from tests.random_robots import (
    KINDS,
    bluerov2_heavy,
    layout_of,
    random_flow,
    random_robot,
    with_rates,
)
from tests.sampled_cases import sampled

PERIOD_S = 0.1
"""Length of a tick [s]."""


def beyond_what_is_allowed(robot: Layout, before: Array, after: Array) -> float:
    """By how much a command (n, 3) passes limits or rates after another one; angles the shorter way
    round."""
    worst = 0.0
    for part, old, new in zip(robot.actuators, before, after, strict=True):
        if np.isnan(new).any():
            continue
        lower = np.array(part.lower)
        upper = np.array(part.upper)
        rates = np.array(part.rates)
        outside = np.maximum(np.maximum(lower - new, new - upper), 0.0)
        change = np.abs(new - old)
        turn = np.abs((new - old + math.pi) % (2.0 * math.pi) - math.pi)
        angle = np.isclose(upper - lower, 2.0 * math.pi)
        change = np.where(angle, np.minimum(change, turn), change)
        allowed = np.where(np.isfinite(rates), rates * PERIOD_S, np.inf)
        # Where the command before was unknown, any may follow.
        faster = np.where(np.isnan(old), 0.0, np.maximum(change - allowed, 0.0))
        width = np.maximum(np.where(np.isfinite(upper - lower), upper - lower, 1.0), 1.0)
        worst = max(worst, float((outside / width).max()), float((faster / width).max()))
    return worst


def jump(robot: Layout, allocator: Allocator, rng: np.random.Generator) -> Array:
    """A wrench (6,) anywhere: of a random command, up to many times as much."""
    lower = np.nan_to_num(robot.lower)
    upper = np.nan_to_num(robot.upper)
    command = lower + rng.random(lower.shape) * (upper - lower)
    wrench = plant_of(allocator.layout).wrench(command)
    times = rng.choice([0.0, 0.3, 1.0, 3.0, 1e3])
    aside = rng.choice([0.0, 0.1]) * allocator.scale * rng.normal(size=6)
    return np.clip(times * wrench + aside, -MAX_WRENCH, MAX_WRENCH)


def ride(robot: Layout, rng: np.random.Generator, flow: Array | None, ticks: int) -> None:
    """Ticks of random jumps, policies, losses and free axes, each within what is allowed."""
    allocator = Allocator(robot, period_s=PERIOD_S, calm=float(rng.choice([0.0, 2.0, 10.0])))
    names = [part.name for part in robot.actuators]
    # From the rim of the limits, where rounding hurts.
    rim = rng.random(robot.lower.shape) < 0.5
    previous = np.where(rim, robot.lower, robot.upper)
    for _ in range(ticks):
        lost = [str(rng.choice(names))] if len(names) > 1 and rng.random() < 0.3 else []
        free = [str(rng.choice(AXES))] if rng.random() < 0.3 else []
        answer = allocator.allocate(
            jump(robot, allocator, rng),
            previous=previous,
            policy=str(rng.choice(POLICY_NAMES)),
            lost=lost,
            free=free,
            flow=flow,
        )
        assert beyond_what_is_allowed(robot, previous, answer.command) <= 1e-9
        assert answer.bound is None or 0.0 <= answer.bound <= answer.power
        assert np.isnan(answer.command).any() == bool(lost)
        previous = np.where(np.isnan(answer.command), previous, answer.command)


@pytest.mark.parametrize("number", sampled(range(3), every=3))
@pytest.mark.parametrize("kind", KINDS)
def test_no_command_of_a_tick_passes_limits_or_rates(kind: str, number: int) -> None:
    rng = np.random.default_rng([31, KINDS.index(kind), number])
    robot = parse_layout(with_rates(random_robot(kind, number, 31)))
    ride(robot, rng, random_flow(kind, number, 31), 10)


@pytest.mark.parametrize("number", sampled(range(12), every=3))
def test_no_command_of_a_tick_passes_limits_or_rates_of_an_extreme_robot(number: int) -> None:
    ride(hostile_robot(number, 31), np.random.default_rng([32, number]), None, 10)


def test_no_command_of_a_tick_passes_limits_or_rates_where_jets_meet() -> None:
    robot = replace(parse_layout(with_rates(bluerov2_heavy())), interaction=Jets())
    ride(robot, np.random.default_rng(33), None, 25)


def limited(robot: Layout, previous: Array) -> Layout:
    """The robot of thrusters whose limits are those of the tick after a command (n, 3)."""
    parts = []
    for part, (force, *_) in zip(robot.actuators, previous, strict=True):
        step = part.rates[0] * PERIOD_S
        parts.append(replace(part, force=(force - step, force + step)))
    return replace(robot, actuators=tuple(parts))


@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_a_policy_of_a_tick_is_that_of_a_robot_with_such_limits(policy: str) -> None:
    robot = parse_layout(with_rates(bluerov2_heavy()))
    allocator = Allocator(robot, period_s=PERIOD_S)
    rng = np.random.default_rng(34)
    worst = 0.0
    for _ in range(20):
        # Layouts know limits that hold 0 alone, so the tick begins near it.
        step = PERIOD_S * np.array([part.rates[0] for part in robot.actuators])
        previous = np.zeros(robot.lower.shape)
        previous[:, 0] = 0.9 * step * rng.uniform(-1.0, 1.0, robot.n)
        tick = limited(robot, previous)
        target = jump(robot, allocator, rng)
        own = allocator.allocate(target, previous=previous, policy=policy)
        same = Allocator(tick, period_s=PERIOD_S).allocate(target, policy=policy)
        worst = max(worst, float(np.abs((own.wrench - same.wrench) / own.scale).max()))
    assert worst <= 1e-4


def turned(answers: list[Allocation]) -> float:
    """How far all pods turn [rad] over a ride."""
    angle = np.stack([answer.command[:2, 0] for answer in answers])
    change = (np.diff(angle, axis=0) + math.pi) % (2.0 * math.pi) - math.pi
    return float(np.abs(change).sum())


def pods_in_waves(calm: float) -> list[Allocation]:
    """Answers of a catamaran to a wrench that swings, 120 ticks one after the other."""
    allocator = Allocator(load_layout("catamaran"), period_s=PERIOD_S, calm=calm)
    scale = allocator.scale
    answers = list[Allocation]()
    previous = None
    for tick in range(120):
        phase = 2.0 * math.pi * tick / 30.0
        target = (
            0.3
            * scale
            * np.array([math.sin(phase), math.cos(0.7 * phase), 0, 0, 0, math.sin(1.3 * phase)])
        )
        answers.append(allocator.allocate(target, previous=previous))
        previous = answers[-1].command
    return answers


def test_the_calmer_the_less_pods_turn_and_watts_say_what_it_took() -> None:
    rides = {calm: pods_in_waves(calm) for calm in (0.0, 2.0, 10.0)}
    assert turned(rides[10.0]) < turned(rides[2.0]) < 0.9 * turned(rides[0.0])
    took = {calm: sum(answer.calm_power for answer in answers) for calm, answers in rides.items()}
    assert took[0.0] == 0.0 < took[2.0] < took[10.0]


def test_what_calm_took_is_what_the_cheapest_answer_of_the_same_tick_takes_less() -> None:
    answers = pods_in_waves(10.0)
    cheapest = Allocator(load_layout("catamaran"), period_s=PERIOD_S, calm=0.0)
    compared = 0
    for before, answer in zip(answers, answers[1:], strict=False):
        other = cheapest.allocate(np.nan_to_num(answer.wrench), previous=before.command)
        assert answer.calm_power == pytest.approx(
            answer.power - other.power, abs=1e-6 * answer.power
        )
        compared += answer.calm_power > 0.01 * answer.power
    assert compared > 5  # there is something to compare


@pytest.mark.parametrize("policy", ["closest", "direction"])
@pytest.mark.parametrize("name", ["drillship", "catamaran", "pair"])
def test_pods_and_fins_that_stand_the_wrong_way_turn_until_a_wrench_is_given(
    name: str, policy: str
) -> None:
    robot = load_layout(name)
    allocator = Allocator(robot, period_s=PERIOD_S)
    at_rest = allocator.allocate(np.zeros(6)).command
    rng = np.random.default_rng(5)
    for _ in range(4):
        span = np.nan_to_num(robot.upper - robot.lower)
        command = np.nan_to_num(robot.lower) + rng.random(span.shape) * span
        target = 0.3 * plant_of(robot).wrench(command)
        expected = allocator.allocate(target, policy=policy)
        previous = at_rest
        for _ in range(500):
            answer = allocator.allocate(target, previous=previous, policy=policy)
            if answer.err_norm <= expected.err_norm + 1e-3:
                break
            assert answer.binding
            previous = answer.command
        assert answer.err_norm <= expected.err_norm + 1e-3


@pytest.mark.parametrize("policy", ["closest", "direction"])
@pytest.mark.parametrize(
    ("start", "target"),
    [
        (2.6, [-30.0, -10.0, 0.0, 0.0, 0.0, 0.0]),
        (2.0, [-30.0, -30.0, 0.0, 0.0, 0.0, 0.0]),
        (-2.6, [0.0, 30.0, 0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_idle_pods_turn_within_their_arc_where_the_shorter_way_is_past_its_ends(
    start: float, target: list[float], policy: str
) -> None:
    boat = load_layout("catamaran")
    robot = boat.with_actuators(
        tuple(
            replace(pod, arc=(-2.7, 2.7)) if pod.type == "azimuth" else pod
            for pod in boat.actuators
        )
    )
    allocator = Allocator(robot, period_s=PERIOD_S)
    expected = allocator.allocate(target, policy=policy)
    turn_per_tick = robot.actuators[0].turn_rate * PERIOD_S
    most_ticks = 2 * round(2 * 2.7 / turn_per_tick)
    command = np.array([[start, 0.0, 0.0], [start, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for _ in range(most_ticks):
        answer = allocator.allocate(target, previous=command, policy=policy)
        assert beyond_what_is_allowed(robot, command, answer.command) <= 1e-9
        command = answer.command
    assert answer.err_norm <= expected.err_norm + 1e-3


@pytest.mark.parametrize("policy", ["closest", "direction"])
def test_idle_pods_whose_jets_meet_others_turn_until_a_wrench_is_given(policy: str) -> None:
    robot = replace(load_layout("catamaran"), interaction=Jets())
    allocator = Allocator(robot, period_s=PERIOD_S)
    target = [-30.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    expected = allocator.allocate(target, policy=policy)
    command = np.zeros((3, 3))
    for _ in range(40):
        answer = allocator.allocate(target, previous=command, policy=policy)
        command = answer.command
    assert answer.err_norm <= expected.err_norm + 1e-3


def test_an_idle_pod_of_unknown_angle_takes_the_angle_that_it_will_have() -> None:
    allocator = Allocator(load_layout("catamaran"), period_s=0.02)
    target = [20.0, 10.0, 0.0, 0.0, 0.0, 2.0]
    later = allocator.allocate(target, lost=["bow"], policy="direction").command
    before = np.array([[0.5, 0.0, 0.0], [np.nan] * 3, [np.nan] * 3])
    now = allocator.allocate(target, lost=["bow"], previous=before, policy="direction").command
    assert now[:2, 1].tolist() == [0.0, 0.0]  # of one that is turned elsewhere, neither gives any
    assert now[1, 0] == pytest.approx(later[1, 0], abs=1e-6)


def test_an_idle_pod_whose_command_before_is_unknown_gets_a_command() -> None:
    allocator = Allocator(load_layout("drillship"), period_s=PERIOD_S)
    previous = allocator.allocate(np.zeros(6)).command.copy()
    previous[1] = np.nan
    answer = allocator.allocate(
        [-4e5, 0.0, 0.0, 0.0, 0.0, 0.0], previous=previous, policy="direction"
    )
    assert np.isfinite(answer.command).all()


def test_outside_of_ticks_calm_takes_nothing() -> None:
    answer = Allocator(load_layout("catamaran")).allocate([20.0, 10.0, 0.0, 0.0, 0.0, 2.0])
    assert answer.calm_power == 0.0


def test_a_drive_passes_through_its_dead_band() -> None:
    """It takes three ticks to leave a band that is wider than a step; then the robot gives what is
    asked."""
    thruster = {
        "name": "only",
        "type": "thruster",
        "position_m": [0.0, 0.0, 0.0],
        "axis": [1.0, 0.0, 0.0],
        "force_n": [-10.0, 10.0],
        "model": {"type": "power_law", "forward": 1.0, "reverse": 1.0, "exponent": 1.5},
        "dead_band_n": 2.0,
        "rate_n_s": 8.0,
    }
    allocator = Allocator(parse_layout(layout_of("one", [thruster])), period_s=PERIOD_S)
    previous = np.zeros((1, 3))
    forces = []
    for _ in range(6):
        answer = allocator.allocate([4.0, 0.0, 0.0, 0.0, 0.0, 0.0], previous=previous)
        forces.append(float(answer.wrench[0]))
        previous = answer.command
    assert forces[:2] == [0.0, 0.0] and forces[-1] == pytest.approx(4.0, abs=1e-6)
    assert (np.diff(forces) >= 0.0).all()
