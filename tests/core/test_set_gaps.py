"""Cuts of sets with gaps in the core: both parts together are the set, none has what the set has
not, and the force in the gap is left out."""

import ctypes
import math

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.parts import (
    EITHER_WAY,
    Robot,
    Set,
    at,
    functions,
    in_the_core,
    pods_either_way,
    robot_of,
)
from tests.core.test_actuator_response import forces_of

SLACK = 1e-6
"""Share of the largest force by which ends of sets may differ."""


def has(robot: Robot, i: int, limits: Set, force: Array) -> bool:
    """Whether a set has a force (2,) by its definition: sizes in an arc, some in reverse, none in a
    band."""
    own = robot.actuators[i]
    slack = SLACK * float(own["most"][0])
    if not robot.is_plane(i):
        return bool(limits.low - slack <= force[0] <= limits.high + slack)
    size = math.hypot(*force)
    if size <= slack:
        return bool(limits.low <= slack)
    for low, high, turned in ((limits.low, limits.high, 0.0), (0.0, limits.reverse, math.pi)):
        off = math.remainder(math.atan2(force[1], force[0]) - limits.middle - turned, 2.0 * math.pi)
        radius = size / robot.radius(i, math.atan2(force[1], force[0]))
        if high > 0.0 and low - slack <= radius <= high + slack and abs(off) <= limits.half + 1e-6:
            return True
    return False


def narrowed(robot: Robot, i: int, limits: Set, force: Array, side: int) -> Set:
    """The part of a set on one side of a gap."""
    part = Set.from_buffer_copy(limits)
    functions().fl_narrow_set(at(robot.block), i, ctypes.byref(part), at(force), side)
    return part


def in_a_band(robot: Robot, i: int, force: Array) -> bool:
    """Whether a force lies in the dead band of its actuator, and is not rest."""
    own = robot.actuators[i]
    return bool(1e-6 * own["most"][0] < math.hypot(*force) < own["band"] * (1.0 - 1e-6))


def cuts_of(robot: Robot, i: int, limits: Set, rng: np.random.Generator) -> Array:
    """Forces (N, 2) in the hull of a set, at which it may be cut: of two of its forces what lies
    between."""
    force, _ = forces_of(robot, i, limits)
    ends = force[rng.integers(len(force), size=(2, 12))]
    share = rng.random((12, 1))
    return np.ascontiguousarray(share * ends[0] + (1.0 - share) * ends[1])


def costs_hold(robot: Robot, i: int, part: Set) -> None:
    """The costs that a set remembers are those of its ends."""
    full = max(abs(part.low_cost), abs(part.high_cost), 1e-9)
    sign = -1.0 if part.flipped else 1.0
    assert part.high_cost == pytest.approx(robot.power(i, sign * part.high), abs=1e-9 * full)
    assert part.low_cost == pytest.approx(robot.power(i, sign * part.low), abs=1e-9 * full)
    if robot.is_plane(i):
        assert part.cos_middle == pytest.approx(math.cos(part.middle), abs=1e-12)
        assert part.sin_half == pytest.approx(math.sin(part.half), abs=1e-12)
        if part.reverse > 0.0:
            assert part.reverse_cost == pytest.approx(
                robot.power(i, -part.reverse), abs=1e-9 * full
            )


@pytest.mark.parametrize("name", ["thrusters", "wide arcs", "holes", "fins", "all", EITHER_WAY])
def test_both_parts_of_a_cut_are_the_set(name: str) -> None:
    rng = np.random.default_rng(1)
    cuts = 0
    for number in range(2):
        robot = robot_of(name, number)
        for i in range(robot.n):
            limits = robot.whole_set(i)
            if robot.actuators[i]["speed"] > 0.0:
                continue
            force, _ = forces_of(robot, i, limits)
            sampled = force[rng.integers(len(force), size=40)]
            for cut in cuts_of(robot, i, limits, rng):
                if not robot.is_plane(i) and not in_a_band(robot, i, cut):
                    continue
                parts = [narrowed(robot, i, limits, cut, side) for side in (-1, 1)]
                cuts += 1
                for part in parts:
                    costs_hold(robot, i, part)
                for one in sampled:
                    if in_a_band(robot, i, one):
                        continue
                    mine = [has(robot, i, part, one) for part in parts]
                    assert any(mine) == has(robot, i, limits, one), (i, one, cut)
                if in_a_band(robot, i, cut) and not (
                    limits.reverse > 0.0 and limits.half > math.pi / 2.0
                ):
                    assert not any(has(robot, i, part, cut) for part in parts)
                    check_other_way(robot, i, limits, parts, cut)
    assert cuts > 5


def check_other_way(robot: Robot, i: int, limits: Set, parts: list[Set], cut: Array) -> None:
    """Beyond the band on the side of the force is one part, all else the other."""
    band = robot.actuators[i]["band"]
    size = math.hypot(*cut)
    edge = cut * (band * 1.000001 / size)
    if has(robot, i, limits, edge):
        assert has(robot, i, parts[1], edge) and not has(robot, i, parts[0], edge)
    rest = np.zeros(2)
    if has(robot, i, limits, rest):
        assert has(robot, i, parts[0], rest) and not has(robot, i, parts[1], rest)


@pytest.mark.parametrize("name", ["thrusters", "wide arcs", EITHER_WAY])
def test_the_nearer_side_of_a_gap_is_the_one_whose_forces_are_nearer(name: str) -> None:
    rng = np.random.default_rng(2)
    judged = 0
    for number in range(2):
        robot = robot_of(name, number)
        for i in range(robot.n):
            limits = robot.whole_set(i)
            for cut in cuts_of(robot, i, limits, rng):
                in_band = in_a_band(robot, i, cut)
                if has(robot, i, limits, cut) and not in_band:
                    continue
                side = functions().fl_nearer_side(at(robot.block), i, ctypes.byref(limits), at(cut))
                apart = {}
                for tried in (-1, 1):
                    part = narrowed(robot, i, limits, cut, tried)
                    apart[tried] = nearest(robot, i, part, cut)
                if in_band:  # what is beyond the band, or rest
                    half = robot.actuators[i]["band"] / 2.0
                    assert side == (1 if math.hypot(*cut) > half else -1)
                elif limits.reverse > 0.0:
                    ahead = math.cos(math.atan2(cut[1], cut[0]) - limits.middle)
                    assert side == (1 if ahead >= 0.0 else -1)
                else:
                    assert apart[side] <= apart[-side] + 0.02 * robot.actuators[i]["most"][0]
                judged += 1
    assert judged > 2


def nearest(robot: Robot, i: int, limits: Set, force: Array) -> float:
    """Distance [N] of a force from those of a set."""
    known, _ = forces_of(robot, i, limits)
    return float(np.hypot(*(known - force).T).min())


def test_a_pod_is_cut_where_its_answer_jumps() -> None:
    """Where turning costs, the two parts are the angles below and above the jump."""
    rng = np.random.default_rng(3)
    robot = in_the_core(pods_either_way(5))
    for i in range(robot.n):
        own = robot.actuators[i]
        limits = robot.set_of(i, 0.0, own["high"], own["middle"], own["half"])
        limits.turn, limits.jumps = 1.0, 1
        limits.at = limits.middle + 0.3 * min(limits.half, 1.0)
        low, high = limits.middle - limits.half, limits.middle + limits.half
        if limits.half >= math.pi:
            low, high = limits.at - math.pi, limits.at + math.pi
        limits.cut = rng.uniform(low, high)
        cut = np.array([own["high"], 0.0])
        below, above = (narrowed(robot, i, limits, cut, side) for side in (-1, 1))
        ends = [below.middle - below.half, below.middle + below.half, above.middle - above.half]
        np.testing.assert_allclose(ends, [low, limits.cut, limits.cut], atol=1e-12)
        assert above.middle + above.half == pytest.approx(high)
        assert not below.jumps and not above.jumps
        for angle in (low + 0.01, limits.cut - 0.01, limits.cut + 0.01, high - 0.01):
            one = own["high"] * np.array([math.cos(angle), math.sin(angle)])
            known = Set.from_buffer_copy(limits)
            side = functions().fl_nearer_side(at(robot.block), i, ctypes.byref(known), at(one))
            if -math.pi < angle < math.pi:
                assert side == (1 if angle >= limits.cut else -1)


@pytest.mark.parametrize("name", ["holes", "wide arcs"])
def test_what_is_fixed_at_its_least_force_stands_next_to_where_it_was(name: str) -> None:
    rng = np.random.default_rng(4)
    robot = robot_of(name, 1)
    for i in range(robot.n):
        limits = robot.whole_set(i)
        if not robot.is_plane(i) or not limits.low > 0.0:
            continue
        for force in rng.normal(size=(12, 2)) * limits.low:
            fixed = Set.from_buffer_copy(limits)
            functions().fl_fix_at_least_force(at(robot.block), i, ctypes.byref(fixed), at(force))
            assert fixed.low == fixed.high == pytest.approx(limits.low) and fixed.half == 0.0
            assert fixed.low_cost == pytest.approx(limits.low_cost)
            assert fixed.high_cost == fixed.low_cost and fixed.reverse == 0.0
            off = math.remainder(math.atan2(force[1], force[0]) - limits.middle, 2.0 * math.pi)
            wanted = limits.middle + min(max(off, -limits.half), limits.half)
            assert math.remainder(fixed.middle - wanted, 2.0 * math.pi) == pytest.approx(
                0.0, abs=1e-9
            )


@pytest.mark.parametrize("name", ["thrusters", "mixed", "rudders"])
def test_the_largest_force_is_that_of_all_actuators_along_their_rows(name: str) -> None:
    rng = np.random.default_rng(6)
    robot = robot_of(name)
    largest = functions().fl_largest_force
    largest.restype = ctypes.c_double
    planes = np.array([robot.is_plane(i) for i in range(robot.n)])
    for _ in range(10):
        force = rng.normal(size=(robot.n, 2))
        size = np.where(planes, np.hypot(*force.T), np.abs(force[:, 0]))
        assert largest(at(robot.block), at(force)) == pytest.approx(size.max())
