"""Telemetry logs: pymavlink writes them, and what they were made of judges what is read."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.log import judge, read_log
from tests.log.conftest import Dive, SubMotion, sub_motion
from tests.log.telemetry_writer import telemetry_of, version_1, version_2, write_telemetry
from tests.log.test_judge import check

N = 900
"""Samples of a dive."""
STEP_S = 0.02
"""Time between them [s]."""
MANUAL = 19
ALT_HOLD = 2
STABILIZE = 0
GUIDED = 4
"""Numbers of modes."""


@pytest.fixture
def motion() -> SubMotion:
    """A dive of ArduSub."""
    return sub_motion(N, STEP_S)


@pytest.mark.parametrize("dialect", [version_1, version_2])
def test_in_manual_all_that_was_asked_for_is_judged(
    motion: SubMotion, dialect: Any, tmp_path: Path
) -> None:
    long = sub_motion(3000, STEP_S)
    path = write_telemetry(tmp_path / "dive.tlog", telemetry_of(long, MANUAL, dialect), dialect)
    log = read_log(path, long.robot)
    np.testing.assert_allclose(log.time, long.time - long.time[0], atol=1e-5)
    np.testing.assert_allclose(log.demand, long.demand, atol=0.01 * np.abs(long.demand).max())
    judged = judge(log, improve=False)
    check(Dive(long.robot, path, log.time, long.demand, long.given), judged)
    assert any("holds no output of a controller" in ask for ask in judged.asks)


@pytest.mark.parametrize(
    ("mode", "axes_of_sticks"), [(STABILIZE, (0, 1, 2)), (ALT_HOLD, (0, 1)), (GUIDED, ()), (99, ())]
)
def test_axes_that_a_mode_steers_count_as_what_outputs_gave(
    motion: SubMotion, mode: int, axes_of_sticks: tuple[int, ...], tmp_path: Path
) -> None:
    path = write_telemetry(tmp_path / "dive.tlog", telemetry_of(motion, mode))
    log = read_log(path, motion.robot)
    for axis in range(6):
        right = motion.demand if axis in axes_of_sticks else motion.given
        np.testing.assert_allclose(log.demand[:, axis], right[:, axis], atol=0.3)


def test_the_robot_is_that_of_the_parameters_and_must_be_armed(
    motion: SubMotion, tmp_path: Path
) -> None:
    said = telemetry_of(motion, armed=(8.0, 14.0))
    log = read_log(write_telemetry(tmp_path / "dive.tlog", said))
    assert log.robot.n == 8 and log.form == "ardusub"
    assert log.span.sum() == pytest.approx(6.0, abs=0.1)
    assert any("disarmed are left out" in note for note in log.notes)


def test_depth_says_when_it_was_in_the_water(motion: SubMotion, tmp_path: Path) -> None:
    said = telemetry_of(motion)
    for time in np.arange(motion.time[0], motion.time[-1], 0.25):
        height = -4.0 if 8.0 <= time <= 14.0 else 0.05
        message = version_2.MAVLink_vfr_hud_message(0.0, 0.0, 0, 0, height, 0.0)
        said.append((time, 1, message))
    log = read_log(write_telemetry(tmp_path / "dive.tlog", said), motion.robot)
    assert log.span.sum() == pytest.approx(6.0, abs=0.3)


def test_a_joystick_counts_where_the_vehicle_sends_no_channels(
    motion: SubMotion, tmp_path: Path
) -> None:
    """The joystick's gain is 0.5 by default, and later the vehicle says that it is 0.25."""
    said = telemetry_of(motion, sticks="joystick")
    log = read_log(write_telemetry(tmp_path / "dive.tlog", said), motion.robot)
    np.testing.assert_allclose(log.demand, motion.demand, atol=0.3)
    gain = version_2.MAVLink_named_value_float_message(0, b"PilotGain", 0.25)
    said.append((motion.time[N // 2] - 1e-4, 1, gain))
    log = read_log(write_telemetry(tmp_path / "half.tlog", said), motion.robot)
    halved = motion.demand.copy()
    halved[N // 2 :] *= 0.5
    np.testing.assert_allclose(log.demand, halved, atol=0.3)


def test_what_is_lost_on_the_way_is_told(motion: SubMotion, tmp_path: Path) -> None:
    """A log is cut in the middle of a frame, or has a wrong byte in each tenth of it."""
    content = write_telemetry(tmp_path / "dive.tlog", telemetry_of(motion)).read_bytes()
    (tmp_path / "cut.tlog").write_bytes(content[: len(content) // 2 + 5])
    cut = read_log(tmp_path / "cut.tlog", motion.robot)
    assert 0.45 * N < len(cut) < 0.55 * N and any("It ends" in note for note in cut.notes)
    damaged = bytearray(content)
    for place in range(len(content) // 20, len(content), len(content) // 10):
        damaged[place] ^= 0x55
    (tmp_path / "damaged.tlog").write_bytes(damaged)
    log = read_log(tmp_path / "damaged.tlog", motion.robot)
    assert len(log) > 0.97 * N and any("damaged" in note for note in log.notes)
    rows = np.searchsorted(motion.time - motion.time[0], log.time + 1e-5) - 1
    assert (np.abs(log.command[:, 0, 0] - _first_force(motion)[rows]) < 1e-6).mean() > 0.97


def _first_force(motion: SubMotion) -> np.ndarray:
    """Force (n,) of the first thruster [N], whose motor is not reversed."""
    offset = motion.pulse[:, 0] - 1500.0
    return np.where(np.abs(offset) <= 25.0, 0.0, 40.0 * offset / 400.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sticks": ""}, "neither RC_CHANNELS nor MANUAL_CONTROL"),
        ({"autopilot": 12}, r"PX4.*\.ulg"),
        ({"vehicle": 2}, "vehicle of type 2"),
        ({"autopilot": 8}, "no heartbeat of an autopilot"),
    ],
)
def test_what_it_lacks_ends_in_a_sentence(
    motion: SubMotion, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = write_telemetry(tmp_path / "dive.tlog", telemetry_of(motion, **options))
    with pytest.raises(FinlabError, match=words):
        read_log(path, motion.robot)


def test_without_outputs_there_is_nothing_to_judge(motion: SubMotion, tmp_path: Path) -> None:
    said = [row for row in telemetry_of(motion) if row[2].get_type() != "SERVO_OUTPUT_RAW"]
    with pytest.raises(FinlabError, match="holds no SERVO_OUTPUT_RAW"):
        read_log(write_telemetry(tmp_path / "dive.tlog", said), motion.robot)


def test_its_first_bytes_tell_it_whatever_its_name(motion: SubMotion, tmp_path: Path) -> None:
    path = write_telemetry(tmp_path / "dive", telemetry_of(motion))
    assert len(read_log(path, motion.robot)) == N
