"""Foils that may stall, where a wrench is beyond reach: their whole curve counts, beside what an
enumeration of all commands finds."""

import ctypes
from functools import cache

import numpy as np
import pytest

from finlab import Allocator
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.layout import Thruster
from finlab.layout.layout import Layout
from tests.core.foil_enumeration import Reach
from tests.core.internal_functions import ARCS, MOST, Robot, Work, at, functions, in_the_core
from tests.core.test_foil_steps import prepared
from tests.core.test_foil_tangent import foils_of, tangent_at
from tests.sampled_cases import sampled

POINTS = 15
"""Of each of four commands in an enumeration."""
SLACK = 1e-3
"""Share of the least distance by which an answer may be farther."""
ROUNDING = 1e-5
"""Share of a target that counts as no distance: what steps along a fold of a sheet leave."""
ARC_POINTS = 96
"""Intervals of an arc: FL_ARC_POINTS."""
WRENCHES = 4
"""Targets of each robot."""


@cache
def tail(number: int, foils: int) -> tuple[Robot, Array]:
    """Foils of a tail that turn beyond stall, of three with a thruster ahead, and its velocity (6,)
    through the water, 0.7 to 2.5 m/s."""
    rng = np.random.default_rng([51, number, foils])
    parts: list[Thruster | Rudder] = []
    if foils == 3:
        ahead = (1.0, 0.0, 0.0)
        parts.append(Thruster("t", (-0.7, 0.0, 0.0), ahead, (-40.0, 60.0), PowerLaw(0.4)))
    for k in range(foils):
        turn = 2.0 * np.pi / foils * k + rng.uniform(-0.4, 0.4)
        shaft = (0.0, float(np.cos(turn)), float(np.sin(turn)))
        place = (float(rng.uniform(-0.8, -0.5)), 0.1 * shaft[1], 0.1 * shaft[2])
        most = float(rng.uniform(0.5, 0.9))
        area = float(rng.uniform(0.01, 0.03))
        stall = float(rng.uniform(0.25, 0.45))
        parts.append(
            Rudder(f"r{k}", place, shaft, (1.0, 0.0, 0.0), area, (-most, most), 2.5, stall=stall)
        )
    axes = ("Fx", "Ty", "Tz") if foils == 3 else ("Fx", "Tx", "Ty", "Tz")
    flow = np.array([rng.uniform(0.7, 2.5), 0.0, 0.0, 0.0, 0.0, 0.0])
    return in_the_core(Layout("tail", tuple(parts), axes=axes), flow), flow


def beyond(robot: Robot, number: int) -> Array:
    """Wrenches (N, 6) [N, N m] of random commands, times 1.3 or 3, in axes that count."""
    rng = np.random.default_rng([1, number])
    wrenches = robot.plant.wrench(robot.plant.sample(rng, (WRENCHES,)))
    times = np.where(np.arange(WRENCHES) % 2 == 0, 1.3, 3.0)
    return np.asarray(np.where(counts_of(robot), times[:, None] * wrenches, 0.0))


def counts_of(robot: Robot) -> Array:
    """Which axes (6,) a robot commands."""
    return np.isin(AXES, robot.layout.axes)


CASES = [pytest.param(number, foils) for number in range(12) for foils in (3, 4)]
"""Numbers of robots, and how many foils each has."""


@pytest.mark.parametrize(("number", "foils"), sampled(CASES, every=6))
def test_no_deflections_come_nearer_to_a_wrench_beyond_reach(number: int, foils: int) -> None:
    robot, flow = tail(number, foils)
    allocator = Allocator(robot.layout)
    axes = counts_of(robot)
    reach = Reach(robot.plant, allocator.scale, axes, POINTS)
    wrenches = beyond(robot, number)
    together = allocator.allocate_batch(wrenches, flow=flow)
    for k, wrench in enumerate(wrenches):
        answer = allocator.allocate(wrench, flow=flow)
        target = (wrench / allocator.scale)[axes]
        distance = np.linalg.norm((answer.wrench / allocator.scale)[axes] - target)
        least = reach.least_distance(target)
        assert distance <= least * (1.0 + SLACK) + ROUNDING * np.linalg.norm(target)
        np.testing.assert_allclose(together.wrench[k], answer.wrench, rtol=1e-9, atol=1e-9)
        assert together.power[k] == pytest.approx(answer.power, rel=1e-9)


@pytest.mark.parametrize(("number", "foils"), sampled(CASES, every=6))
def test_no_deflections_give_a_larger_share_of_a_wrench(number: int, foils: int) -> None:
    robot, flow = tail(number, foils)
    allocator = Allocator(robot.layout)
    axes = counts_of(robot)
    reach = Reach(robot.plant, allocator.scale, axes, POINTS)
    for wrench in beyond(robot, number):
        answer = allocator.allocate(wrench, policy="direction", flow=flow)
        target = (wrench / allocator.scale)[axes]
        given = (answer.wrench / allocator.scale)[axes]
        share = given @ target / (target @ target)
        assert np.linalg.norm(given - share * target) <= 1e-6 * np.linalg.norm(target)
        assert share >= reach.largest_share(target) * (1.0 - SLACK)


@pytest.mark.parametrize(("number", "foils"), sampled(CASES, every=6))
def test_no_deflections_come_nearer_in_the_first_group_of_axes(number: int, foils: int) -> None:
    robot, flow = tail(number, foils)
    allocator = Allocator(robot.layout)
    moments = counts_of(robot) & np.isin(AXES, ("Tx", "Ty", "Tz"))
    reach = Reach(robot.plant, allocator.scale, moments, POINTS)
    for wrench in beyond(robot, number):
        answer = allocator.allocate(wrench, policy="priority", flow=flow)
        target = (wrench / allocator.scale)[moments]
        distance = np.linalg.norm((answer.wrench / allocator.scale)[moments] - target)
        least = reach.least_distance(target)
        assert distance <= least * (1.0 + SLACK) + ROUNDING * np.linalg.norm(target)


def test_no_commands_for_the_nearest_wrench_take_less_power() -> None:
    """Asked for the wrench that an answer gives, a robot finds hardly anything cheaper."""
    asked = 0
    for number in range(8):
        for foils in (3, 4):
            robot, flow = tail(number, foils)
            allocator = Allocator(robot.layout)
            for wrench in beyond(robot, number):
                answer = allocator.allocate(wrench, flow=flow)
                again = allocator.allocate(answer.wrench, flow=flow)
                if answer.reachable or not again.reachable:
                    continue
                asked += 1
                assert answer.power <= again.power * (1.0 + 1e-4)
    assert asked >= 10


def laid(robot: Robot) -> tuple[Work, ctypes.Array[ctypes.c_char]]:
    """A work area where foils have their arcs."""
    memory, _target = prepared(robot, np.zeros(6))
    functions().fl_lay_arcs(at(robot.block), memory)
    return Work.from_buffer(memory), memory


@pytest.mark.parametrize("number", range(3))
def test_the_farthest_force_of_an_arc_is_that_of_the_best_angle(number: int) -> None:
    robot, _flow = tail(number, 4)
    work, _memory = laid(robot)
    rng = np.random.default_rng([2, number])
    for i in foils_of(robot):
        low, high = robot.plant.lower[i, 0], robot.plant.upper[i, 0]
        angles = np.linspace(low, high, ARC_POINTS + 1)
        forces = np.array([tangent_at(robot, i, angle).force[:] for angle in angles])
        for _ in range(20):
            price = rng.normal(size=2)
            force = np.zeros(2)
            functions().fl_farthest_on_arc(ctypes.byref(work.set[i]), at(price), at(force))
            assert price @ force == pytest.approx((forces @ price).max(), rel=1e-9)


@pytest.mark.parametrize("number", range(3))
def test_a_cut_leaves_parts_of_an_arc_that_have_all_angles(number: int) -> None:
    robot, _flow = tail(number, 4)
    work, _memory = laid(robot)
    rng = np.random.default_rng([3, number])
    narrow = functions().fl_narrow_arc
    for i in foils_of(robot):
        whole = work.set[i]
        for _ in range(20):
            a, b = rng.uniform(robot.plant.lower[i, 0], robot.plant.upper[i, 0], 2)
            between = 0.5 * (
                np.array(tangent_at(robot, i, a).force[:])
                + np.array(tangent_at(robot, i, b).force[:])
            )
            below, above = type(whole).from_buffer_copy(whole), type(whole).from_buffer_copy(whole)
            narrow(ctypes.byref(below), at(between), -1)
            narrow(ctypes.byref(above), at(between), 1)
            assert below.arc_first == whole.arc_first and above.arc_last == whole.arc_last
            assert below.arc_last == above.arc_first
            shorter = min(below.arc_last - below.arc_first, above.arc_last - above.arc_first)
            assert shorter >= (whole.arc_last - whole.arc_first) // 4


def test_commands_on_arcs_have_the_angle_of_their_force_beyond_stall() -> None:
    robot, _flow = tail(0, 4)
    _work, memory = laid(robot)
    rng = np.random.default_rng(4)
    for share in rng.random((20, robot.n)):
        angle = robot.plant.lower[:, 0] + share * robot.plant.width[:, 0]
        force = np.zeros((MOST, 2))
        command = np.zeros((MOST, 3))
        for i in range(robot.n):
            force[i] = tangent_at(robot, i, float(angle[i])).force[:]
        functions().fl_commands_on_arcs(at(robot.block), memory, at(force), at(command))
        step = robot.plant.width[:, 0] / ARC_POINTS
        assert (np.abs(command[: robot.n, 0] - angle) <= step).all()


def test_more_foils_than_have_arcs_are_answered_all_the_same() -> None:
    rng = np.random.default_rng(5)
    parts = [
        Rudder(
            f"r{k}",
            (float(x), float(y), float(z)),
            (0.0, float(np.cos(turn)), float(np.sin(turn))),
            (1.0, 0.0, 0.0),
            0.01,
            (-0.9, 0.7),
            2.5,
        )
        for k, (x, y, z, turn) in enumerate(rng.uniform(-1.0, 1.0, (ARCS + 3, 4)))
    ]
    flow = np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    layout = Layout("foils", tuple(parts), axes=("Fx", "Ty", "Tz"))
    allocator = Allocator(layout)
    robot = in_the_core(layout, flow)
    wrench = 4.0 * robot.plant.wrench(robot.plant.sample(rng, ()))
    for policy in ("closest", "direction", "priority"):
        answer = allocator.allocate(wrench, policy=policy, flow=flow)
        assert not answer.reachable and np.isfinite(answer.power)
        np.testing.assert_allclose(
            robot.plant.wrench(answer.command)[[0, 4, 5]], answer.wrench[[0, 4, 5]], atol=1e-9
        )
