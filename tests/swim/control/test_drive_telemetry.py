"""What drives say of themselves, as evidence: alone by numbers, and in the loop of a robot in MuJoCo."""

import math

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.layout import load_layout
from finlab.swim.control import DriveTelemetry, FaultMonitor, Finding, Measurement
from finlab.swim.control.completion import axes_of
from finlab.swim.control.drive_telemetry import (
    LEARNED_SAMPLES,
    LOG_RATIO_MAX,
    MODE_SHARES,
    DriveEvidence,
)
from finlab.swim.control.jump_evidence import KINDS, LOST, REVERSED, STUCK, WEAK, WHOLE
from finlab.swim.control.motion_model import MotionModel
from tests.plant_mujoco import MujocoRobot, Path, TrueFault

LAYOUT = load_layout("bluerov2_heavy")
FORCE = 10.0
"""What each thruster is told [N]."""
SPEED = 1500.0
"""The speed of a drive at that force [rpm]."""
CURRENT_A = 3.0
"""Its current [A]."""
SLOT = np.array([0], dtype=np.int32)
"""Of the moment that is looked at."""
ALL_WHOLE = np.full(8, WHOLE)
"""What is believed of the actuators."""


class Bench:
    """Evidence of thrusters that are told a constant force; sample by sample."""

    def __init__(self) -> None:
        model = MotionModel(LAYOUT)
        command = np.zeros((8, 3))
        command[:, 0] = FORCE
        for _ in range(50):
            model.motion.step(command, 0.1)
        self.evidence = DriveEvidence(model, 13)
        self.time_s = 0.0

    def take(self, speed: float, current: float, count: int = 1, is_signed: bool = True) -> None:
        """So many samples; those of all but the first drive are in order."""
        for _ in range(count):
            self.time_s += 0.1
            speeds = np.full(8, SPEED)
            currents = np.full(8, CURRENT_A)
            speeds[0] = speed
            currents[0] = current
            self.evidence.note_force(self.time_s)
            telemetry = DriveTelemetry(speeds, currents, np.zeros(8), is_signed)
            self.evidence.take(telemetry, self.time_s)

    def ratios(self) -> Array:
        """Of the kinds of the first drive since the moment (5,)."""
        return np.asarray(self.evidence.log_ratios(SLOT, ALL_WHOLE)[0, 0])


@pytest.fixture
def bench() -> Bench:
    """One whose scales are known, at a moment that begins now."""
    bench = Bench()
    bench.take(SPEED, CURRENT_A, LEARNED_SAMPLES + 5)
    bench.evidence.begin(0)
    return bench


@pytest.mark.parametrize(
    ("speed", "current", "kind"),
    [
        (0.0, 0.0, LOST),
        (1.1 * SPEED, 0.15 * CURRENT_A, LOST),
        (-SPEED, CURRENT_A, REVERSED),
        (0.6 * SPEED, 0.6**3 * CURRENT_A, WEAK),
        (0.65 * SPEED, 2.5 * 0.65**3 * CURRENT_A, WEAK),
        (1.9 * SPEED, 1.9**3 * CURRENT_A, STUCK),
    ],
)
def test_each_fault_has_its_signature(
    bench: Bench, speed: float, current: float, kind: int
) -> None:
    """What a drive does speaks for one kind, at once, and for no more than it may."""
    bench.take(speed, current, 3)
    ratios = bench.ratios()
    assert int(ratios.argmax()) == kind, KINDS[int(ratios.argmax())]
    assert ratios[kind] > 2.0
    bench.take(speed, current, 200)
    assert bench.ratios().max() <= LOG_RATIO_MAX


def test_a_drive_that_runs_speaks_for_no_fault(bench: Bench) -> None:
    bench.take(SPEED, CURRENT_A, 20)
    ratios = bench.ratios()
    assert ratios[WHOLE] == 0.0
    np.testing.assert_allclose(
        ratios[[LOST, WEAK]], np.log(MODE_SHARES[[LOST, WEAK], 0] / 0.97), atol=0.05
    )


def test_a_speed_without_a_sign_says_nothing_of_the_way(bench: Bench) -> None:
    bench.take(-SPEED, CURRENT_A, 10, is_signed=False)
    assert bench.ratios()[REVERSED] < 0.0


def test_a_sample_counts_once_and_an_old_one_not_at_all(bench: Bench) -> None:
    bench.take(0.0, 0.0)
    once = bench.ratios()
    speeds = np.zeros(8)
    for late_s in (0.05, 2.0):
        ages = np.full(8, late_s)
        bench.evidence.note_force(bench.time_s + late_s)
        bench.evidence.take(DriveTelemetry(speeds, speeds, ages), bench.time_s + late_s)
    np.testing.assert_array_equal(bench.ratios(), once)


def test_a_sample_is_held_against_the_force_of_its_time(bench: Bench) -> None:
    """Half a second after a thruster was told to push the other way, a sample of before is that of
    a drive that runs."""
    model = bench.evidence._model
    command = np.zeros((8, 3))
    command[:, 0] = -FORCE
    taken_s = bench.time_s
    for _ in range(5):
        model.motion.step(command, 0.1)
        bench.time_s += 0.1
        bench.evidence.note_force(bench.time_s)
    ages = np.full(8, bench.time_s - taken_s - 0.01)
    telemetry = DriveTelemetry(np.full(8, -0.9 * SPEED), np.full(8, CURRENT_A), ages)
    bench.evidence.take(telemetry, bench.time_s)
    assert bench.ratios()[REVERSED] < 0.0


def test_without_currents_a_slow_one_is_not_called_fouled(bench: Bench) -> None:
    bench.take(0.65 * SPEED, math.nan, 30)
    assert not bench.evidence.fouled.any()
    bench.take(0.65 * SPEED, 2.5 * 0.65**3 * CURRENT_A, 10)
    assert bench.evidence.fouled.tolist() == [True] + [False] * 7
    bench.take(SPEED, CURRENT_A, 30)
    assert not bench.evidence.fouled.any()


def swim(robot: MujocoRobot, seed: int, until_s: float, lies_from_s: float) -> list[Finding]:
    """Findings of a swim in which telemetry of the first drive reads 0 from some time on."""
    axes = axes_of(LAYOUT)
    path = Path(LAYOUT, axes, seed, gentle=True)
    allocator = Allocator(LAYOUT)
    monitor = FaultMonitor(LAYOUT)
    command = None
    found: list[Finding] = []
    for tick in range(round(until_s / 0.1)):
        measurement: Measurement = robot.measure()
        assert measurement.drives is not None
        if 0.1 * tick > lies_from_s:
            measurement.drives.speed[0] = 0.0
            measurement.drives.current[0] = 0.0
        if tick == 120 and lies_from_s > until_s:
            robot.fail(TrueFault(2, "weak", 12.0, 0.3))
        verdict = monitor.step(measurement, command)
        found += [each for each in verdict.findings if each not in found]
        wrench = path.wrench(0.1 * tick, measurement, is_closed=False)
        answer = allocator.allocate(wrench, damage=verdict.damage, policy="closest")
        command = monitor.sent(answer.command)
        robot.step(command, 0.1)
    return found


def test_telemetry_that_lies_names_nothing() -> None:
    """A line that reads 0 on one drive, while the robot moves as it should."""
    robot = MujocoRobot(LAYOUT, 31, sensors="imu+esc")
    assert swim(robot, 31, 30.0, lies_from_s=12.0) == []


def test_a_fouled_thruster_is_called_so() -> None:
    robot = MujocoRobot(LAYOUT, 32, sensors="imu+esc")
    robot.actuators.drives._causes[:] = 0.0  # weed
    found = swim(robot, 32, 22.0, lies_from_s=math.inf)
    assert {each.name for each in found} == {LAYOUT.names[2]}
    assert found[-1].kind == "fouled"
    assert found[-1].value == pytest.approx(0.3, abs=0.15)
