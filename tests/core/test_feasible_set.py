"""What may be given in a tick: the forces of commands that drives can reach, and what turning costs
there."""

import ctypes
import math

import numpy as np
import pytest

from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.layout import Azimuth, Layout, Thruster
from tests.core.internal_functions import (
    FIN,
    POD,
    ROBOTS,
    STEERED,
    Robot,
    Set,
    Work,
    at,
    functions,
    in_the_core,
    prepared_work,
    question_of,
    robot_of,
)

PERIOD_S = 0.1
"""Length of a tick [s]."""
LEAST_POWER = 1e-3
"""Share of full power that counts as mean power at least."""


def commands_before(robot: Robot, rng: np.random.Generator) -> Array:
    """Commands (n, 3) of a tick before, some of them at a limit."""
    lower = robot.actuators["command_min"]
    upper = robot.actuators["command_max"]
    share = rng.random(lower.shape)
    share = np.where(rng.random(share.shape) < 0.15, np.round(share), share)
    return np.ascontiguousarray(np.minimum(lower + share * (upper - lower), upper))


def given_in_box(robot: Robot, i: int, low: Array, high: Array) -> tuple[Array, Array]:
    """Forces (N,) [N] of commands within a box along their directions, and these directions
    [rad]; of a propeller with a rudder thrusts of its slipstream, with no direction in reverse."""
    actuator = robot.actuators[i]
    share = np.stack(np.meshgrid(*3 * [[0.0, 0.25, 0.5, 0.75, 1.0]]), axis=-1).reshape(-1, 3)
    commands = low + share * (high - low)
    force = np.array([robot.force(i, command)[0] for command in commands])
    if actuator["command_kind"] == POD:
        return commands[:, 1], commands[:, 0]
    if actuator["command_kind"] == STEERED:
        slipstream = commands[:, 1] + actuator["pressure_area"]
        return slipstream, np.where(
            slipstream > 0.0, np.arctan2(force[:, 2], force[:, 1]), math.nan
        )
    if actuator["command_kind"] == FIN:
        return np.hypot(force[:, 1], force[:, 2]), np.arctan2(force[:, 2], force[:, 1])
    return (actuator["command_sign"] if actuator["command_kind"] == 0.0 else 1.0) * force[
        :, 0
    ], 0.0 * force[:, 0]


def check_set(robot: Robot, i: int, limits: Set, low: Array, high: Array) -> None:
    """A set has the forces of the commands between two ends, and none else but for a little."""
    actuator = robot.actuators[i]
    size, angle = given_in_box(robot, i, low, high)
    slack = 0.02 * actuator["row_force_max"][0]
    branches = [(limits.force_min, limits.force_max, 0.0)]
    if limits.is_flipped:
        branches = [(-limits.force_max, -limits.force_min, math.pi)]
    elif limits.force_max_reverse > 0.0:
        branches = [(-limits.force_max_reverse, limits.force_max, 0.0)]
    ((force_min, force_max, rotation),) = branches
    band = actuator["dead_band"]
    if band > 0.0 and force_min < band and force_max > -band:
        return  # the band takes some of it: tests of sets have that
    assert size.min() == pytest.approx(force_min, abs=slack)
    assert size.max() == pytest.approx(force_max, abs=slack)
    if robot.is_plane(i) and limits.sector_half_angle < 3.0:
        angle_errors = [
            math.remainder(one - limits.sector_center - rotation, 2.0 * math.pi)
            for one in angle[(np.abs(size) > slack) & np.isfinite(angle)]
        ]
        if angle_errors:
            assert np.abs(angle_errors).max() == pytest.approx(limits.sector_half_angle, abs=1e-3)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("ticks", [1, 4])
def test_a_set_in_a_tick_is_what_commands_near_the_last_ones_give(name: str, ticks: int) -> None:
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([1, number])
        step = robot.layout.rates * PERIOD_S * ticks
        for _ in range(2):
            previous = commands_before(robot, rng)
            box = Rates(robot.plant, step).box(previous)
            sets = robot.sets_now(previous=previous, ticks=ticks)
            for i, limits in enumerate(sets):
                assert limits.turn_cost == 0.0
                actuator = robot.actuators[i]
                whole = (box.lower[i] <= actuator["command_min"]).all() and (
                    box.upper[i] >= actuator["command_max"]
                ).all()
                if whole or actuator["gauge_table"] != 0.0 or actuator["unevenness"] != 0.0:
                    continue  # all that it may give, or another force in each direction
                check_set(robot, i, limits, box.lower[i], box.upper[i])


@pytest.mark.parametrize("name", ["azimuths", "mixed", "pods either way"])
def test_turning_costs_by_the_mean_power_of_the_commands_before(name: str) -> None:
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([2, number])
        full = np.array(
            [
                max(robot.power(i, actuator["force_max"]), robot.power(i, actuator["force_min"]))
                for i, actuator in enumerate(robot.actuators)
            ]
        )
        for scale in (1.0, 0.0):
            previous = commands_before(robot, rng)
            pods = robot.actuators["command_kind"] == POD
            previous[pods, 1] *= scale
            lost = np.arange(robot.n) == robot.n - 1
            power = sum(power_of(robot, i, previous[i]) for i in range(robot.n) if not lost[i])
            mean = max(power, LEAST_POWER * full[~lost].sum()) / (~lost).sum()
            toward = np.where(rng.random(robot.n) < 0.5, np.nan, rng.uniform(-3.0, 3.0, robot.n))
            sets = robot.sets_now(
                previous=previous,
                calm=2.0,
                ticks=3,
                angles_wanted=toward,
                lost=lost.astype(np.uint8),
            )
            for i, limits in enumerate(sets):
                if not pods[i] or lost[i]:
                    assert limits.turn_cost == 0.0
                    continue
                step = robot.layout.rates[i, 0] * PERIOD_S
                assert limits.turn_cost == pytest.approx(2.0 * mean / (3.0 * step), rel=1e-3)
                angle = previous[i, 0] if math.isnan(toward[i]) else toward[i]
                angle_error = math.remainder(
                    limits.turn_origin - angle - math.pi * limits.is_flipped, 2.0 * math.pi
                )
                assert angle_error == pytest.approx(0.0, abs=1e-9)
                assert abs(limits.turn_origin - limits.sector_center) <= math.pi + 1e-9


def power_of(robot: Robot, i: int, command: Array) -> float:
    """Power [W] of a command by the core's tables."""
    actuator = robot.actuators[i]
    force, _ = robot.force(i, command)
    if actuator["command_kind"] == POD:
        size = command[1]
    elif robot.is_plane(i):
        size = math.hypot(force[1], force[2]) / robot.radius(i, math.atan2(force[2], force[1]))
    else:
        size = actuator["command_sign"] * force[0]
    return robot.power(
        i, min(max(float(size), float(actuator["force_min"])), float(actuator["force_max"]))
    )


@pytest.mark.parametrize("name", ["azimuths", "fins", "thrusters"])
def test_what_is_unknown_or_lost_is_no_tick(name: str) -> None:
    robot = robot_of(name)
    rng = np.random.default_rng(3)
    previous = commands_before(robot, rng)
    previous[0] = np.nan
    lost = (np.arange(robot.n) == 1).astype(np.uint8)
    sets = robot.sets_now(previous=previous, calm=2.0, lost=lost)
    whole = robot.sets_now()
    for field in (
        "force_min",
        "force_max",
        "sector_center",
        "sector_half_angle",
        "cost_at_min",
        "cost_at_max",
        "turn_cost",
    ):
        assert getattr(sets[0], field) == getattr(whole[0], field)
    assert sets[1].force_min == sets[1].force_max == sets[1].cost_at_max == 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_a_number_on_a_free_axis_changes_no_command(name: str) -> None:
    """Whatever is asked along an axis that may take any wrench, in a tick and outside."""
    for number in range(2):
        robot = robot_of(name, number)
        rng = np.random.default_rng([5, number])
        free = (np.arange(6) == rng.integers(6)).astype(np.uint8)
        previous = robot.plant.sample(rng, (1,))[0]
        wrench_of_command = robot.plant.wrench(robot.plant.sample(rng, (1,))[0])
        wrench = np.where(free, 0.0, rng.uniform(0.0, 1.0) * wrench_of_command)
        loud = np.where(free, 1e5, wrench)
        for tick in ({}, {"previous": previous}):
            quiet_answer = robot.answer(wrench, free=free, **tick)
            loud_answer = robot.answer(loud, free=free, **tick)
            np.testing.assert_array_equal(loud_answer["command"], quiet_answer["command"])


def multipliers_at_begin(robot: Robot, previous: Array, lost: Array) -> Array | None:
    """Multipliers (6,) in the basis [W] at which a tick begins after a command (n, 3); None where
    it tells none."""
    question, _arrays = question_of(
        np.zeros(6), {"previous": previous, "calm": 2.0, "lost": lost.astype(np.uint8)}
    )
    work = prepared_work(robot.block)
    place = ctypes.c_void_p(question.ctypes.data)
    assert functions().fl_prepare_question(at(robot.block), work, place)
    known = Work.from_buffer(work)
    return np.array(known.lambda_begin) if known.has_lambda_begin else None


def turning_pods(number: int) -> Robot:
    """Four pods that turn all round at a rate and push one way, and two thrusters."""
    rng = np.random.default_rng([8, number])
    law = PowerLaw(0.3)
    pods = [
        Azimuth(
            f"p{k}",
            tuple(rng.uniform(-0.5, 0.5, 3)),
            (0.0, 0.6 * (-1.0) ** k, 0.8),
            (1.0, 0.0, 0.0),
            (0.0, 40.0),
            law,
            turn_rate=1.0,
        )
        for k in range(4)
    ]
    thrusters = [
        Thruster(f"t{k}", tuple(rng.uniform(-0.5, 0.5, 3)), axis, (-40.0, 40.0), law)
        for k, axis in enumerate(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
    ]
    return in_the_core(Layout("pods", (*pods, *thrusters)))


def test_a_tick_begins_at_the_multipliers_of_the_answer_before() -> None:
    """Of actuators within their limits the command says the price: together they say the
    multipliers."""
    judged = 0
    for number in range(4):
        robot = turning_pods(number)
        rng = np.random.default_rng([6, number])
        nothing_lost = np.zeros(robot.n, bool)
        for command in robot.plant.sample(rng, (2,)):
            answer = robot.answer(0.3 * robot.plant.wrench(command))
            size = np.hypot(*answer["force"][: robot.n].T)
            if (size > 38.0).any():
                continue
            previous = np.ascontiguousarray(answer["command"][: robot.n])
            begin = multipliers_at_begin(robot, previous, nothing_lost)
            known: Array = answer["lambda_reduced"]
            assert begin is not None
            np.testing.assert_allclose(begin, known, atol=0.01 * np.abs(known).max())
            judged += 1
    assert judged >= 4


def test_a_robot_at_rest_or_unknown_says_no_multipliers() -> None:
    robot = turning_pods(0)
    nothing_lost = np.zeros(robot.n, bool)
    assert multipliers_at_begin(robot, np.zeros((robot.n, 3)), nothing_lost) is None
    assert multipliers_at_begin(robot, np.full((robot.n, 3), np.nan), nothing_lost) is None
    previous = robot.plant.sample(np.random.default_rng(7), ())
    assert multipliers_at_begin(robot, previous, nothing_lost) is not None
    assert multipliers_at_begin(robot, previous, ~nothing_lost) is None
