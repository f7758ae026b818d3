"""Of a log only the time counts at which the robot was armed and in the water; what was asked for in
it is added up by hand from what the log was made of."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.log import judge, read_log
from tests.log.conftest import Dive, px4_dive, sub_dive

N = 1200
"""Samples of a dive."""
STEP_S = 0.02
"""Time between them [s]."""
START_S = 4.0
"""Time of the first one [s]."""
ARMED_S = (10.0, 22.0)
"""When the robot is armed, and disarmed again [s]."""
IN_WATER_S = (12.0, 20.0)
"""When it is let into the water, and taken out of it [s]."""


def armed_by_topic() -> dict[str, Any]:
    """Messages of `actuator_armed`, as PX4 logs them at changes, and the first at once."""
    time = np.array([START_S, *ARMED_S])
    return {"actuator_armed": (time, {"armed": np.array([0, 1, 0])})}


def armed_by_status() -> dict[str, Any]:
    """Messages of `vehicle_status`."""
    time = np.array([START_S, *ARMED_S])
    return {"vehicle_status": (time, {"arming_state": np.array([1, 2, 1])})}


def armed_by_events() -> dict[str, Any]:
    """Events of ArduPilot, among others."""
    us = np.array([5.0, *ARMED_S, 23.0]) * 1e6
    return {"EV": ("QB", {"TimeUS": us, "Id": np.array([25, 10, 11, 25])})}


def armed_by_messages() -> dict[str, Any]:
    """Messages of arming of ArduPilot."""
    us = np.array(ARMED_S) * 1e6
    return {"ARM": ("QB", {"TimeUS": us, "ArmState": np.array([1, 0])})}


def landed_by_topic() -> dict[str, Any]:
    """PX4's detector of landing."""
    time = np.array([START_S, *IN_WATER_S])
    return {"vehicle_land_detected": (time, {"landed": np.array([1, 0, 1])})}


def deep_by_height() -> dict[str, Any]:
    """Heights over the surface of ArduSub, which comes up once in between."""
    time = START_S + STEP_S * np.arange(N)
    is_under = (time >= IN_WATER_S[0]) & (time <= IN_WATER_S[1]) & (np.abs(time - 16.0) > 1.0)
    return {"CTUN": ("Qf", {"TimeUS": time * 1e6, "Alt": np.where(is_under, -5.0, 0.1)})}


def asked_between(dive: Dive, begin: float, end: float) -> np.ndarray:
    """Impulse (6,) that was asked for in a span of time [N s, N m s]."""
    counts = (dive.time >= begin) & (dive.time < end)
    return STEP_S * np.abs(dive.demand[counts]).sum(axis=0)


@pytest.mark.parametrize(
    ("write", "extra"),
    [
        (px4_dive, armed_by_topic),
        (px4_dive, armed_by_status),
        (sub_dive, armed_by_events),
        (sub_dive, armed_by_messages),
    ],
)
def test_time_disarmed_does_not_count(
    write: Callable[..., Dive], extra: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    dive = write(tmp_path / "dive", n=N, dt=STEP_S, extra=extra())
    judged = judge(read_log(dive.path, dive.robot), improve=False)
    assert judged.seconds == pytest.approx(ARMED_S[1] - ARMED_S[0], abs=0.05)
    asked = asked_between(dive, *ARMED_S)
    np.testing.assert_allclose(judged.asked, asked, rtol=0.01, atol=1e-2 * asked.max())
    assert any("disarmed are left out" in note for note in judged.notes)
    whole = judge(read_log(dive.path, dive.robot, whole=True), improve=False)
    assert whole.seconds == pytest.approx(N * STEP_S, abs=0.1)
    assert not any("disarmed" in note for note in whole.notes)


@pytest.mark.parametrize(
    ("write", "arming", "water"),
    [(px4_dive, armed_by_topic, landed_by_topic), (sub_dive, armed_by_messages, deep_by_height)],
)
def test_time_out_of_the_water_does_not_count(
    write: Callable[..., Dive],
    arming: Callable[..., dict[str, Any]],
    water: Callable[..., dict[str, Any]],
    tmp_path: Path,
) -> None:
    extra = arming() | water()
    dive = write(tmp_path / "dive", n=N, dt=STEP_S, extra=extra)
    judged = judge(read_log(dive.path, dive.robot), improve=False)
    assert judged.seconds == pytest.approx(IN_WATER_S[1] - IN_WATER_S[0], abs=0.05)
    asked = asked_between(dive, *IN_WATER_S)
    np.testing.assert_allclose(judged.asked, asked, rtol=0.01, atol=1e-2 * asked.max())
    assert any("4.0 s before it was in the water" in note for note in judged.notes)


def test_a_robot_that_locks_its_motors_is_as_good_as_disarmed(tmp_path: Path) -> None:
    time = np.array([START_S, *ARMED_S])
    columns = {"armed": np.array([1, 1, 1]), "lockdown": np.array([1, 0, 1])}
    dive = px4_dive(tmp_path / "dive", n=N, extra={"actuator_armed": (time, columns)})
    log = read_log(dive.path, dive.robot)
    assert log.span.sum() == pytest.approx(ARMED_S[1] - ARMED_S[0], abs=0.05)


def test_a_robot_that_never_was_armed_is_told(tmp_path: Path) -> None:
    topic = {"actuator_armed": (np.array([START_S]), {"armed": np.array([0])})}
    dive = px4_dive(tmp_path / "dive", n=200, extra=topic)
    with pytest.raises(FinlabError, match="disarmed in all of it; --whole"):
        read_log(dive.path, dive.robot)
    assert len(read_log(dive.path, dive.robot, whole=True)) == 200


def test_a_detector_that_always_says_landed_is_not_believed(tmp_path: Path) -> None:
    landed = {"vehicle_land_detected": (np.array([START_S]), {"landed": np.array([1])})}
    dive = px4_dive(tmp_path / "dive", n=N, extra=armed_by_topic() | landed)
    log = read_log(dive.path, dive.robot)
    assert log.span.sum() == pytest.approx(ARMED_S[1] - ARMED_S[0], abs=0.05)
    assert any("never left the ground" in note for note in log.notes)


def test_what_a_mode_steers_itself_counts_as_what_outputs_gave(tmp_path: Path) -> None:
    us = np.array([START_S, 16.0]) * 1e6
    modes = {"MODE": ("QB", {"TimeUS": us, "ModeNum": np.array([19, 3])})}
    dive = sub_dive(tmp_path / "dive", n=N, extra=modes)
    log = read_log(dive.path, dive.robot)
    is_steered = log.time >= 16.0
    np.testing.assert_allclose(log.demand[~is_steered], dive.demand[~is_steered], atol=1e-3)
    np.testing.assert_allclose(log.demand[is_steered, :2], dive.given[is_steered, :2], atol=1e-6)
    np.testing.assert_allclose(log.demand[is_steered, 2:], dive.demand[is_steered, 2:], atol=1e-3)
    assert any("what outputs gave counts as asked" in note for note in log.notes)


def test_pulses_in_the_dead_band_of_an_esc_are_no_force(tmp_path: Path) -> None:
    """The robot is armed and holds still: pulses of 1492 to 1508 us, and of 1525, turn no motor."""
    time = START_S + STEP_S * np.arange(N)
    pulse = np.round(1500.0 + 8.0 * np.sin(time))
    pulse[600:] = 1525.0
    columns = {f"C{i}": pulse for i in range(1, 9)}
    extra = armed_by_messages() | {
        "RCOU": ("Q" + "H" * 8, {"TimeUS": np.round(time * 1e6), **columns})
    }
    dive = sub_dive(tmp_path / "dive", n=N, extra=extra)
    log = read_log(dive.path, dive.robot)
    assert log.command is not None and (log.command == 0.0).all()
    assert judge(log, improve=False).watts == 0.0
    assert any("dead band of ESCs, count as 0 N" in note for note in log.notes)
    columns["C1"] = np.full(N, 1526.0)
    extra["RCOU"] = ("Q" + "H" * 8, {"TimeUS": np.round(time * 1e6), **columns})
    moving = read_log(sub_dive(tmp_path / "other", n=N, extra=extra).path, dive.robot)
    assert moving.command is not None
    np.testing.assert_allclose(moving.command[:, 0, 0], 40.0 * 26.0 / 400.0)
