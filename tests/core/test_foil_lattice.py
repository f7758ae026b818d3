"""The lattice of foils' angles at which searches for commands begin, against the plant and
numpy."""

import ctypes
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.layout.load import parse_layout
from tests.core.internal_functions import (
    MOST,
    REAL,
    Box,
    Robot,
    Set,
    Work,
    at,
    functions,
    in_the_core,
    question_of,
)
from tests.random_robots import layout_of, random_flow, random_robot

FOILS = 6
"""Foils on the lattice at most: LATTICE_FOILS."""
NODES = 48
"""Nodes of all foils at most: LATTICE_NODES."""
STARTS = 60
"""Points of the lattice that are returned at most: FL_LATTICE_STARTS."""
POINTS = 4096
"""Points of the lattice at most: LATTICE of foil_lattice.c."""
NODES_OF_BRANCH = 6
"""Nodes of a branch at most: EACH_MOST of foil_lattice.c."""
MISS_WEIGHT = 12.0
"""Cost of a missed scaled wrench of size 1, over the largest cost of all actuators."""
ROBOTS = range(4)
"""Numbers of the robots."""


class Lattice(ctypes.Structure):
    """The angles of all foils: `foil_lattice`."""

    _fields_ = [
        ("foils", ctypes.c_int),
        ("foil", ctypes.c_int * FOILS),
        ("branches", ctypes.c_int * FOILS),
        ("first", ctypes.c_int * FOILS),
        ("each", ctypes.c_int),
        ("edge", REAL * 5 * FOILS),
        ("angle", REAL * NODES),
        ("cost", REAL * NODES),
        ("wrench", REAL * 6 * NODES),
        ("row", REAL * 6 * 2 * MOST),
    ]


class Point(ctypes.Structure):
    """One node of each foil: `lattice_point`."""

    _fields_ = [("node", ctypes.c_ubyte * FOILS), ("cost", REAL)]


@dataclass(frozen=True)
class Laid:
    """A lattice of a robot, and the work area in which it was laid."""

    robot: Robot
    work: Any
    lattice: Lattice

    @property
    def sets(self) -> list[Set]:
        """What each actuator may give."""
        return list(Work.from_buffer(self.work).set[: self.robot.n])

    @property
    def power_cost_max(self) -> float:
        """The largest cost of all sets [W]."""
        return float(Work.from_buffer(self.work).power_cost_max)  # type: ignore[attr-defined]

    @property
    def foil(self) -> list[int]:
        """Numbers of the foils."""
        return list(self.lattice.foil[: self.lattice.foils])

    def nodes(self, f: int) -> range:
        """Nodes of a foil."""
        first = self.lattice.first[f]
        return range(first, first + self.lattice.branches[f] * self.lattice.each)

    def choices(self) -> list[tuple[int, ...]]:
        """Every choice of one branch of each foil."""
        branches = [range(self.lattice.branches[f]) for f in range(self.lattice.foils)]
        return list(product(*branches))

    def points_of(self, choice: tuple[int, ...]) -> Array:
        """All points (N, foils) of a choice of branches, by their nodes."""
        each = self.lattice.each
        nodes = []
        for f, branch in enumerate(choice):
            begin = self.lattice.first[f] + branch * each
            nodes.append(range(begin, begin + each))
        return np.array(list(product(*nodes)))

    def target(self, wrench: Array) -> Array:
        """A wrench (6,) over the wrench scale, in the basis of driven directions (6,)."""
        reduced = np.zeros(6)
        functions().fl_reduce_wrench(self.work, at(np.ascontiguousarray(wrench)), at(reduced))
        return reduced

    def cheapest(self, target: Array) -> list[Point]:
        """Points that the core has for a target (6,)."""
        points = (Point * STARTS)()
        count = functions().fl_cheapest_points(
            at(self.robot.block), self.work, ctypes.byref(self.lattice), at(target), None, points
        )
        return list(points[:count])


@cache
def laid(number: int) -> Laid:
    """The lattice of a robot with rudders that stall (odd numbers: none does), thrusters and
    pods; of the last one a rudder is lost."""
    mapping = random_robot("rudders", number, 71)
    actuators = list(mapping["actuators"])
    if number % 2 == 0:
        for one in actuators:
            if one["type"] == "rudder":
                one["deflection_deg"] = [-50.0, 40.0]
    for k, pod in enumerate(random_robot("azimuths", number, 71)["actuators"]):
        actuators.append(pod | {"name": f"p{k}"})
    robot = in_the_core(
        parse_layout(layout_of("mixed", actuators)), random_flow("rudders", number, 71)
    )
    lost = np.zeros(robot.n, np.uint8)
    if number == ROBOTS[-1]:
        lost[0] = 1
    work = robot.work()
    question, _arrays = question_of(np.zeros(6), {"lost": lost})
    place = ctypes.c_void_p(question.ctypes.data)
    assert functions().fl_prepare_question(at(robot.block), work, place)
    lattice = Lattice()
    functions().fl_lay_lattice(at(robot.block), work, ctypes.byref(lattice))
    return Laid(robot, work, lattice)


def effectiveness(one: Laid) -> Array:
    """Scaled wrench in the basis (n, 2, 6) of a newton along each row."""
    return np.array(Work.from_buffer(one.work).span.effectiveness_reduced)[: one.robot.n]


def forces_of_others(one: Laid, wrench: Array) -> tuple[Array, Array]:
    """Forces (N, n, 2) of the other actuators for wrenches (N, 6) in the basis by y = g B' H^-1 r,
    held to their largest forces, and what these cost (N,) [W]."""
    B = effectiveness(one)
    own = one.robot.actuators
    gain = own["secant"].copy()
    gain[one.foil] = 0.0
    gain[own["flow_speed"] > 0.0] = 0.0
    single = own["rows"] == 1.0
    gain[single, 1] = 0.0
    H = np.einsum("nr,nrj,nrk->jk", gain, B, B)
    H += 1e-9 * np.trace(H) * np.eye(6)
    force = gain * np.einsum("nrj,jk,pk->pnr", B, np.linalg.inv(H), wrench)
    cost = np.zeros(len(wrench))
    for i, limits in enumerate(one.sets):
        if own[i]["flow_speed"] > 0.0:
            continue
        if one.robot.is_plane(i):
            wanted = np.linalg.norm(force[:, i], axis=1)
            size = np.minimum(wanted, max(limits.force_max, limits.force_max_reverse))
            force[:, i] *= (size / np.maximum(wanted, 1e-300))[:, None]
        else:
            force[:, i, 0] = np.clip(force[:, i, 0], limits.force_min, limits.force_max)
            size = np.abs(force[:, i, 0])
        full = max(limits.cost_at_min, limits.cost_at_max)
        cost += full * (size / own[i]["row_force_max"][0]) ** 1.5
    return force, cost


def costs(one: Laid, points: Array, target: Array) -> Array:
    """Costs (N,) [W] of points (N, foils) for a target (6,)."""
    wrench = np.array(one.lattice.wrench)
    left = target - wrench[points].sum(axis=1)
    force, cost = forces_of_others(one, left)
    miss = left - np.einsum("pnr,nrj->pj", force, effectiveness(one))
    cost += np.array(one.lattice.cost)[points].sum(axis=1)
    miss_cost = MISS_WEIGHT * one.power_cost_max
    return np.asarray(cost + miss_cost * np.linalg.norm(miss, axis=1))


def targets(one: Laid, number: int) -> list[Array]:
    """Targets (6,) in the basis: of commands, and of the same a few times as far."""
    rng = np.random.default_rng([3, number])
    made = []
    for times in (0.3, 1.0, 3.0):
        command = one.robot.plant.sample(rng, (1,))[0]
        made.append(one.target(times * one.robot.plant.wrench(command)))
    return made


@pytest.mark.parametrize("number", ROBOTS)
def test_branches_end_where_lift_turns_back_and_at_limits(number: int) -> None:
    one = laid(number)
    own = one.robot.actuators
    works = np.array(Work.from_buffer(one.work).span.is_lost)[: one.robot.n] == 0
    assert one.foil == np.flatnonzero((own["flow_speed"] > 0.0) & works).tolist()
    branches = []
    for f, i in enumerate(one.foil):
        low = own[i]["command_min"][0]
        high = own[i]["command_max"][0]
        table = one.robot.table(own[i]["command_table"])
        stall = table[2 * int(table[0])]
        zero = own[i]["zero_lift_angle"]
        inner = [angle for angle in (zero - stall, zero, zero + stall) if low < angle < high]
        expected = [low, *inner, high]
        branches.append(len(expected) - 1)
        assert one.lattice.branches[f] == branches[-1]
        np.testing.assert_allclose(one.lattice.edge[f][: len(expected)], expected, rtol=1e-12)
    choices = np.prod(branches)
    fitting = [
        each
        for each in range(1, NODES_OF_BRANCH + 1)
        if choices * each ** len(branches) <= POINTS and sum(branches) * each <= NODES
    ]
    assert one.lattice.each == max(fitting)


@pytest.mark.parametrize("number", ROBOTS)
def test_nodes_are_middles_of_equal_parts_and_give_what_the_plant_gives(number: int) -> None:
    one = laid(number)
    plant = one.robot.plant
    each = one.lattice.each
    begin = 0
    rest = plant.sample(np.random.default_rng(1), (1,))[0]
    for f, i in enumerate(one.foil):
        assert one.lattice.first[f] == begin
        begin += one.lattice.branches[f] * each
        wrenches = []
        for node in one.nodes(f):
            branch, part = divmod(node - one.lattice.first[f], each)
            low = one.lattice.edge[f][branch]
            high = one.lattice.edge[f][branch + 1]
            angle = low + (high - low) * (2.0 * part + 1.0) / (2.0 * each)
            assert one.lattice.angle[node] == pytest.approx(angle, abs=1e-12)
            command = rest.copy()
            command[i, 0] = angle
            power = plant.power(command)[i]
            assert one.lattice.cost[node] == pytest.approx(power, rel=2e-3, abs=1e-6)
            wrenches.append(one.target(plant.wrench(command)))
        given = np.array(one.lattice.wrench)[one.nodes(f)]
        # What else gives a wrench is the same at all nodes.
        expected = np.array(wrenches) - wrenches[0]
        slack = 2e-3 * np.abs(given).max()
        np.testing.assert_allclose(given - given[0], expected, atol=slack)
        force = np.zeros((len(given), 2))
        for k, node in enumerate(one.nodes(f)):
            command = np.array([one.lattice.angle[node], 0.0, 0.0])
            force[k] = one.robot.force(i, command)[0][:2]
        np.testing.assert_allclose(given, force @ effectiveness(one)[i], atol=1e-12)


@pytest.mark.parametrize("number", ROBOTS)
def test_points_are_the_cheapest_of_each_choice_of_branches(number: int) -> None:
    one = laid(number)
    for target in targets(one, number):
        least = []
        for choice in one.choices():
            least.append(costs(one, one.points_of(choice), target).min())
        least = sorted(least)[:STARTS]
        points = one.cheapest(target)
        assert len(points) == len(least)
        found = [point.cost for point in points]
        np.testing.assert_allclose(found, least, rtol=1e-6)
        assert found == sorted(found)
        chosen = np.array([point.node[: one.lattice.foils] for point in points])
        np.testing.assert_allclose(costs(one, chosen, target), found, rtol=1e-6)
        first = np.array(one.lattice.first[: one.lattice.foils])
        assert len({tuple(row) for row in (chosen - first) // one.lattice.each}) == len(points)


@pytest.mark.parametrize("number", ROBOTS)
def test_commands_of_a_point_have_its_angles_within_their_branches(number: int) -> None:
    one = laid(number)
    block = at(one.robot.block)
    for target in targets(one, number):
        for point in one.cheapest(target)[:6]:
            box = one.robot.whole_box()
            before = bytes(box)
            unchanged = Box.from_buffer_copy(before)
            command = np.zeros((MOST, 3))
            arguments = (ctypes.byref(one.lattice), at(target), ctypes.byref(point))
            functions().fl_commands_of_point(
                block, one.work, *arguments, ctypes.byref(box), at(command)
            )
            nodes = np.array(point.node[: one.lattice.foils])
            left = target - np.array(one.lattice.wrench)[nodes].sum(axis=0)
            force, _ = forces_of_others(one, left[None])
            given = np.zeros((MOST, 2))
            given[: one.robot.n] = force[0]
            expected = np.zeros((MOST, 3))
            functions().fl_commands_for_forces(
                block, ctypes.byref(one.robot.whole_box()), at(given), None, at(expected)
            )
            for f, i in enumerate(one.foil):
                node = point.node[f]
                branch = (node - one.lattice.first[f]) // one.lattice.each
                expected[i, 0] = one.lattice.angle[node]
                unchanged.command_min[i][0] = one.lattice.edge[f][branch]
                unchanged.command_max[i][0] = one.lattice.edge[f][branch + 1]
                assert box.command_min[i][0] < command[i, 0] < box.command_max[i][0]
            np.testing.assert_allclose(command, expected, atol=1e-6)
            assert bytes(box) == bytes(unchanged)
