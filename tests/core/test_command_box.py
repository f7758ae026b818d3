"""Commands within their limits in the core: which number is what, angles over the seam, dead
bands."""

import ctypes
import math

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.core.fields import constant
from tests.core.internal_functions import (
    EITHER_WAY,
    FIN,
    MOST,
    POD,
    REAL,
    ROBOTS,
    Robot,
    at,
    functions,
    robot_of,
)

TURN = 2.0 * math.pi
THRUSTER = constant("FL_THRUSTER")
ANGLES = {FIN: 2, POD: 0}
"""Which number of a command is an angle, by its kind."""
FORCES = {THRUSTER: 0, POD: 1}
"""Which one is a force."""


def is_in_dead_band(robot: Robot, i: int, command: Array) -> bool:
    """Whether a command of an actuator gives no force."""
    place = ctypes.c_void_p(robot.actuators[i : i + 1].ctypes.data)
    return bool(functions().fl_is_in_dead_band(place, at(command)))


def padded(command: Array) -> Array:
    """Commands (n, 3) in an array of the most actuators."""
    made = np.zeros((MOST, 3))
    made[: len(command)] = command
    return made


@pytest.mark.parametrize("angle", [-1, 0, 2])
def test_a_number_is_clipped_and_an_angle_by_the_shorter_way(angle: int) -> None:
    rng = np.random.default_rng(1)
    box = robot_of("thrusters").whole_box()
    clip = functions().fl_clip_number
    clip.restype = REAL
    for _ in range(60):
        low = rng.uniform(-5.0, 2.0)
        high = low + rng.uniform(0.1, 4.0)
        k = int(rng.integers(3))
        box.command_min[3][k] = low
        box.command_max[3][k] = high
        value = rng.uniform(-12.0, 12.0)
        told = clip(ctypes.byref(box), 3, k, angle, REAL(value))
        if k != angle:
            assert told == min(max(value, low), high)
            continue
        assert low <= told <= high
        tried = np.linspace(low, high, 2001)
        apart = np.abs((tried - value + math.pi) % TURN - math.pi).min()
        assert abs(math.remainder(told - value, TURN)) <= apart + 3e-3


def banded(robot: Robot) -> list[tuple[int, int, float]]:
    """Actuators with a dead band, which number of their commands is the force, and the band."""
    found = []
    for i in range(robot.n):
        own = robot.actuators[i]
        if own["dead_band"] > 0.0:
            found.append((i, FORCES[int(own["command_kind"])], float(own["dead_band"])))
    return found


@pytest.mark.parametrize("name", ["thrusters", EITHER_WAY])
def test_a_command_within_the_dead_band_gives_no_force(name: str) -> None:
    judged = 0
    for number in range(3):
        robot = robot_of(name, number)
        for i, k, band in banded(robot):
            for share, is_inside in (
                (0.0, True),
                (0.5, True),
                (-0.99, True),
                (1.0, False),
                (-1.0, False),
                (1.0 - 1e-7, False),  # the edge, but for rounding
                (1.0 - 1e-5, True),
                (1.5, False),
            ):
                command = np.full(3, 7.0 * band)
                command[k] = share * band
                assert is_in_dead_band(robot, i, command) == is_inside
                judged += 1
    assert judged


@pytest.mark.parametrize("name", ["thrusters", EITHER_WAY])
def test_forces_nearer_to_the_edge_of_a_band_than_to_rest_are_put_there(name: str) -> None:
    for number in range(3):
        robot = robot_of(name, number)
        for i, k, band in banded(robot):
            for share, force_share, left_at in (
                (0.95, 0.95, 1.0),
                (-0.95, 0.95, -1.0),
                (0.95, 0.5, 0.95),
                (1.2, 1.2, 1.2),
                (-1.2, 1.2, -1.2),
                (0.0, 0.0, 0.0),
            ):
                command = padded(np.zeros((robot.n, 3)))
                command[i, k] = share * band
                force = np.zeros((MOST, 2))
                force[i, 0] = math.copysign(force_share * band, share)
                functions().fl_leave_dead_bands(at(robot.block), at(force), at(command))
                assert command[i, k] == pytest.approx(left_at * band, abs=1e-12)
                others = command.copy()
                others[i, k] = 0.0
                assert not others.any()


@pytest.mark.parametrize("name", ["thrusters", EITHER_WAY])
def test_what_gives_no_force_rests_where_the_box_allows(name: str) -> None:
    for number in range(3):
        robot = robot_of(name, number)
        for i, k, band in banded(robot):
            for low, high, share, left_at in (
                (-2.0, 2.0, 0.6, 0.0),
                (-2.0, 2.0, -0.6, 0.0),
                (0.0, 2.0, 0.6, 0.0),
                (-2.0, 0.0, -0.6, 0.0),
                (0.3, 2.0, 0.6, 0.6),  # a tick in which it cannot come to rest
                (-2.0, -0.3, -0.6, -0.6),
                (-2.0, 2.0, 1.0 - 1e-7, 1.0),
                (-2.0, 2.0, -1.0 + 1e-7, -1.0),
                (-2.0, 2.0, 1.1, 1.1),
            ):
                box = robot.whole_box()
                box.command_min[i][k] = low * band
                box.command_max[i][k] = high * band
                command = padded(np.zeros((robot.n, 3)))
                command[i, k] = share * band
                functions().fl_rest_in_dead_bands(at(robot.block), ctypes.byref(box), at(command))
                assert command[i, k] == pytest.approx(left_at * band, abs=1e-12)


@pytest.mark.parametrize("k", range(3))
def test_a_command_is_known_without_nan(k: int) -> None:
    command = np.array([1.0, -2.0, 0.0])
    assert functions().fl_is_known_command(at(command)) == 1
    command[k] = np.nan
    assert functions().fl_is_known_command(at(command)) == 0


@pytest.mark.parametrize("name", ROBOTS)
def test_clipped_commands_are_in_the_box_and_their_angles_in_the_limits(name: str) -> None:
    """An angle is the one that it was, but for full turns, wherever the box had it."""
    rng = np.random.default_rng(2)
    robot = robot_of(name)
    lower, upper = robot.actuators["command_min"], robot.actuators["command_max"]
    for _ in range(10):
        box = robot.whole_box()
        low = np.empty_like(lower)
        high = np.empty_like(upper)
        command = np.empty_like(lower)
        for i in range(robot.n):
            angle = ANGLES.get(int(robot.actuators[i]["command_kind"]), -1)
            ends = np.sort(lower[i] + rng.random((2, 3)) * (upper[i] - lower[i]), axis=0)
            if angle >= 0 and robot.actuators[i]["is_free_angle"] != 0.0:
                ends[:, angle] += 3.0  # counted from the previous angle, beyond the seam
                box.is_free_angle[i] = int(rng.integers(2))
            low[i], high[i] = ends
            box.command_min[i][:] = low[i]
            box.command_max[i][:] = high[i]
            command[i] = low[i] + rng.uniform(-0.5, 1.5, 3) * (high[i] - low[i])
        clipped = padded(command)
        functions().fl_clip_commands(at(robot.block), ctypes.byref(box), at(clipped))
        clipped = clipped[: robot.n]
        assert (clipped >= lower).all() and (clipped <= upper).all()
        for i in range(robot.n):
            angle = ANGLES.get(int(robot.actuators[i]["command_kind"]), -1)
            for k in range(3):
                if k != angle:
                    assert clipped[i, k] == min(max(command[i, k], low[i, k]), high[i, k])
                    continue
                expected = command[i, k]
                if not box.is_free_angle[i]:
                    middle = 0.5 * (low[i, k] + high[i, k])
                    near = middle + math.remainder(expected - middle, TURN)
                    expected = min(max(near, low[i, k]), high[i, k])
                assert math.remainder(clipped[i, k] - expected, TURN) == pytest.approx(0, abs=1e-9)
