"""The observer against robots that are simulated exactly, so that what it should find is known."""

import math

import numpy as np
import pytest

from finlab import load_layout
from finlab.layout import Layout
from finlab.swim.control import Measurement, MotionObserver
from finlab.swim.control.observer import MotionEstimate
from finlab.swim.simulation import make_trajectory
from finlab.swim.simulation.truth import perturbed
from finlab.swim.vehicle.attitude import euler, quaternion_of
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle

PERIOD_S = 0.1
"""Length of a tick [s]."""


@pytest.fixture(scope="module")
def robot() -> Layout:
    """Robot A, four fins."""
    return load_layout("A")


def watched(
    robot: Layout,
    wrench: list[float],
    seconds: float,
    *,
    truth: Layout | None = None,
    current: tuple[float, float, float] = (0.0, 0.0, 0.0),
    said: list[float] | None = None,
) -> tuple[MotionEstimate, np.ndarray]:
    """What an observer believes at the end of a swim under a constant wrench, and what is true."""
    vehicle = Vehicle(complete_body(truth or robot))
    vehicle.current = current
    observer = MotionObserver(robot, PERIOD_S)
    state = np.zeros(13)
    state[3] = 1.0
    for tick in range(round(seconds / PERIOD_S)):
        roll, pitch, yaw = euler(state[3:7]).tolist()
        seen = Measurement(
            tick * PERIOD_S, state[:3], yaw, state[7:10].copy(), -state[2], state[10:], roll, pitch
        )
        found = observer.step(seen, np.array(said or wrench) if tick else np.zeros(6))
        before = state
        for _ in range(5):
            state = vehicle.step(state, wrench, PERIOD_S / 5)
    return found, before


def test_a_robot_that_moves_as_its_model_is_followed(robot: Layout) -> None:
    found, state = watched(robot, [4.0, 0.0, 0.5, 0.0, 0.0, 0.1], 20.0)
    assert found.position == pytest.approx(state[:3], abs=5e-3)
    assert found.velocity == pytest.approx(state[7:10], abs=2e-3)
    assert found.yaw_rate == pytest.approx(state[12], abs=2e-3)
    assert np.abs(found.current).max() < 2e-3


@pytest.mark.parametrize("direction", [0.0, 1.0, 2.5])
def test_a_current_across_is_found_where_the_robot_turns(robot: Layout, direction: float) -> None:
    water = (0.06 * math.cos(direction), 0.06 * math.sin(direction), 0.0)
    found, _ = watched(robot, [4.0, 0.0, 0.0, 0.0, 0.0, 0.08], 60.0, current=water)
    assert found.current == pytest.approx(water[:2], abs=0.012)


def test_a_force_that_nobody_told_of_becomes_drift(robot: Layout) -> None:
    light = perturbed(robot, buoyancy=1.01)
    found, state = watched(robot, [3.0, 0.0, 0.0, 0.0, 0.0, 0.0], 60.0, truth=light)
    lift = 0.01 * 19.0 * 9.81
    observer = MotionObserver(robot, PERIOD_S)
    # At the speed that it has come to, drag and lift are in balance: no drift is left, though the
    # model of the drawn robot alone would have it slowed down.
    assert state[9] > 0.03
    assert abs(found.drift[2]) < 0.15 * lift / observer.inertia[2]


def test_a_steady_turn_carries_the_robot_out_of_it(robot: Layout) -> None:
    """Sideways speed where added mass and damping balance, by hand: 100.7 v + 260 v |v| = -59 u
    r."""
    observer = MotionObserver(robot, 0.01)
    sway = 0.0
    for _ in range(1000):
        sway = observer.sway_after(sway, 0.1, 0.5)
    assert sway < 0.0
    assert 100.7 * sway - 260.0 * sway**2 == pytest.approx(-59.0 * 0.1 * 0.5, rel=0.02)


def test_a_body_that_is_given_it_follows_a_path_of_changing_speed() -> None:
    """Straight ahead from rest, the wrenches move the whole body model by the path's length."""
    robot = load_layout("A")
    path = make_trajectory("dive")
    times = np.arange(0.0, 12.0, 0.1)
    flat = [path.setpoint(float(t)) for t in times]
    flat = [
        s._replace(velocity=s.velocity * [1, 1, 0], acceleration=s.acceleration * [1, 1, 0])
        for s in flat
    ]
    along = MotionObserver(robot, 0.1).wrenches_along(flat, np.zeros(2), 0.08)
    vehicle = Vehicle(complete_body(robot))
    state = np.zeros(13)
    state[3:7] = quaternion_of(0.0, 0.0, 0.0)
    for wrench in along:
        for _ in range(5):
            state = vehicle.step(state, wrench.tolist(), 0.02)
    assert state[0] == pytest.approx(path.position(12.0)[0], rel=0.03)


@pytest.mark.parametrize("name", ["A", "bluerov2_heavy"])
def test_wrenches_along_a_path_are_those_of_its_model(name: str) -> None:
    """M nu' + D(nu) nu by arrays, with numpy's differences of the yaw rate."""
    robot = load_layout(name)
    observer = MotionObserver(robot, PERIOD_S)
    path = make_trajectory("lissajous")
    setpoints = path.setpoints(np.arange(0.0, 20.0, PERIOD_S))
    current = np.array([0.06, -0.03])
    slow = 0.1
    found = observer.wrenches_along(setpoints, current.tolist(), slow)
    velocity = np.array([each.velocity for each in setpoints])
    acceleration = np.array([each.acceleration for each in setpoints])
    x, y = (velocity[:, :2] - current).T
    ax, ay, az = acceleration.T
    speed = np.hypot(x, y)
    turning = (x * ay - y * ax) / np.maximum(speed, slow) ** 2
    zero = np.zeros_like(speed)
    nu = np.stack([speed, zero, velocity[:, 2], turning], axis=-1)
    surge_rate = (x * ax + y * ay) / speed
    nu_rate = np.stack([surge_rate, zero, az, np.gradient(turning, PERIOD_S)], axis=-1)
    wanted = np.zeros((len(speed), 6))
    wanted[:, [0, 1, 2, 5]] = observer.inertia * (nu_rate + observer.deceleration(nu))
    assert np.abs(wanted[:, 5]).max() > 0.01
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-11)
