"""Where the lift of foils whose drag is welcome jumps along a step of multipliers: the dual is
largest there, beside what samples of the step say."""

import ctypes
from typing import Any

import numpy as np
import pytest

from finlab.actuators.rudder import Rudder
from finlab.arrays import Array
from finlab.layout.layout import Layout
from tests.core.internal_functions import (
    REAL,
    Robot,
    State,
    Work,
    at,
    functions,
    in_the_core,
    question_of,
)
from tests.core.test_foil_tangent import foils_of

SAMPLES = 2001
"""Shares of a step at which the dual is sampled."""
SOFTENED = 1e-3
"""Most that a softened response, on the chord of a foil's power, is off at its jump, over the
largest cost of all."""
FLOW = np.array([1.5, 0.1, -0.2, 0.0, 0.0, 0.0])
"""Velocity (6,) through the water [m/s, rad/s]."""


def foils_alone(number: int) -> Robot:
    """Four foils that do not stall, whose drag is all that slows the robot down."""
    rng = np.random.default_rng([21, number])
    foils = []
    for k in range(4):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        x, y, z = rng.uniform(-0.6, 0.6, 3).tolist()
        shaft = (0.0, float(np.cos(turn)), float(np.sin(turn)))
        most = float(rng.uniform(0.2, 0.35))
        foils.append(
            Rudder(f"f{k}", (x, y, z), shaft, (1.0, 0.0, 0.0), 0.03, (-most, most), 2.5, stall=0.5)
        )
    return in_the_core(Layout("foils", tuple(foils)), FLOW)


def prepared(robot: Robot) -> ctypes.Array[ctypes.c_char]:
    """A work area for a question to a robot without a wrench."""
    memory = robot.work()
    question, _kept = question_of(np.zeros(6), {})
    address = ctypes.c_void_p(question.ctypes.data)
    assert functions().fl_prepare_question(at(robot.block), memory, address) == 1
    return memory  # type: ignore[no-any-return]


def dual_at(robot: Robot, memory: Any, target: Array, multipliers: Array) -> State:
    """The dual of a target (6,) at multipliers (6,), both in the basis."""
    state = State()
    functions().fl_dual_at(
        at(robot.block), memory, at(target), at(multipliers), ctypes.byref(state)
    )
    return state


def welcome_multipliers(robot: Robot, memory: Any, rng: np.random.Generator) -> Array | None:
    """Multipliers (6,) [W] at which drag is worth more than it costs; None where drawing found
    none."""
    columns = np.array(Work.from_buffer(memory).span.effectiveness_reduced)[: robot.n]
    speeds = robot.actuators["flow_speed"]
    for _ in range(200):
        unit = rng.normal(size=6)
        of_drag = columns[:, 1] @ unit
        if (of_drag > 0.0).all():
            return np.asarray(unit * rng.uniform(1.3, 3.0) * (speeds / of_drag).max())
    return None


@pytest.mark.parametrize("number", range(4))
def test_drag_is_welcome_where_more_lift_either_way_is_worth_more(number: int) -> None:
    robot = foils_alone(number)
    memory = prepared(robot)
    columns = np.array(Work.from_buffer(memory).span.effectiveness_reduced)[: robot.n]
    rng = np.random.default_rng([1, number])
    seen = set()
    for _ in range(60):
        multipliers = rng.normal(size=6) * 10.0 ** rng.uniform(-1.0, 2.5)
        is_any_convex = False
        for i in foils_of(robot):
            own = robot.actuators[i]
            prices = columns[i] @ multipliers
            lifts = np.array([-0.2, 0.0, 0.2]) * own["row_force_max"][0]
            drag = np.array([robot.drag(i, lift) for lift in lifts])
            worth = prices[0] * lifts + (prices[1] - own["flow_speed"]) * drag
            bend = worth[0] - 2.0 * worth[1] + worth[2]
            is_any_convex |= bool(bend > 0.0)
        welcome = functions().fl_is_drag_welcome(at(robot.block), memory, at(multipliers))
        assert bool(welcome) is is_any_convex
        seen.add(is_any_convex)
    assert seen == {False, True}


@pytest.mark.parametrize("number", range(6))
def test_a_step_ends_at_the_jump_where_the_dual_is_largest(number: int) -> None:
    robot = foils_alone(number)
    memory = prepared(robot)
    block = at(robot.block)
    rng = np.random.default_rng([2, number])
    jumps = 0
    for _ in range(40):
        begin = welcome_multipliers(robot, memory, rng)
        end = welcome_multipliers(robot, memory, rng)
        if begin is None or end is None:
            continue
        middle = dual_at(robot, memory, np.zeros(6), 0.5 * (begin + end))
        # A target that the forces in the middle of the step nearly give: the dual rises there.
        target = -np.array(middle.residual) + 1e-3 * rng.normal(size=6)
        step = end - begin
        first = dual_at(robot, memory, target, begin)
        last = dual_at(robot, memory, target, end)
        slope = float(step @ np.array(first.residual))
        if not slope > 0.0:
            continue
        found = functions().fl_go_to_jump(
            block,
            memory,
            at(target),
            at(step),
            REAL(slope),
            ctypes.byref(first),
            ctypes.byref(last),
        )
        values = [
            dual_at(robot, memory, target, begin + share * step).dual_value
            for share in np.linspace(0.0, 1.0, SAMPLES)
        ]
        slack = SOFTENED * Work.from_buffer(memory).power_cost_max
        is_largest_inside = max(values) > max(values[0], values[-1]) + slack
        if found:
            jumps += 1
            # Drag is convex in lift: between its jumps a response stays at an end, so that the dual
            # is linear, and largest at a jump.
            assert last.dual_value >= max(values) - slack
        else:
            assert not is_largest_inside
    assert jumps >= 3


def test_there_is_no_jump_where_drag_costs() -> None:
    robot = foils_alone(0)
    memory = prepared(robot)
    rng = np.random.default_rng(4)
    for _ in range(20):
        begin = rng.normal(size=6) * 1e-3
        step = rng.normal(size=6) * 1e-3
        first = dual_at(robot, memory, np.zeros(6), begin)
        last = dual_at(robot, memory, np.zeros(6), begin + step)
        before = bytes(last)
        found = functions().fl_go_to_jump(
            at(robot.block),
            memory,
            at(np.zeros(6)),
            at(step),
            REAL(1.0),
            *map(ctypes.byref, (first, last)),
        )
        assert found == 0 and bytes(last) == before
