"""Cuts of sets with gaps in the core: both parts together are the set, none has what the set has
not, and the force in the gap is left out."""

import ctypes
import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.layout import Layout
from tests.core.internal_functions import (
    EITHER_WAY,
    Robot,
    Set,
    Work,
    at,
    functions,
    in_the_core,
    pods_either_way,
    prepared_work,
    robot_of,
)
from tests.core.test_actuator_response import forces_of
from tests.sampled_cases import sampled

SLACK = 1e-6
"""Share of the largest force by which ends of sets may differ."""


def has(robot: Robot, i: int, limits: Set, force: Array, arc_slack: float = 1e-6) -> bool:
    """Whether a set has a force (2,) by its definition: sizes in an arc, to some rounding [rad],
    some in reverse, none in a band."""
    actuator = robot.actuators[i]
    slack = SLACK * float(actuator["row_force_max"][0])
    if not robot.is_plane(i):
        return bool(limits.force_min - slack <= force[0] <= limits.force_max + slack)
    size = math.hypot(*force)
    if size <= slack:
        return bool(limits.force_min <= slack)
    for low, high, rotation in (
        (limits.force_min, limits.force_max, 0.0),
        (0.0, limits.force_max_reverse, math.pi),
    ):
        angle_error = math.remainder(
            math.atan2(force[1], force[0]) - limits.sector_center - rotation, 2.0 * math.pi
        )
        radius = size / robot.radius(i, math.atan2(force[1], force[0]))
        if (
            high > 0.0
            and low - slack <= radius <= high + slack
            and abs(angle_error) <= limits.sector_half_angle + arc_slack
        ):
            return True
    return False


def narrowed(robot: Robot, i: int, limits: Set, force: Array, side: int) -> Set:
    """The part of a set on one side of a gap."""
    part = Set.from_buffer_copy(limits)
    functions().fl_narrow_set(at(robot.block), i, ctypes.byref(part), at(force), side)
    return part


def in_a_band(robot: Robot, i: int, force: Array) -> bool:
    """Whether a force lies in the dead band of its actuator, and is not rest."""
    actuator = robot.actuators[i]
    return bool(
        1e-6 * actuator["row_force_max"][0]
        < math.hypot(*force)
        < actuator["dead_band"] * (1.0 - 1e-6)
    )


def cuts_of(robot: Robot, i: int, limits: Set, rng: np.random.Generator) -> Array:
    """Forces (N, 2) in the hull of a set, at which it may be cut: of two of its forces what lies
    between."""
    force, _ = forces_of(robot, i, limits)
    ends = force[rng.integers(len(force), size=(2, 12))]
    share = rng.random((12, 1))
    return np.ascontiguousarray(share * ends[0] + (1.0 - share) * ends[1])


def costs_hold(robot: Robot, i: int, part: Set) -> None:
    """The costs that a set remembers are those of its ends."""
    full = max(abs(part.cost_at_min), abs(part.cost_at_max), 1e-9)
    sign = -1.0 if part.is_flipped else 1.0
    assert part.cost_at_max == pytest.approx(robot.power(i, sign * part.force_max), abs=1e-9 * full)
    assert part.cost_at_min == pytest.approx(robot.power(i, sign * part.force_min), abs=1e-9 * full)
    if robot.is_plane(i):
        assert part.cos_center == pytest.approx(math.cos(part.sector_center), abs=1e-12)
        assert part.sin_half_angle == pytest.approx(math.sin(part.sector_half_angle), abs=1e-12)
        if part.force_max_reverse > 0.0:
            assert part.cost_at_max_reverse == pytest.approx(
                robot.power(i, -part.force_max_reverse), abs=1e-9 * full
            )


@pytest.mark.parametrize(
    "name", sampled(["holes", "wide arcs", "fins", "thrusters", EITHER_WAY, "all"], every=2)
)
def test_both_parts_of_a_cut_are_the_set(name: str) -> None:
    rng = np.random.default_rng(1)
    cuts = 0
    for number in range(2):
        robot = robot_of(name, number)
        for i in range(robot.n):
            limits = robot.whole_set(i)
            if robot.actuators[i]["flow_speed"] > 0.0:
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
                    limits.force_max_reverse > 0.0 and limits.sector_half_angle > math.pi / 2.0
                ):
                    assert not any(has(robot, i, part, cut) for part in parts)
                    check_other_way(robot, i, limits, parts, cut)
    assert cuts > 5


def check_other_way(robot: Robot, i: int, limits: Set, parts: list[Set], cut: Array) -> None:
    """Beyond the band on the side of the force is one part, all else the other."""
    band = robot.actuators[i]["dead_band"]
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
    n_compared = 0
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
                    half = robot.actuators[i]["dead_band"] / 2.0
                    assert side == (1 if math.hypot(*cut) > half else -1)
                elif limits.force_max_reverse > 0.0:
                    ahead = math.cos(math.atan2(cut[1], cut[0]) - limits.sector_center)
                    assert side == (1 if ahead >= 0.0 else -1)
                else:
                    assert (
                        apart[side] <= apart[-side] + 0.02 * robot.actuators[i]["row_force_max"][0]
                    )
                n_compared += 1
    assert n_compared > 2


def nearest(robot: Robot, i: int, limits: Set, force: Array) -> float:
    """Distance [N] of a force from those of a set."""
    forces, _ = forces_of(robot, i, limits)
    return float(np.hypot(*(forces - force).T).min())


def test_a_pod_is_cut_where_its_answer_jumps() -> None:
    """Where turning costs, the two parts are the angles below and above the jump."""
    rng = np.random.default_rng(3)
    robot = in_the_core(pods_either_way(5))
    for i in range(robot.n):
        actuator = robot.actuators[i]
        limits = robot.set_of(
            i, 0.0, actuator["force_max"], actuator["sector_center"], actuator["sector_half_angle"]
        )
        limits.turn_cost = 1.0
        limits.has_jumped = 1
        limits.turn_origin = limits.sector_center + 0.3 * min(limits.sector_half_angle, 1.0)
        low = limits.sector_center - limits.sector_half_angle
        high = limits.sector_center + limits.sector_half_angle
        if limits.sector_half_angle >= math.pi:
            low = limits.turn_origin - math.pi
            high = limits.turn_origin + math.pi
        limits.jump_angle = rng.uniform(low, high)
        cut = np.array([actuator["force_max"], 0.0])
        below, above = (narrowed(robot, i, limits, cut, side) for side in (-1, 1))
        ends = [
            below.sector_center - below.sector_half_angle,
            below.sector_center + below.sector_half_angle,
            above.sector_center - above.sector_half_angle,
        ]
        np.testing.assert_allclose(ends, [low, limits.jump_angle, limits.jump_angle], atol=1e-12)
        assert above.sector_center + above.sector_half_angle == pytest.approx(high)
        assert not below.has_jumped and not above.has_jumped
        for angle in (low + 0.01, limits.jump_angle - 0.01, limits.jump_angle + 0.01, high - 0.01):
            one = actuator["force_max"] * np.array([math.cos(angle), math.sin(angle)])
            whole_limits = Set.from_buffer_copy(limits)
            side = functions().fl_nearer_side(
                at(robot.block), i, ctypes.byref(whole_limits), at(one)
            )
            if -math.pi < angle < math.pi:
                assert side == (1 if angle >= limits.jump_angle else -1)


@pytest.mark.parametrize("name", ["holes", "wide arcs"])
def test_what_is_fixed_at_its_least_force_stands_next_to_where_it_was(name: str) -> None:
    rng = np.random.default_rng(4)
    robot = robot_of(name, 1)
    for i in range(robot.n):
        limits = robot.whole_set(i)
        if not robot.is_plane(i) or not limits.force_min > 0.0:
            continue
        for force in rng.normal(size=(12, 2)) * limits.force_min:
            fixed = Set.from_buffer_copy(limits)
            functions().fl_fix_at_least_force(at(robot.block), i, ctypes.byref(fixed), at(force))
            assert (
                fixed.force_min == fixed.force_max == pytest.approx(limits.force_min)
                and fixed.sector_half_angle == 0.0
            )
            assert fixed.cost_at_min == pytest.approx(limits.cost_at_min)
            assert fixed.cost_at_max == fixed.cost_at_min and fixed.force_max_reverse == 0.0
            angle_error = math.remainder(
                math.atan2(force[1], force[0]) - limits.sector_center, 2.0 * math.pi
            )
            expected_center = limits.sector_center + min(
                max(angle_error, -limits.sector_half_angle), limits.sector_half_angle
            )
            assert math.remainder(
                fixed.sector_center - expected_center, 2.0 * math.pi
            ) == pytest.approx(0.0, abs=1e-9)


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


def gap_of(robot: Robot, i: int, limits: Set, force: Array) -> float:
    """How far a force (2,) that comes of no multipliers is in a gap of a set."""
    work = prepared_work(robot.block)
    Work.from_buffer(work).set[i] = limits
    gap = functions().fl_gap_of
    gap.restype = ctypes.c_double
    largest = ctypes.c_double(float(robot.actuators[i]["row_force_max"][0]))
    return float(gap(at(robot.block), work, i, at(force), largest, None))


@pytest.mark.parametrize("name", ["thrusters", "wide arcs", "holes", "all", EITHER_WAY])
def test_forces_in_a_gap_are_those_of_the_hull_that_the_set_has_not(name: str) -> None:
    rng = np.random.default_rng(5)
    judged = {True: 0, False: 0}
    for number in range(2):
        robot = robot_of(name, number)
        for i in range(robot.n):
            own = robot.actuators[i]
            if own["flow_speed"] > 0.0:
                continue
            most = float(own["row_force_max"][0])
            limits = robot.whole_set(i)
            force, _ = forces_of(robot, i, limits)
            tried = [*cuts_of(robot, i, limits, rng), *force[rng.integers(len(force), size=12)]]
            for one in tried:
                if not robot.is_plane(i) and limits.force_min == limits.force_max:
                    continue
                held = in_a_band(robot, i, one)
                inside = has(robot, i, limits, one)
                size = math.hypot(*one)
                if (
                    0.0 < limits.force_min <= 1e-3 * most
                    or abs(size - limits.force_min) < 1e-3 * most
                ):
                    continue  # a least force this small is no hole
                if own["gauge_table"] > 0.0 and size < 1.2 * limits.force_min:
                    continue
                is_in_gap = held or not inside
                off = math.remainder(math.atan2(one[1], one[0]) - limits.sector_center, 2 * math.pi)
                near_end = abs(abs(off) - limits.sector_half_angle) < 1e-2
                if robot.is_plane(i) and (near_end or limits.sector_half_angle <= 0.2):
                    continue  # of a narrow arc the chord counts as the arc
                assert (gap_of(robot, i, limits, np.ascontiguousarray(one)) > 0.0) == is_in_gap
                judged[is_in_gap] += 1
    assert judged[False] > 10
    assert judged[True] > 3 or name in ("wide arcs", "all")


def test_a_foil_is_cut_at_a_lift_and_lies_on_the_nearer_half() -> None:
    rng = np.random.default_rng(8)
    robot = robot_of("rudders")
    foils = np.flatnonzero(robot.actuators["flow_speed"] > 0.0).tolist()
    for i in foils:
        limits = robot.whole_set(i)
        middle = 0.5 * (limits.force_min + limits.force_max)
        for share in rng.uniform(0.05, 0.95, 8):
            lift = limits.force_min + share * (limits.force_max - limits.force_min)
            drag = float(robot.actuators[i]["row_force_max"][1])
            cut = np.array([lift, drag])
            below, above = (narrowed(robot, i, limits, cut, side) for side in (-1, 1))
            assert (below.force_min, below.force_max) == (limits.force_min, lift)
            assert (above.force_min, above.force_max) == (lift, limits.force_max)
            for part in (below, above):
                costs_hold(robot, i, part)
            side = functions().fl_nearer_side(at(robot.block), i, ctypes.byref(limits), at(cut))
            assert side == (1 if lift >= middle else -1)
            # Drag above that of the lift is a gap.
            own_drag = robot.drag(i, lift)
            on_curve = np.array([lift, own_drag])
            assert gap_of(robot, i, limits, on_curve) == 0.0
            beyond = np.array([lift, own_drag + 0.01 * drag])
            assert gap_of(robot, i, limits, beyond) == pytest.approx(0.01)


def test_a_line_in_its_dead_band_is_in_a_gap_unless_it_is_fixed_there() -> None:
    robot = robot_of("thrusters")
    (banded, *_) = np.flatnonzero(robot.actuators["dead_band"] > 0.0).tolist()
    limits = robot.whole_set(banded)
    force = np.array([0.5 * robot.actuators[banded]["dead_band"], 0.0])
    assert gap_of(robot, banded, limits, force) == 1.0
    assert gap_of(robot, banded, limits, -force) == 1.0
    limits.force_min = limits.force_max = force[0]
    assert gap_of(robot, banded, limits, force) == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_band_is_left_on_the_side_on_which_the_force_is(sign: float) -> None:
    """Of a pod that pushes either way: beyond the band ahead or in reverse, or all else."""
    pods = pods_either_way(5).actuators
    banded = tuple(replace(pod, dead_band=3.0) for pod in pods[:2])
    robot = in_the_core(Layout("pods", banded))
    for i in range(robot.n):
        limits = robot.whole_set(i)
        assert limits.force_max_reverse > 3.0
        center = limits.sector_center
        cut = sign * 1.5 * np.array([math.cos(center), math.sin(center)])
        parts = [narrowed(robot, i, limits, cut, side) for side in (-1, 1)]
        check_other_way(robot, i, limits, parts, cut)
        other_way = -cut * (3.000001 / 1.5)
        assert has(robot, i, parts[0], other_way) and not has(robot, i, parts[1], other_way)
        for part in parts:
            costs_hold(robot, i, part)
