"""The paper's two body-frame controllers, in single calls and in swims of its layouts."""

import numpy as np
import pytest

import finlab
from finlab.control import Controller, Measurement, Setpoint, controller_of
from finlab.errors import FinlabError
from finlab.sim import ClosedLoop, RunLog, make_trajectory, straight
from finlab.sim.task import Trajectory, station


def swum(name: str, law: str, path: object, **options: object) -> RunLog:
    layout = finlab.load_layout(name)
    allocator = finlab.Allocator(layout)
    return ClosedLoop(layout, allocator, path, controller_of(law, layout), **options).run()  # type: ignore[arg-type]


def seen(yaw: float = 0.0, surge: float = 0.0, rate: float = 0.0) -> Measurement:
    motion, rates = np.array([surge, 0.0, 0.0]), np.array([0.0, 0.0, rate])
    return Measurement(0.0, np.array([0.0, 0.0, -1.0]), yaw, motion, 1.0, rates, 0.0, 0.0)


def asked(law: Controller, x: float, y: float, z: float = -1.0, **now: float) -> np.ndarray:
    law.reset()
    return law.wrench(seen(**now), Setpoint(np.array([x, y, z]), 0.1), np.zeros(6))


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_the_waypoints_law_is_the_printed_one(yaw: float) -> None:
    law = controller_of("waypoint", finlab.load_layout("A"))
    side = np.array([np.cos(yaw + 0.4), np.sin(yaw + 0.4)])
    near, far = (asked(law, *(reach * side), -0.98, yaw=yaw) for reach in (0.2, 0.3))
    ahead = asked(law, *(0.2 * np.array([np.cos(yaw), np.sin(yaw)])), -0.98, yaw=yaw)
    assert far[0] == pytest.approx(1.5 * near[0])  # in proportion to the distance
    assert near[0] == pytest.approx(np.cos(0.4) * ahead[0])  # and to the cosine of the heading's error
    assert near[5] > 0.0 and near[2] > 0.0 and ahead[5] == pytest.approx(0.0, abs=1e-12)
    behind = asked(law, *(-0.3 * side), -1.05, yaw=yaw)
    assert behind[0] == 0.0 and abs(behind[5]) > 0.0 > behind[2]
    np.testing.assert_array_equal(near[[1, 3, 4]], 0.0)


def test_a_speed_is_held_by_its_integral_and_yaw_is_damped() -> None:
    law = controller_of("velocity", finlab.load_layout("A"))
    law.reset()
    setpoint = Setpoint(np.array([0.0, 0.0, -1.0]), 0.05)
    forces = [law.wrench(seen(surge=0.02), setpoint, np.zeros(6))[0] for _ in range(30)]
    assert np.all(np.diff(forces) > 0.0)
    assert asked(law, 0.0, 0.0, rate=0.2)[5] < 0.0 < asked(law, 0.0, 0.0, rate=-0.2)[5]


def test_saturation_does_not_wind_up_the_integrals() -> None:
    robot = finlab.load_layout("A")
    law = controller_of("velocity", robot)
    fast, slow = (Setpoint(np.array([0.0, 0.0, -depth]), speed) for depth, speed in ((9.0, 5.0), (1.0, 0.0)))
    for _ in range(600):
        most = law.wrench(seen(), fast, np.zeros(6))
    after = law.wrench(seen(surge=0.1), slow, np.zeros(6))
    assert most[0] > 0.0 > most[2]  # held at its bound for a minute
    assert after[0] < 0.0 and abs(after[2]) < 0.05 * abs(most[2])


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_layouts_of_the_paper_come_to_a_waypoint_and_stay(name: str) -> None:
    place = np.array([[0.0, 0.0, -1.0], [2.0, 1.0, -1.3], [2.0, 1.0, -1.3]])
    log = swum(name, "waypoint", Trajectory("one waypoint", np.array([0.0, 0.1, 60.0]), place))
    distance = np.linalg.norm(log.position - log.reference, axis=1)
    assert distance[log.time > 40.0].max() < 0.15


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_layouts_of_the_paper_hold_speed_and_depth(name: str) -> None:
    log = swum(name, "velocity", straight(0.15, 30.0), current=(0.0, 0.02, 0.0))
    settled = log.time >= 10.0
    assert np.abs(log.motion[settled, 0] - 0.15).mean() < 0.04 * 0.15 + 0.004  # the beat is in it
    assert np.abs(log.position[:, 2] + 1.0).max() < 0.05


def test_a_lost_fin_does_not_end_it() -> None:
    log = swum("A", "waypoint", make_trajectory("circle"), failures=[("front_left", 20.0)])
    assert np.linalg.norm(log.position - log.reference, axis=1).max() < 0.5


def test_robots_of_thrusters_have_them_too() -> None:
    log = swum("bluerov2_heavy", "waypoint", station(20.0))
    assert np.linalg.norm(log.position - log.reference, axis=1).max() < 0.15


def test_what_cannot_be_controlled_so_is_said() -> None:
    with pytest.raises(FinlabError, match="torpedo.* dives by its pitch.*take tracking"):
        controller_of("waypoint", finlab.load_layout("torpedo"))
    with pytest.raises(FinlabError, match="expected one of tracking, waypoint, velocity, got 'pid'"):
        controller_of("pid", finlab.load_layout("A"))
