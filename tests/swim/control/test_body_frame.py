"""The paper's two controllers in the closed loop, and their laws at a moment."""

import math
from itertools import starmap

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.swim import control
from finlab.swim.control.body_frame import Pid
from finlab.swim.control.contract import NO_WRENCH
from finlab.swim.simulation import NO_NOISE, ClosedLoop, RunLog, Trajectory, straight
from tests.allocator_cache import AllocatorCache
from tests.sampled_cases import sampled

AT_REST = control.Measurement(
    0.0, np.array([0.0, 0.0, -1.0]), 0.0, np.zeros(3), 1.0, np.zeros(3), 0.0, 0.0
)
"""A measurement of a robot that is at rest, one metre under water."""


def swim_log(
    name: str, method: AllocatorCache, task: Trajectory, controller: str, lost: int = 0
) -> RunLog:
    """A swim along a path, with `lost` fins lost that leave it steerable."""
    robot = load_layout(name)
    loop = ClosedLoop(
        robot,
        method.on(robot),
        task,
        control.make_controller(controller, robot),
        sensors=NO_NOISE,
        failures=[(fin, 0.0) for fin in control.steerable_loss(robot, lost) or ()],
    )
    loop.state[:3] = 0.0, 0.0, -1.0
    return loop.run()


@pytest.mark.parametrize(
    ("name", "lost"),
    sampled(starmap(pytest.param, [("A", 2), ("A", 0), ("B", 0), ("C", 1), ("D", 0)]), every=3),
)
def test_a_waypoint_is_reached_and_kept(name: str, lost: int, analytic: AllocatorCache) -> None:
    there = np.array([0.9, -0.7, -1.4])
    log = swim_log(
        name,
        analytic,
        Trajectory("there", np.array([0.0, 45.0]), np.tile(there, (2, 1))),
        "waypoint",
        lost,
    )
    away = np.linalg.norm(log.position - there, axis=1)
    assert away[0] > 1.0 and away[log.time > 35.0].max() < 0.1


@pytest.mark.parametrize(("name", "speed"), [("A", 0.1), ("B", 0.15), ("C", 0.15), ("D", 0.2)])
def test_speed_and_depth_are_kept(name: str, speed: float, analytic: AllocatorCache) -> None:
    log = swim_log(name, analytic, straight(30.0, speed), "velocity")
    late = log.time > 20.0
    assert log.motion[late, 0].mean() == pytest.approx(speed, rel=0.03)
    assert np.abs(log.position[late, 2] + 1.0).max() < 0.04


def wrench_at(controller: control.WaypointController, x: float, y: float, z: float) -> Array:
    """Wrench (6,) of a controller at rest, whose setpoint is at x, y, z [m]."""
    controller.reset()
    return controller.wrench(AT_REST, control.Setpoint(np.array([x, y, z]), 0.0), NO_WRENCH)


def test_the_printed_law_of_a_waypoint_at_rest() -> None:
    controller = control.WaypointController(load_layout("A"))
    k_d, k_z, k_psi = controller.gains
    most = controller.max_wrench
    ahead = wrench_at(controller, 0.3, 0.1, -1.1)
    e = math.atan2(0.1, 0.3)
    expected = [k_d * math.hypot(0.3, 0.1) * math.cos(e), 0.0, -0.1 * k_z, 0.0, 0.0, k_psi * e]
    np.testing.assert_allclose(ahead, expected, atol=1e-9)
    behind = wrench_at(controller, -0.5, -0.1, -1.0)
    assert behind[0] == 0.0 and behind[5] < 0.0
    assert (np.abs(wrench_at(controller, 900.0, 900.0, 900.0)) <= most).all()


def test_the_yaw_rate_is_damped_and_bounded() -> None:
    controller = control.VelocityController(load_layout("A"))
    turning = AT_REST._replace(rates=np.array([0.0, 0.0, 0.2]))
    wrench = controller.wrench(
        turning, control.Setpoint(np.array([0.0, 0.0, -1.0]), 0.0), NO_WRENCH
    )
    np.testing.assert_allclose(wrench, [0, 0, 0, 0, 0, -0.2 * controller.yaw_damping], atol=1e-9)
    spun = AT_REST._replace(rates=np.array([0.0, 0.0, -99.0]))
    wrench = controller.wrench(spun, control.Setpoint(np.array([50.0, 0.0, 50.0]), 9.0), NO_WRENCH)
    bounds = controller.surge.max_force, controller.depth.max_force, controller.max_yaw
    np.testing.assert_allclose(wrench[[0, 2, 5]], bounds)


def test_a_bounded_force_does_not_wind_up_the_integral() -> None:
    pid = Pid(2.0, 1.0, 0.0, max_force=3.0)
    held = [pid.step(5.0) for _ in range(600)]  # as of a robot that is held fast for a minute
    assert held == [3.0] * 600 and abs(pid.integral_force) < 3.0
    assert pid.step(-0.1) < 3.0 and pid.integral_force < 3.0


def test_an_integral_makes_up_for_a_force_that_stays() -> None:
    pid = Pid(2.0, 1.0, 3.0, max_force=5.0)
    height = 0.0
    climb = 0.0
    for _ in range(600):
        climb += 0.1 * (pid.step(-height) - 1.5 - climb)
        height += 0.1 * climb
    assert height == pytest.approx(0.0, abs=1e-3) and pid.integral_force == pytest.approx(
        1.5, abs=0.01
    )


@pytest.mark.parametrize("name", [name for name in control.CONTROLLERS if name != "tracking"])
def test_what_dives_by_its_pitch_is_refused(name: str) -> None:
    with pytest.raises(FinlabError, match="'torpedo' cannot give"):
        control.make_controller(name, load_layout("torpedo"))


def test_an_unknown_controller_is_a_sentence() -> None:
    with pytest.raises(FinlabError, match="one of tracking, waypoint, velocity, got 'pd'"):
        control.make_controller("pd", load_layout("A"))
