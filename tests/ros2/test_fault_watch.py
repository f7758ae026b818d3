"""The monitor in the node's loop: a robot of finlab's own simulation loses a thruster, which nobody
tells it, and goes on without it."""

import math
from typing import Any

import numpy as np
import pytest
from finlab_allocator.commander import Commander
from finlab_allocator.fault_watch import FaultWatch
from finlab_allocator.frames import StaticFrames
from finlab_allocator.input_checks import NO_STAMP, StampedInput
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


class NodesLoop(TrackingController):
    """A controller whose measurements a commander hears, and whose wrenches it answers."""

    def __init__(self, commander: Commander) -> None:
        super().__init__(commander.layout)
        self.commander = commander
        self.layout = commander.layout
        self.found_at: float | None = None

    def wrench(self, measurement: Measurement, setpoint: Any, delivered: Any) -> Any:
        """Hears first what the sensors say."""
        now = measurement.time
        m = measurement
        turn = Rotation.from_euler("ZYX", [m.yaw, m.pitch, m.roll]).as_quat()
        self.commander.on_imu(m.rates, turn, "base_link", now)
        twist = np.concatenate([m.velocity, m.rates])
        self.commander.on_velocity(StampedInput(twist, "", NO_STAMP), now, now)
        self.commander.on_watch(now)
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
    assert status.level == WARN and f"found: {LOST} lost" in status.message
    left = AuthorityLeft.of(commander.layout, commander)
    assert left.largest[0] < 0.9 * left.whole.largest[0]


def test_without_an_imu_nothing_is_believed() -> None:
    commander = watching()
    commander.on_watch(1.0)
    assert commander.damage is None
    assert "has no sample of the IMU yet" in status_report(commander).message
    off = Commander(Parameters().changed({"robot": ROBOT}), StaticFrames())
    off.on_imu(np.zeros(3), np.array([0, 0, 0, 1.0]), "", 0.0)
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
    commander.on_imu(np.array(rates), np.array(orientation), frame, 1.0)
    assert commander.last_refusal.startswith(sentence)
    commander.on_watch(1.0)
    assert commander.watch is not None and commander.watch.diagnosis is None


def test_an_imu_in_another_frame_is_turned() -> None:
    frames = StaticFrames()
    frames.add("base_link", "imu", (0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))  # upside down
    watch = FaultWatch(finlab.load_layout(ROBOT), "base_link", frames)
    robot = Rotation.from_euler("ZYX", [0.4, 0.2, -0.3])
    of_imu = robot * Rotation.from_euler("x", math.pi)
    watch.on_imu(np.array([0.1, 0.2, 0.3]), of_imu.as_quat(), "imu", 1.0)
    assert watch._attitude == pytest.approx((-0.3, 0.2, 0.4))
    np.testing.assert_allclose(watch._rates, [0.1, -0.2, -0.3], atol=1e-12)
    assert watch.hears(1.2, 0.5) and not watch.hears(1.6, 0.5)


def test_what_somebody_says_is_lost_is_believed_and_taken_back() -> None:
    commander = watching(lost=[LOST])
    assert commander.watch is not None
    (finding,) = commander.watch.findings()
    assert finding.startswith(f"{LOST} lost")
    commander.change({"lost": []})
    assert commander.watch.findings() == []
    commander.change({"monitor": False})
    assert commander.watch is None


def test_all_lost_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    commander = watching()
    assert commander.watch is not None
    commander.on_imu(np.zeros(3), np.array([0, 0, 0, 1.0]), "", 1.0)
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
