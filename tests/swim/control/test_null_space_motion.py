"""Test motions: no wrench, within limits and rates, over after a period, and of use."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.axes import AXES
from finlab.layout import load_layout
from finlab.physics import plant_of
from finlab.swim.control import FaultMonitor
from finlab.swim.control.jump_evidence import LOST
from finlab.swim.control.null_space_motion import PERIOD_S, TEST_SHARE
from tools.judge_monitor import Run, is_right, judged

HEAVY = load_layout("bluerov2_heavy")
SUSPECT = 1
"""Index of a thruster that pushes ahead and aside."""
VERTICAL = [i for i, part in enumerate(HEAVY.actuators) if abs(part.axis[2]) > 0.9]
"""Indices of the thrusters that lift."""
PLANAR = ("Fx", "Fy", "Fz", "Tz")
"""Axes of a task that leaves roll and pitch to the robot's weight."""


def in_doubt(layout_name: str = "bluerov2_heavy", suspect: int = SUSPECT) -> FaultMonitor:
    """A monitor that is in doubt about one thruster."""
    monitor = FaultMonitor(load_layout(layout_name))
    monitor._doubted = suspect
    return monitor


def steady(n: int, force: float = 3.0) -> np.ndarray:
    """The command (n, 3) of a task."""
    command = np.zeros((n, 3))
    command[:, 0] = force
    return command


@pytest.mark.parametrize("axes", [AXES, PLANAR])
def test_forces_go_up_and_down_and_the_wrench_stays(axes: tuple[str, ...]) -> None:
    monitor = in_doubt()
    plant = plant_of(HEAVY)
    command = steady(HEAVY.n)
    kept = np.array([axis in axes for axis in AXES])
    forces = []
    for _ in range(round(PERIOD_S / 0.1)):
        told = monitor.tested(command, axes)
        forces.append(told[SUSPECT, 0] - command[SUSPECT, 0])
        change = plant.wrench(told) - plant.wrench(command)
        np.testing.assert_allclose(change[kept], 0.0, atol=1e-9)
        monitor.sent(told)
    largest = TEST_SHARE * HEAVY.upper[SUSPECT, 0]
    assert max(forces) == pytest.approx(largest, rel=0.05)
    assert min(forces) == pytest.approx(-largest, rel=0.05)
    assert sum(forces) == pytest.approx(0.0, abs=1e-6)


def test_it_is_asked_for_and_ends() -> None:
    monitor = in_doubt()
    command = steady(HEAVY.n)
    np.testing.assert_array_equal(monitor.sent(command), command)
    assert not np.array_equal(monitor.tested(command), command)
    monitor._doubted = -1
    for _ in range(round(PERIOD_S / 0.1)):
        told = monitor.tested(command)
    np.testing.assert_array_equal(told, command)
    assert monitor.tested(command) is command, "nothing is in doubt"


def test_no_more_than_the_task_can_bear() -> None:
    monitor = in_doubt()
    command = steady(HEAVY.n)
    told = [monitor.tested(command, most_n=0.5) for _ in range(12)]
    assert np.abs(np.array(told)[:, SUSPECT, 0] - 3.0).max() == pytest.approx(0.5, rel=0.05)


def test_limits_and_rates_are_kept() -> None:
    layout = HEAVY
    for part in HEAVY.actuators:
        layout = layout.with_actuator(replace(part, rate=4.0))
    monitor = FaultMonitor(layout)
    monitor._doubted = SUSPECT
    near = layout.upper[SUSPECT, 0] - 0.2
    command = steady(layout.n, near)
    before = monitor.sent(command)
    for _ in range(16):
        told = monitor.tested(command)
        assert (told <= layout.upper + 1e-12)[:, 0].all()
        assert np.abs(told - before)[:, 0].max() <= 0.1 * layout.rates[0, 0] + 1e-9
        before = monitor.sent(told)


def test_without_redundancy_there_is_none() -> None:
    """Both vertical thrusters of the vectored robot with six give heave and roll, and no more."""
    six = load_layout("bluerov2")
    vertical = next(i for i, part in enumerate(six.actuators) if abs(part.axis[2]) > 0.9)
    monitor = in_doubt("bluerov2", vertical)
    command = steady(six.n)
    assert monitor.tested(command) is command
    fins = in_doubt("A", 0)
    beat = np.tile([0.5, 1.0, 0.0], (4, 1))
    assert fins.tested(beat) is beat, "forces of fins are not linear in their commands"


def test_lost_thrusters_take_no_part() -> None:
    first, second = VERTICAL[:2]
    monitor = in_doubt(suspect=first)
    monitor._kind[second] = LOST
    command = steady(HEAVY.n)
    command[second] = np.nan
    told = monitor.tested(command, PLANAR)
    assert np.isnan(told[second]).all() and told[first, 0] > command[first, 0]


def test_a_suspect_that_is_named_meanwhile_ends_it() -> None:
    """The others go back within their rates."""
    monitor = in_doubt(suspect=VERTICAL[0])
    command = steady(HEAVY.n)
    for _ in range(4):
        told = monitor.tested(command, PLANAR)
    assert not np.array_equal(told, command)
    monitor._kind[VERTICAL[0]] = LOST
    command[VERTICAL[0]] = np.nan
    for _ in range(3):
        told = monitor.tested(command, PLANAR)
    np.testing.assert_array_equal(told, command)


def test_a_test_tells_sooner_what_is_broken() -> None:
    """A thruster that a gentle swim hardly uses."""
    alone = judged(Run(8, "imu", "weak", 70_000))
    tested = judged(Run(8, "imu+test", "weak", 70_000))
    named = [
        next(t for t, name, _ in r["events"] if name == r["actuator"]) for r in (alone, tested)
    ]
    assert named[1] < named[0]
    assert is_right(tested, tested["duration_s"])
    assert {name for _, name, _ in tested["events"]} == {tested["actuator"]}
