"""The fault monitor on robots in MuJoCo that are not quite as drawn: body, actuators, water and
sensors are off as `tests/plant_mujoco.py` says.

`python -m tools.judge_monitor` swims hundreds of such runs; here are a few.
"""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.layout import load_layout
from finlab.swim.control import Completion, FaultMonitor
from finlab.swim.control.completion import axes_of
from tests.plant_mujoco import NO_NOISE, NO_SPREAD, MujocoRobot, Path, TrueFault, random_frame
from tools.judge_monitor import Run, is_right, judged

FIRST = 20_016
"""Number of the first run; those that judge have smaller ones."""


@pytest.mark.parametrize("name", ["bluerov2_heavy", "turtle_hybrid"])
def test_mujoco_moves_the_robot_as_the_equations_say(name: str) -> None:
    """Accelerations of MuJoCo are those computed here, added mass and all: the forces that stand
    for the water are the right ones."""
    layout = load_layout(name)
    robot = MujocoRobot(layout, 1)
    command = 0.3 * (layout.lower + layout.upper)
    command[:, 0] += 0.2 * layout.upper[:, 0]
    for _ in range(100):
        R = robot.rotation
        robot.step(command, 0.02)
        qacc = robot.data.qacc
        np.testing.assert_allclose(R.T @ qacc[:3], robot.acceleration[:3], atol=1e-10)
        np.testing.assert_allclose(qacc[3:], robot.acceleration[3:], atol=1e-10)
    assert np.abs(robot.motion).max() > 0.05, "it moved"


def test_the_plant_comes_to_the_speed_that_a_sheet_of_paper_says() -> None:
    """Surge of a robot as drawn: thrust equals d_1 u + d_2 u^2."""
    heavy = load_layout("bluerov2_heavy")
    assert heavy.body is not None
    # Added mass that is the same along all axes has no moment of Munk's, which would turn it.
    added_mass = (10.0, 10.0, 10.0, 0.1, 0.1, 0.1)
    layout = replace(heavy, body=replace(heavy.body, buoyancy_n=None, added_mass=added_mass))
    robot = MujocoRobot(layout, 2, spread=NO_SPREAD, noise=NO_NOISE)
    thrust = 10.0
    command = Allocator(layout).allocate([thrust, 0.0, 0.0, 0.0, 0.0, 0.0]).command
    robot.step(command, 30.0)
    d_1 = 4.03
    d_2 = 18.18
    speed = (-d_1 + np.sqrt(d_1**2 + 4.0 * d_2 * thrust)) / (2.0 * d_2)
    assert robot.motion[0] == pytest.approx(speed, rel=1e-3)


def test_a_stuck_thruster_of_the_plant_keeps_its_force() -> None:
    layout = random_frame(1)
    robot = MujocoRobot(layout, 3)
    command = np.zeros((layout.n, 3))
    command[2, 0] = 5.0
    robot.step(command, 2.0)
    robot.fail(TrueFault(2, "stuck", 2.0))
    command[2, 0] = -5.0
    given = robot.actuators.nominal(command, np.zeros(6))
    whole = robot.actuators.nominal(command, np.zeros(6), whole=True)
    np.testing.assert_allclose(given, -whole, rtol=1e-3)


@pytest.mark.parametrize(
    ("offset", "kind", "sensors"),
    [(0, "lost", "dvl"), (12, "reversed", "dvl"), (5, "stuck", "dvl"), (6, "weak", "dvl")]
    + [(12, "lost", "imu")],
)
def test_what_breaks_is_named_and_made_up_for(offset: int, kind: str, sensors: str) -> None:
    """Within three seconds after it shows; nothing else is named, and what the robot gives is what
    it is asked for."""
    result = judged(Run(FIRST + offset, sensors, kind))
    assert is_right(result, (result["shown_s"] or result["time_s"]) + 3.0)
    assert {name for _, name, _ in result["events"]} == {result["actuator"]}
    assert result["error"] < 0.1 < result["error_of_unaware"]


def test_a_stuck_thruster_that_obeys_again_is_taken_back() -> None:
    """The allocator asks it for the force at which it was stuck: by that alone nothing would ever
    show. One that stays stuck is called so throughout."""
    layout = random_frame(20_017)
    axes = axes_of(layout)
    named = {}
    for is_repaired in (False, True):
        robot = MujocoRobot(layout, 17)
        path = Path(layout, axes, 17, gentle=False)
        allocator = Allocator(layout)
        monitor = FaultMonitor(layout)
        command = None
        for tick in range(400):
            if tick == 120:
                robot.fail(TrueFault(2, "stuck", 12.0))
            measurement = robot.measure()
            verdict = monitor.step(measurement, command)
            kinds = [finding.kind for finding in verdict.findings]
            if tick == 180:
                assert kinds == ["stuck"]
                if is_repaired:
                    robot.actuators.stuck_at[2] = np.nan
            wanted = path.wrench(0.1 * tick, measurement, is_closed=True)
            wrench = Completion(layout, verdict.damage, axes)(wanted)
            answer = allocator.allocate(wrench, damage=verdict.damage, policy="closest")
            command = monitor.sent(answer.command)
            robot.step(command, 0.1)
        named[is_repaired] = kinds
    assert named == {False: ["stuck"], True: []}


@pytest.mark.parametrize(("offset", "sensors"), [(1, "dvl"), (7, "imu")])
def test_nothing_is_named_where_nothing_breaks(offset: int, sensors: str) -> None:
    """Two minutes with a body that is off by a fifth in all its numbers."""
    result = judged(Run(FIRST + offset, sensors, None))
    assert result["events"] == []
    assert result["unknown_s"] == 0.0


def test_a_tether_that_pulls_is_no_fault() -> None:
    """A force that no actuator gives is said to be unknown, and nothing is named."""
    layout = load_layout("bluerov2_heavy")
    robot = MujocoRobot(layout, 11)
    axes = axes_of(layout)
    path = Path(layout, axes, 11, gentle=False)
    allocator = Allocator(layout)
    monitor = FaultMonitor(layout)
    command = None
    was_unknown = False
    for tick in range(220):
        if tick == 150:
            robot.data.xfrc_applied[1, :3] = 6.0, -9.0, 4.0
        measurement = robot.measure()
        verdict = monitor.step(measurement, command)
        assert verdict.findings == ()
        was_unknown |= verdict.unknown
        wrench = path.wrench(0.1 * tick, measurement, is_closed=True)
        answer = allocator.allocate(wrench, damage=verdict.damage, policy="closest")
        command = monitor.sent(answer.command)
        robot.step(command, 0.1)
    assert was_unknown
