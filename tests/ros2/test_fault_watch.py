"""The monitor in the node's loop: a robot of finlab's own simulation loses a thruster, which nobody
tells it, and goes on without it."""

import math
from typing import Any

import numpy as np
import pytest
from finlab_allocator.commander import Commander
from finlab_allocator.fault_watch import FaultWatch
from finlab_allocator.frames import StaticFrames
from finlab_allocator.input_checks import NO_STAMP, DriveSample, ImuSample, StampedInput
from finlab_allocator.parameters import Parameters
from finlab_allocator.status_report import WARN, AuthorityLeft, status_report
from scipy.spatial.transform import Rotation

import finlab
from finlab.allocation import Allocation
from finlab.swim.control import Measurement, TrackingController
from finlab.swim.simulation import ClosedLoop, make_trajectory

ROBOT = "bluerov2_heavy"
LOST = "front_left"
LOST_AT_S = 15.0
CLOCK_AHEAD_S = 1000.0
"""The clock of stamps, over that of the loop [s]."""
AT_REST = np.array([0, 0, 0, 1.0])
"""Orientation of a robot that lies still."""


class NodesLoop(TrackingController):
    """A controller whose measurements a commander hears, and whose wrenches it answers."""

    def __init__(self, commander: Commander) -> None:
        super().__init__(commander.layout)
        self.commander = commander
        self.layout = commander.layout
        self.found_at: float | None = None
        self.answered_anew: list[float] = []

    def wrench(self, measurement: Measurement, setpoint: Any, delivered: Any) -> Any:
        """Hears first what the sensors say."""
        now = measurement.time
        m = measurement
        turn = Rotation.from_euler("ZYX", [m.yaw, m.pitch, m.roll]).as_quat()
        clock = now + CLOCK_AHEAD_S
        self.commander.on_imu(ImuSample(m.rates, turn, "base_link", clock), now, clock)
        twist = np.concatenate([m.velocity, m.rates])
        velocity = StampedInput(twist, "", clock - m.ages[2])
        self.commander.on_velocity(velocity, now, clock)
        answered = self.commander.on_watch(now)
        if answered is not None:
            self.answered_anew.append(now)
        if self.found_at is None and self.commander.damage is not None:
            self.found_at = now
        self.now = now
        return super().wrench(measurement, setpoint, delivered)

    def allocate(self, wrench: Any, **_: Any) -> Allocation:
        """In place of an allocator."""
        sent = self.commander.on_wrench(StampedInput(wrench, "", NO_STAMP), self.now, self.now)
        assert sent is not None, self.commander.last_refusal
        assert sent.answer is not None, self.commander.failure
        return sent.answer


def watching(robot: str = ROBOT, **parameters: Any) -> Commander:
    """A commander that watches."""
    values = {"robot": robot, "monitor": True, "policy": "direction", **parameters}
    commander = Commander(Parameters().changed(values), StaticFrames())
    commander.activate()
    return commander


def test_a_lost_thruster_is_named_and_done_without(monkeypatch: pytest.MonkeyPatch) -> None:
    commander = watching()
    node = NodesLoop(commander)
    allocator = finlab.Allocator(commander.layout)
    monkeypatch.setattr(allocator, "allocate", node.allocate)
    loop = ClosedLoop(
        commander.layout,
        allocator,
        make_trajectory("lissajous"),
        node,
        failures=[(LOST, LOST_AT_S)],
        announced=False,
    )
    while loop.time < LOST_AT_S + 8.0:
        loop.step()
    assert node.found_at is not None and LOST_AT_S < node.found_at < LOST_AT_S + 5.0
    assert commander.damage is not None and list(commander.damage.lost) == [LOST]
    assert commander.command is not None
    assert np.isnan(commander.command[commander.layout.index(LOST)]).all()
    status = status_report(commander)
    assert status.level == WARN and f"found: {LOST} lost for" in status.message
    values = dict(status.values)
    assert values[f"{LOST}: kind"] == "lost"
    assert float(values[f"{LOST}: age [s]"]) == pytest.approx(loop.time - LOST_AT_S, abs=1.0)
    assert 0.5 < float(values[f"{LOST}: probability"]) <= 1.0
    assert node.found_at in node.answered_anew, "what was asked for is answered anew at once"
    left = AuthorityLeft.of(commander.layout, commander)
    assert left.largest[0] < 0.9 * left.whole.largest[0]


def test_without_an_imu_nothing_is_believed() -> None:
    commander = watching()
    commander.on_watch(1.0)
    assert commander.damage is None
    assert "has no sample of the IMU yet" in status_report(commander).message
    off = Commander(Parameters().changed({"robot": ROBOT}), StaticFrames())
    off.on_imu(ImuSample(np.zeros(3), AT_REST, "", NO_STAMP), 0.0, 0.0)
    off.on_watch(0.0)
    assert off.watch is None


@pytest.mark.parametrize(
    ("rates", "orientation", "frame", "sentence"),
    [
        ([0, 0, math.nan], [0, 0, 0, 1.0], "", "imu: expected finite rates"),
        ([0, 0, 0], [0, 0, 0, 0.0], "", "imu: expected finite rates and an orientation"),
        ([0, 0, 0], [0, 0, 0, 1.0], "gyro", "frame 'gyro': no static transform"),
    ],
)
def test_a_bad_sample_is_refused(
    rates: list[float], orientation: list[float], frame: str, sentence: str
) -> None:
    commander = watching()
    sample = ImuSample(np.array(rates), np.array(orientation), frame, NO_STAMP)
    commander.on_imu(sample, 1.0, 1.0)
    assert commander.last_refusal.startswith(sentence)
    commander.on_watch(1.0)
    assert commander.watch is not None and commander.watch.diagnosis is None


def test_an_imu_in_another_frame_is_turned() -> None:
    frames = StaticFrames()
    frames.add("base_link", "imu", (0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))  # upside down
    watch = FaultWatch(finlab.load_layout(ROBOT), Parameters(), frames)
    robot = Rotation.from_euler("ZYX", [0.4, 0.2, -0.3])
    of_imu = robot * Rotation.from_euler("x", math.pi)
    rates = np.array([0.1, 0.2, 0.3])
    watch.on_imu(ImuSample(rates, of_imu.as_quat(), "imu", NO_STAMP), 1.0)
    assert watch._attitude == pytest.approx((-0.3, 0.2, 0.4))
    np.testing.assert_allclose(watch._rates, [0.1, -0.2, -0.3], atol=1e-12)
    assert watch.hears(1.2, 0.5) and not watch.hears(1.6, 0.5)


def test_what_somebody_says_is_lost_is_believed_and_taken_back() -> None:
    commander = watching(lost=[LOST])
    assert commander.watch is not None
    assert commander.watch.phrases() == [f"{LOST} lost, as was said"]
    commander.change({"lost": []})
    assert commander.watch.phrases() == []
    commander.change({"monitor": False})
    assert commander.watch is None


def test_all_lost_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    commander = watching()
    assert commander.watch is not None
    commander.on_imu(ImuSample(np.zeros(3), AT_REST, "", NO_STAMP), 1.0, 1.0)
    everything = finlab.Damage(lost=commander.layout.names)
    monkeypatch.setattr(commander.watch, "step", lambda *_: everything)
    commander.on_watch(1.0)
    assert commander.damage is None
    all_but_one = finlab.Damage(lost=commander.layout.names[1:])
    monkeypatch.setattr(commander.watch, "step", lambda *_: all_but_one)
    commander.on_watch(1.0)
    assert commander.damage == all_but_one
    commander.change({"lost": [commander.layout.names[0]]})
    assert commander.damage is None, "what is said counts more than what was found"
    sent = commander.on_wrench(StampedInput(np.ones(6), "", NO_STAMP), 1.0, 1.0)
    assert sent is not None and sent.answer is not None


def imu_at(taken_s: float) -> ImuSample:
    """A sample at rest, with that stamp."""
    return ImuSample(np.zeros(3), AT_REST, "", taken_s)


def test_samples_are_as_old_as_their_stamps_and_count_once(monkeypatch: pytest.MonkeyPatch) -> None:
    commander = watching()
    assert commander.watch is not None
    seen: list[tuple[Measurement, Any]] = []
    step = commander.watch._monitor.step

    def noted(measurement: Measurement, command: Any) -> Any:
        seen.append((measurement, command))
        return step(measurement, command)

    monkeypatch.setattr(commander.watch._monitor, "step", noted)
    clock_s = 500.0  # while now is 2.0
    velocity = StampedInput(np.array([0.1, 0, 0, 0, 0, 0]), "", clock_s - 0.3)
    commander.on_velocity(velocity, 2.0, clock_s)
    commander.on_imu(imu_at(clock_s - 0.05), 2.0, clock_s)
    commander.on_watch(2.01)
    commander.on_watch(2.11)  # nothing new
    ((measurement, _),) = seen
    assert measurement.time == pytest.approx(1.95)
    assert measurement.ages[2] == pytest.approx(0.25)
    commander.on_imu(imu_at(clock_s - 1.0), 2.2, clock_s + 0.2)
    assert commander.last_refusal.startswith("imu: its stamp is 1.2 s old")
    assert len(seen) == 1


def test_other_sensors_are_heard_where_a_parameter_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean of an accelerometer's samples in the robot's frame, depths, and drives by name, all
    as old as their stamps say."""
    commander = watching(accelerometer=True, pressure=True, drives="unsigned")
    assert commander.watch is not None
    commander._frames.add("base_link", "imu", (0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))  # upside down
    seen: list[Measurement] = []
    step = commander.watch._monitor.step
    monkeypatch.setattr(
        commander.watch._monitor, "step", lambda m, c: (seen.append(m), step(m, c))[1]
    )
    clock_s = 500.0
    upside_down = np.array([1.0, 0.0, 0.0, 0.0])
    for force in (-9.0, -10.0):
        acceleration = np.array([0.0, 0.5, force])
        sample = ImuSample(np.zeros(3), upside_down, "imu", clock_s, acceleration)
        commander.on_imu(sample, 2.0, clock_s)
    commander.on_pressure(29430.0, clock_s - 0.1, 2.0, clock_s)
    names = ("rear_left", LOST)
    drives = DriveSample(names, np.array([900.0, 0.0]), np.array([1.5, math.nan]), clock_s - 0.05)
    commander.on_drives(drives, 2.0, clock_s)
    commander.on_watch(2.01)
    (measurement,) = seen
    np.testing.assert_allclose(measurement.acceleration, [0.0, -0.5, 9.5])
    np.testing.assert_allclose(commander.watch._monitor.accelerometer_place, [0.1, 0.0, 0.0])
    assert measurement.depth == pytest.approx(3.0)
    assert measurement.ages[1] == pytest.approx(0.1)
    telemetry = measurement.drives
    assert telemetry is not None and not telemetry.is_signed
    index = commander.layout.index("rear_left")
    assert (telemetry.speed[index], telemetry.current[index]) == (900.0, 1.5)
    assert telemetry.ages[index] == pytest.approx(0.05)
    assert np.isnan(telemetry.current[commander.layout.index(LOST)])
    commander.on_drives(drives._replace(names=("bow", "stern")), 2.1, clock_s)
    assert commander.last_refusal.startswith("drives: no actuator 'bow', expected names of")
    commander.on_pressure(math.nan, NO_STAMP, 2.1, clock_s)
    assert commander.last_refusal == "pressure: expected a finite number of Pa, got nan"
    values = dict(status_report(commander).values)
    assert values["depth [m]"] == "3.000"
    assert values["drives heard"] == f"{LOST}, rear_left"


def test_other_sensors_are_off_by_default() -> None:
    commander = watching()
    assert commander.watch is not None
    sample = imu_at(NO_STAMP)._replace(acceleration=np.array([0.0, 0.0, 9.81]))
    commander.on_imu(sample, 1.0, 1.0)
    commander.on_pressure(29430.0, NO_STAMP, 1.0, 1.0)
    speeds = DriveSample((LOST,), np.zeros(1), np.zeros(1), NO_STAMP)
    commander.on_drives(speeds, 1.0, 1.0)
    assert not commander.watch._force_count and math.isnan(commander.watch._depth)
    assert np.isnan(commander.watch._drive_speed).all()
    assert not {"depth [m]", "drives heard"} & set(dict(status_report(commander).values))


def test_the_monitor_is_told_the_command_that_was_in_force() -> None:
    commander = watching()
    watch = commander.watch
    assert watch is not None
    for number in range(10):
        watch.on_command(np.full((8, 3), float(number)), 0.1 * number)
    watch.on_imu(imu_at(NO_STAMP), 0.52)
    watch.step()
    watch.on_imu(imu_at(NO_STAMP), 0.61)
    command = watch._command_until(0.61)
    assert command is not None and command[0, 0] == 5.0, "0.5 s to 0.6 s, mostly"
    command = watch._command_until(0.80)
    assert command is not None and command[0, 0] == 6.0


FAULTS = {
    "lost": (0.0, "front_left lost for"),
    "weak": (0.4, "front_left weak or fouled, at 40 % for"),
    "reversed": (-1.0, "front_left reversed for"),
    "stuck": (math.nan, "front_left stuck at 12 N for"),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_status_and_authority_tell_of_each_kind(kind: str) -> None:
    commander = watching()
    watch = commander.watch
    assert watch is not None
    strength, words = FAULTS[kind]
    wrench = StampedInput(np.array([20.0, 0, 0, 0, 0, 0]), "", NO_STAMP)
    before = commander.on_wrench(wrench, 1.0, 1.0)
    assert before is not None
    if kind == "stuck":  # by the monitor, as if it had found that
        watch._monitor.tell(LOST, 1.0, stuck=12.0)
    else:
        watch._monitor.tell(LOST, strength)
    commander.on_imu(imu_at(NO_STAMP), 1.05, 1.05)
    after = commander.on_watch(1.05)
    assert after is not None and after.answer is not None, "answered anew at once"
    index = commander.layout.index(LOST)
    asked = after.command[index, 0]
    given = {"weak": strength * asked, "stuck": 12.0}.get(kind, 0.0)
    if kind == "weak":
        assert given == pytest.approx(after.answer.command[index, 0]), "it is asked for more"
    elif kind != "stuck":
        assert math.isnan(asked)
    status = status_report(commander)
    values = dict(status.values)
    assert f"found: {words}" in status.message
    assert values[f"{LOST}: kind"] == kind and values["unknown"] == "false"
    left = AuthorityLeft.of(commander.layout, commander)
    assert left.largest[0] < 0.95 * left.whole.largest[0]
    assert len(left.reports()) == 6


def test_what_no_fault_explains_is_said() -> None:
    commander = watching()
    watch = commander.watch
    assert watch is not None
    commander.on_imu(imu_at(NO_STAMP), 1.0, 1.0)
    commander.on_watch(1.0)
    assert watch.diagnosis is not None
    watch.diagnosis = watch.diagnosis._replace(unknown=True)
    status = status_report(commander)
    assert status.level == WARN and "unknown: the robot moves as no fault" in status.message
    assert dict(status.values)["unknown"] == "true"
