"""Vertices of the lifts that the dual leaves between their ends: foils at ends, and a wrench that
stays, or that others make up for."""

import ctypes
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.layout import Thruster
from finlab.layout.layout import Layout
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

FOILS = 6
"""Foils between their ends at most: VERTEX_FOILS."""
FLOW = np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Velocity (6,) through the water [m/s, rad/s]."""


class Vertices(ctypes.Structure):
    """Foils between their ends: `foil_vertices`."""

    _fields_ = [
        ("foils", ctypes.c_int),
        ("foil", ctypes.c_int * FOILS),
        ("column", REAL * 6 * FOILS),
        ("size", REAL * FOILS),
        ("directions", ctypes.c_int),
        ("count", ctypes.c_int),
    ]


@dataclass(frozen=True)
class Found:
    """What the dual leaves of a robot that brakes."""

    robot: Robot
    memory: Any
    vertices: Vertices
    force: Array
    """Forces (n, 2) [N] of the dual."""
    movable: Array
    """Columns (6, k) of the effectiveness of other actuators whose forces still move."""
    chord: Array
    """Wrench (n, 6) in the basis by the lift of each foil along the chord of its curve."""

    def at_vertex(self, vertex: int) -> tuple[Array, Array]:
        """Forces (n, 2) at a vertex, and which of the foils are held at an end."""
        force = np.zeros((MOST, 2))
        force[: self.robot.n] = self.force
        held = np.zeros(FOILS, np.uint8)
        functions().fl_go_to_vertex(
            self.memory,
            ctypes.byref(self.vertices),
            vertex,
            ctypes.c_void_p(held.ctypes.data),
            at(force),
        )
        return force[: self.robot.n], held[: self.vertices.foils] != 0


def pairs_of_rudders(seed: int, pairs: int) -> Robot:
    """Pairs of rudders with the same effect, each beside a plane through the robot's middle, which
    brake it, and a thruster ahead that cannot."""
    rng = np.random.default_rng([31, seed])
    parts: list[Any] = []
    for pair in range(pairs):
        turn = rng.uniform(0.0, np.pi)
        shaft = (0.0, float(np.cos(turn)), float(np.sin(turn)))
        x = float(rng.uniform(-0.8, -0.4))
        most = float(rng.uniform(0.25, 0.4))
        for side in (-1.0, 1.0):
            place = (x, 0.1 * side * shaft[1], 0.1 * side * shaft[2])
            parts.append(
                Rudder(
                    f"r{pair}{side:+.0f}",
                    place,
                    shaft,
                    (1.0, 0.0, 0.0),
                    0.02,
                    (-most, most),
                    2.5,
                    stall=0.6,
                )
            )
    thruster = Thruster("t", (-0.7, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 40.0), PowerLaw(0.4))
    layout = Layout("brakes", (thruster, *parts), axes=("Fx", "Ty", "Tz"))
    return in_the_core(layout, FLOW)


def found_for(robot: Robot, wrench: Array) -> Found:
    """What Newton's method on the dual leaves for a wrench (6,)."""
    memory = robot.work()
    block = at(robot.block)
    question, _kept = question_of(wrench, {})
    assert functions().fl_prepare_question(block, memory, ctypes.c_void_p(question.ctypes.data))
    work = Work.from_buffer(memory)
    of_forces = np.where(np.array(work.span.axis_counts) == 1, wrench, 0.0)
    of_forces = of_forces - np.array(work.span.wrench_offset)
    target = np.zeros(6)
    functions().fl_reduce_wrench(memory, at(of_forces), at(target))
    functions().fl_dual_newton(block, memory, at(target), None, 60)
    first = ctypes.addressof(work) + Work.state.offset
    state = work.state[(work.state_found - first) // ctypes.sizeof(work.state[0])]
    vertices = Vertices()
    functions().fl_find_vertices(block, memory, ctypes.byref(vertices))
    between = list(vertices.foil[: vertices.foils])
    columns = np.array(work.span.effectiveness_reduced)[: robot.n]
    movable = []
    chord = np.zeros((robot.n, 6))
    for i, own in enumerate(robot.actuators):
        if own["flow_speed"] > 0.0:
            limits = work.set[i]
            rise = (limits.cost_at_max - limits.cost_at_min) / (limits.force_max - limits.force_min)
            chord[i] = columns[i, 0] + rise / own["flow_speed"] * columns[i, 1]
        if i not in between and state.dy_ds[i][0] > 0.0:
            movable.append(columns[i, 0])
    force = np.array(state.force)[: robot.n]
    return Found(robot, memory, vertices, force, np.reshape(movable, (-1, 6)).T, chord)


def braking(robot: Robot, rng: np.random.Generator) -> Array:
    """A wrench (6,) [N, N m] of foils at random ends, some a part of the way, without thrust."""
    plant = robot.plant
    share = rng.random(robot.n)
    command = plant.lower + share[:, None] * plant.width
    command[0] = 0.0
    return np.asarray(plant.wrench(command))


@cache
def cases() -> list[Found]:
    """Robots that brake by their foils."""
    made = list[Found]()
    for seed in range(3):
        for pairs in (1, 2, 3):
            robot = pairs_of_rudders(seed, pairs)
            rng = np.random.default_rng([1, seed, pairs])
            found = [found_for(robot, braking(robot, rng)) for _ in range(8)]
            made += [one for one in found if one.vertices.foils > 0]
    return made


def test_robots_that_brake_leave_foils_between_their_ends_with_directions_and_without() -> None:
    assert sum(one.vertices.directions > 0 for one in cases()) >= 5
    for one in cases():
        directions = one.vertices.directions
        expected = 2**directions if directions else 1 + 2 * one.vertices.foils
        assert one.vertices.count == expected


def test_directions_are_as_many_as_lifts_leave_that_no_wrench_feels() -> None:
    """The rank of columns that others do not make up for says so."""
    for one in cases():
        foils = list(one.vertices.foil[: one.vertices.foils])
        columns = one.chord[foils].T
        left = columns - one.movable @ np.linalg.lstsq(one.movable, columns, rcond=None)[0]
        sizes = np.linalg.norm(columns, axis=0)
        rank = int((np.linalg.svd(left / sizes, compute_uv=False) > 1e-4).sum())
        assert one.vertices.directions == len(foils) - rank


def test_foils_are_held_at_ends_and_all_others_stay_within_theirs() -> None:
    for one in cases():
        work = Work.from_buffer(one.memory)
        foils = list(one.vertices.foil[: one.vertices.foils])
        others = [i for i in range(one.robot.n) if i not in foils]
        seen = set()
        for vertex in range(one.vertices.count):
            force, held = one.at_vertex(vertex)
            seen.add(tuple(np.round(force[foils, 0], 6)))
            assert held.sum() == (one.vertices.directions or min(vertex, 1))
            assert np.array_equal(force[others], one.force[others])
            for f, i in enumerate(foils):
                low, high = work.set[i].force_min, work.set[i].force_max
                slack = 1e-9 * (high - low)
                assert low - slack <= force[i, 0] <= high + slack
                assert not held[f] or force[i, 0] in (low, high)
        # Lifts that are at an end already may make two vertices one.
        assert len(seen) >= 2


def test_others_make_up_for_the_way_to_a_vertex() -> None:
    for one in cases():
        foils = list(one.vertices.foil[: one.vertices.foils])
        scale = np.abs(one.chord).max() * np.abs(one.force).max()
        if one.vertices.directions == 0:
            continue
        for vertex in range(one.vertices.count):
            force, _held = one.at_vertex(vertex)
            change = (force[foils, 0] - one.force[foils, 0]) @ one.chord[foils]
            left = change - one.movable @ np.linalg.lstsq(one.movable, change, rcond=None)[0]
            assert np.linalg.norm(left) <= 1e-3 * scale
