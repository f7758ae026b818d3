"""Steps on the commands of foils, beside an enumeration of their deflections: commands give the
wrench, and no others take less power."""

import ctypes
from functools import cache

import numpy as np
import pytest

from finlab import Allocator
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.layout import Thruster
from finlab.layout.layout import Layout
from tests.core.foil_enumeration import commands_on_grid, least_power
from tests.core.internal_functions import (
    MOST,
    REAL,
    Robot,
    Work,
    at,
    functions,
    in_the_core,
    question_of,
)
from tests.sampled_cases import sampled

FLOW = np.array([1.4, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Velocity (6,) through the water [m/s, rad/s]."""
POINTS = 61
"""Deflections of the foil that is enumerated."""
SLACK = 1e-6
"""Share of the least power by which an answer may be above it."""
EXACT = 1e-8
"""Error of commands that needs no further step, over the wrench scale."""
FINE = 1e-5
"""The same where tables leave more."""


@cache
def tail(number: int, stall: float = 0.35) -> Robot:
    """A thruster ahead, and three foils of a tail, for surge, pitch and yaw. They turn beyond
    stall, unless that is at an angle [rad] beyond all."""
    rng = np.random.default_rng([41, number])
    parts: list[Thruster | Rudder] = [
        Thruster("t", (-0.7, 0.0, 0.0), (1.0, 0.0, 0.0), (-40.0, 60.0), PowerLaw(0.4))
    ]
    for k in range(3):
        turn = 2.0 * np.pi / 3.0 * k + rng.uniform(-0.4, 0.4)
        shaft = (0.0, float(np.cos(turn)), float(np.sin(turn)))
        place = (float(rng.uniform(-0.8, -0.5)), 0.1 * shaft[1], 0.1 * shaft[2])
        most = float(rng.uniform(0.5, 0.9))
        area = float(rng.uniform(0.01, 0.03))
        parts.append(
            Rudder(f"r{k}", place, shaft, (1.0, 0.0, 0.0), area, (-most, most), 2.5, stall=stall)
        )
    return in_the_core(Layout("tail", tuple(parts), axes=("Fx", "Ty", "Tz")), FLOW)


@pytest.mark.parametrize("number", sampled(range(6), every=2))
def test_no_deflections_take_less_power_than_an_answer(number: int) -> None:
    robot = tail(number)
    allocator = Allocator(robot.layout)
    rng = np.random.default_rng([1, number])
    wrenches = robot.plant.wrench(robot.plant.sample(rng, (10,)))
    together = allocator.allocate_batch(wrenches, flow=FLOW)
    for k, wrench in enumerate(wrenches):
        answer = allocator.allocate(wrench, flow=FLOW)
        assert answer.err_norm <= 1e-6
        least = least_power(robot.plant, allocator.scale, wrench, [1], POINTS)
        assert answer.power <= least * (1.0 + SLACK)
        assert together.power[k] == pytest.approx(answer.power, rel=1e-9)
        assert together.err_norm[k] == pytest.approx(answer.err_norm, abs=1e-9)


@pytest.mark.parametrize("number", sampled(range(6), every=2))
def test_no_deflections_come_nearer_to_a_wrench_beyond_reach(number: int) -> None:
    """Of foils that do not stall: what others give is no convex set, and the nearest point of it
    that is found may be one of several."""
    robot = tail(number, stall=1.2)
    allocator = Allocator(robot.layout)
    rng = np.random.default_rng([2, number])
    plant = robot.plant
    counts = plant.counts
    shares = np.linspace(0.0, 1.0, 15)
    grid = np.stack(np.meshgrid(*[shares] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
    command = np.zeros((len(grid), plant.n, 3))
    command[..., 0] = plant.lower[:, 0] + grid * plant.width[:, 0]
    given = plant.wrench(command)[:, counts] / allocator.scale[counts]
    beyond = 0
    for wrench in 3.0 * plant.wrench(plant.sample(rng, (6,))):
        answer = allocator.allocate(wrench, flow=FLOW)
        target = wrench[counts] / allocator.scale[counts]
        nearest = np.linalg.norm(given - target, axis=1).min()
        served = (answer.wrench / allocator.scale)[counts]
        distance = np.linalg.norm(served - target)
        assert distance <= nearest * (1.0 + 1e-6)
        beyond += bool(distance > 1e-3)
    assert beyond > 0


@pytest.mark.parametrize("number", range(3))
def test_commands_that_come_to_give_a_wrench_give_it_by_the_plant(number: int) -> None:
    robot = tail(number)
    rng = np.random.default_rng([3, number])
    given = 0
    for command_of_wrench in robot.plant.sample(rng, (20,)):
        wrench = np.where(robot.plant.counts, robot.plant.wrench(command_of_wrench), 0.0)
        memory, target = prepared(robot, wrench)
        begin = np.zeros((MOST, 3))
        begin[: robot.n] = robot.plant.sample(rng, (1,))[0]
        command = begin.copy()
        work = Work.from_buffer(memory)
        box = ctypes.byref(work.box)
        allowed = functions().fl_error_allowed(at(robot.block), memory, box)
        # Four commands and three axes: tables leave nothing that steps could not make up for.
        assert allowed == EXACT
        met = functions().fl_come_to_give(
            at(robot.block), memory, box, at(command), 24, REAL(allowed)
        )
        own = command[: robot.n]
        assert (own >= robot.plant.lower - 1e-12).all()
        assert (own <= robot.plant.upper + 1e-12).all()
        if not met:
            continue
        given += 1
        assert missed_share(robot, own, wrench) <= 1e-5

        cost = power_of(robot, own)
        force = np.zeros((MOST, 2))
        cheaper = command.copy()
        lambda_reduced = np.zeros(6)
        meet = functions().fl_meet_and_cheapen
        cost_after = meet(
            at(robot.block),
            memory,
            at(target),
            REAL(allowed),
            at(lambda_reduced),
            at(cheaper),
            at(force),
        )
        own = cheaper[: robot.n]
        assert cost_after <= cost * (1.0 + 1e-3)
        assert power_of(robot, own) == pytest.approx(cost_after, rel=1e-3, abs=1e-6)
        assert missed_share(robot, own, wrench) <= 1e-5
    assert given >= 5


def prepared(robot: Robot, wrench: Array) -> tuple[ctypes.Array[ctypes.c_char], Array]:
    """A work area for a wrench (6,), and the target (6,) in the basis."""
    memory = robot.work()
    question, _kept = question_of(wrench, {})
    place = ctypes.c_void_p(question.ctypes.data)
    assert functions().fl_prepare_question(at(robot.block), memory, place)
    work = Work.from_buffer(memory)
    work.wrench_wanted[:] = wrench.tolist()
    target = np.zeros(6)
    functions().fl_reduce_wrench(memory, at(wrench - np.array(work.span.wrench_offset)), at(target))
    return memory, target


def missed_share(robot: Robot, command: Array, wrench: Array) -> float:
    """What commands (n, 3) miss of a wrench (6,) by the plant, over its size: grids of the laws are
    within FINE of it."""
    off = (robot.plant.wrench(np.ascontiguousarray(command)) - wrench)[robot.plant.counts]
    return float(np.linalg.norm(off) / np.linalg.norm(wrench))


def power_of(robot: Robot, command: Array) -> float:
    """Power [W] of commands (n, 3) by the plant."""
    return float(robot.plant.power(np.ascontiguousarray(command)).sum())


def test_steps_end_where_no_deflections_nearby_take_less() -> None:
    """From commands that give the wrench, with the multipliers that steps find for themselves."""
    gains = []
    for number in range(3):
        robot = tail(number)
        plant = robot.plant
        scale = np.array(robot.head["wrench_scale"])
        rng = np.random.default_rng([4, number])
        for command_of_wrench in plant.sample(rng, (8,)):
            wrench = np.where(plant.counts, plant.wrench(command_of_wrench), 0.0)
            memory, target = prepared(robot, wrench)
            command = np.zeros((MOST, 3))
            command[: robot.n] = command_of_wrench
            force = np.zeros((MOST, 2))
            functions().fl_meet_and_cheapen(
                at(robot.block),
                memory,
                at(target),
                REAL(EXACT),
                at(np.zeros(6)),
                at(command),
                at(force),
            )
            own = command[: robot.n]
            near = own[1, 0] + np.linspace(-0.01, 0.01, 21)[:, None] * plant.width[1, 0]
            near = np.clip(near, plant.lower[1, 0], plant.upper[1, 0])
            others = commands_on_grid(plant, scale, wrench, [1], [0, 2, 3], near)
            is_near = np.abs(others - own)[..., 0] <= 0.05 * plant.width[:, 0]
            powers = plant.power(others[is_near.all(axis=1)]).sum(axis=-1)
            if len(powers):
                gains.append(1.0 - powers.min() / power_of(robot, own))
    assert len(gains) >= 12
    # A few end by the bound on their number; an answer has several starts.
    assert np.mean(np.array(gains) > 1e-5) <= 0.15
    assert max(gains) <= 0.05


def test_fewer_commands_than_directions_may_be_off_by_what_tables_are() -> None:
    robot = tail(0)
    wrench = np.zeros(6)
    memory, _target = prepared(robot, wrench)
    work = Work.from_buffer(memory)
    box = work.box
    for held in range(robot.n):
        allowed = functions().fl_error_allowed(at(robot.block), memory, ctypes.byref(box))
        assert allowed == (EXACT if robot.n - held >= 3 else FINE)
        box.command_min[held][0] = 0.0
        box.command_max[held][0] = 0.0
