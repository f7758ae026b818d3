"""PX4's airmodes: the outputs of its own unit test, and what that promises of any command.

`px4_airmode_rows.csv` has the numbers of `ControlAllocationSequentialDesaturationTest.cpp` of PX4
(00202eb, BSD-3): commands of a quadrotor of unit arms and unit torque per newton, and the outputs
of its four rotors without airmode, with that of roll and pitch, and with that of all three.
"""

import csv
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from finlab import Allocator, Layout, PowerLaw, Thruster
from finlab.arrays import Array
from finlab.errors import AllocationError

ROWS = Path(__file__).with_name("px4_airmode_rows.csv")
"""The commands and the outputs."""
AIRMODES = {"off": (0.0, False), "roll_pitch": (1.0, False), "roll_pitch_yaw": (1.0, True)}
"""Columns of the file -> limit of the thrust that may be added, and whether yaw may spend it."""
TORQUES = (-4.0, -2.0, -1.0, -0.4, 0.0, 0.4, 1.0, 2.0, 4.0)
"""Torques of a sweep [N m]."""
THRUSTS = (0.0, 0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
"""Thrusts of a sweep, shares of full."""


def rotorcraft(places: list[tuple[float, float]]) -> Layout:
    """Rotors that push up with 0 to 1 N at places x forward, y right [m], each second one turning
    the other way; their torque is 1 N m per newton."""
    law = PowerLaw(1.0, 1.0, 1.5)
    parts = []
    for i, (x, y) in enumerate(places):
        rotor = Thruster(
            name=f"rotor_{i}",
            position=(x, -y, 0.0),
            axis=(0.0, 0.0, 1.0),
            force=(0.0, 1.0),
            model=law,
            torque_per_newton=-1.0 if i % 2 == 0 else 1.0,
        )
        parts.append(rotor)
    return Layout("rotorcraft", tuple(parts))


QUAD = rotorcraft([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
"""The quadrotor of PX4's test."""
HEXAGON = [(np.cos(angle), np.sin(angle)) for angle in np.radians([30, 90, 150, 210, 270, 330])]
"""Places of the rotors of a hexarotor."""


def outputs(
    robot: Layout, commands: Array, limit: float, yaw: bool, lost: tuple[str, ...] = ()
) -> Array:
    """Outputs (N, n) for roll, pitch, yaw [N m], x forward, y right, z down, and thrust as a share of
    full (N, 4)."""
    roll, pitch, turn, thrust = np.asarray(commands, float).T
    zero = np.zeros_like(roll)
    wrench = np.stack([zero, zero, robot.n * thrust, roll, -pitch, -turn], axis=1)
    allocator = Allocator(robot, "px4", airmode_limit=limit, airmode_yaw=yaw)
    command: Array = allocator.allocate_batch(wrench, lost=lost).command[..., 0]
    return command


def test_the_three_tables_of_px4s_unit_test_hold() -> None:
    with ROWS.open() as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) == 65
    commands = np.array([[row[key] for key in ("roll", "pitch", "yaw", "thrust")] for row in rows])
    for name, (limit, yaw) in AIRMODES.items():
        expected = np.array([[row[f"{name}_{i}"] for i in range(1, 5)] for row in rows], float)
        found = outputs(QUAD, commands.astype(float), limit, yaw)
        np.testing.assert_allclose(found, expected, atol=1e-5, err_msg=name)


@pytest.mark.parametrize(
    ("limit", "yaw", "command", "expected"),
    [
        (0.2, True, (0, 0, 2.8, 0.1), (0.6, 0, 0.6, 0)),
        (0.2, True, (0, 0, -2.8, 0.1), (0, 0.6, 0, 0.6)),
        (0.2, True, (2, 0, 2, 0.1), (0, 0, 0.6, 0.6)),
        (0.2, True, (1.2, 1.2, 0.4, 0.1), (0.6, 0, 0, 0.6)),
        (1.0, False, (0.05, 0.05, -0.025, 0), (0.0125, 0, 0.0125, 0.05)),
        (1.0, False, (0.05, 0.05, 0.025, 0), (0.025, 0, 0.025, 0.05)),
        (1.0, True, (0, 0, 1, 1), (1, 0.5, 1, 0.5)),
        (0.0, True, (0, 0, 1, 1), (1, 0.7, 1, 0.7)),
    ],
)
def test_single_commands_of_px4s_test(
    limit: float, yaw: bool, command: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    np.testing.assert_allclose(outputs(QUAD, [command], limit, yaw)[0], expected, atol=1e-5)


@pytest.mark.parametrize("thrust", np.arange(0.4, 0.61, 0.05))
def test_which_way_yaw_goes_is_no_matter_of_rounding(thrust: float) -> None:
    """Pitch and yaw exceed both limits by as much."""
    np.testing.assert_allclose(
        outputs(QUAD, [(0, 4, 1.2, thrust)], 0.2, False)[0], (1, 0, 0, 1), atol=1e-5
    )


def sweep(torques: tuple[float, ...] = TORQUES) -> Array:
    """All commands of some torques and thrusts (N, 4)."""
    return np.array([*product(torques, torques, torques, THRUSTS)])


def test_without_a_limit_yaw_changes_nothing() -> None:
    commands = sweep()
    np.testing.assert_array_equal(
        outputs(QUAD, commands, 0.0, True), outputs(QUAD, commands, 0.0, False)
    )


@pytest.mark.parametrize("yaw", [False, True])
@pytest.mark.parametrize("limit", [0.1, 0.2, 0.5])
def test_thrust_rises_no_further_than_its_limit(limit: float, yaw: bool) -> None:
    """With yaw and one of roll and pitch; with all three the passes may leave outputs beyond."""
    commands = sweep()
    commands = commands[(commands[:, :2] == 0.0).any(axis=1) & (commands[:, 3] <= 0.5)]
    mean = outputs(QUAD, commands, limit, yaw).mean(axis=1)
    assert (mean <= commands[:, 3] + limit + 1e-4).all()


@pytest.mark.parametrize("limit", [0.2, 0.5, 1.0])
def test_yaw_is_never_turned_round(limit: float) -> None:
    """Where no output is clipped: clipping adds what no axis asked for."""
    commands = sweep((-1.0, -0.4, 0.0, 0.4, 1.0))
    found = outputs(QUAD, commands, limit, True)
    yaw = found @ [1.0, -1.0, 1.0, -1.0]
    is_whole = (found > 1e-6).all(axis=1) & (found < 1.0 - 1e-6).all(axis=1)
    assert is_whole.sum() > 100
    low = np.minimum(commands[:, 2], 0.0) - 1e-4
    high = np.maximum(commands[:, 2], 0.0) + 1e-4
    assert ((yaw >= low) & (yaw <= high))[is_whole].all()


MIRRORED = [(QUAD, [3, 2, 1, 0]), (rotorcraft(HEXAGON), [5, 4, 3, 2, 1, 0])]
"""Robots with the order of their rotors in a mirror along x."""


@pytest.mark.parametrize(("robot", "order"), MIRRORED)
@pytest.mark.parametrize("yaw", [False, True])
@pytest.mark.parametrize("limit", [0.0, 0.2, 1.0])
def test_mirrored_commands_give_mirrored_outputs(
    robot: Layout, order: list[int], limit: float, yaw: bool
) -> None:
    commands = sweep((-2.0, -1.0, 0.0, 1.0, 2.0))
    mirrored = commands * [-1.0, 1.0, -1.0, 1.0]
    np.testing.assert_allclose(
        outputs(robot, commands, limit, yaw),
        outputs(robot, mirrored, limit, yaw)[:, order],
        atol=1e-9,
    )


def test_the_limit_trades_thrust_for_roll_of_a_hexarotor_that_lost_a_rotor() -> None:
    robot = rotorcraft(HEXAGON)
    roll_arms = -np.array([y for _, y in HEXAGON])

    def roll(limit: float) -> float:
        found = outputs(robot, [(1.0, 0.0, 0.0, 0.05)], limit, False, lost=("rotor_0",))[0]
        return float(np.nan_to_num(found) @ roll_arms)

    rolls = [roll(limit) for limit in (0.0, 0.1, 0.2, 0.3)]
    assert rolls[0] < 0.2 and (np.diff(rolls) > 0.0).all()
    assert 0.4 < rolls[2] < 0.8
    assert roll(0.5) == pytest.approx(1.0, abs=1e-2) and roll(1.0) == pytest.approx(roll(0.5))


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(AllocationError, match="airmode_limit"):
        Allocator(QUAD, "px4", airmode_limit=1.5)
    with pytest.raises(AllocationError, match="airmode_yaw"):
        Allocator(QUAD, "px4", airmode_yaw="yes")
