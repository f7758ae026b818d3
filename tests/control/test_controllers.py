"""Controllers one law at a time, by hand."""

import math

import numpy as np
import pytest

from finlab.control import (
    PAPER_WAYPOINT_GAINS,
    Measurement,
    Setpoint,
    WaypointController,
)
from finlab.control.controllers import Odometry
from finlab.layout.angles import wrapped

STILL = Measurement(0.0, np.array([0.0, 0.0, -1.0]), 0.0, np.zeros(3), 1.0, np.zeros(3), 0.0, 0.0)


def towards(x: float, y: float, z: float, measurement: Measurement = STILL) -> np.ndarray:
    controller = WaypointController(PAPER_WAYPOINT_GAINS)
    return controller.wrench(measurement, Setpoint(np.array([x, y, z]), 0.0))


def test_the_yaw_error_is_wrapped() -> None:
    wrench = towards(-1.0, 0.1, -1.0, STILL._replace(yaw=-3.0))
    assert -0.5 < wrapped(math.atan2(0.1, -1.0) + 3.0) < 0.0 and wrench[5] < 0.0


def test_damping_acts_against_the_motion() -> None:
    moving = STILL._replace(velocity=np.array([0.0, 0.0, 0.1]), rates=np.array([0.0, 0.0, 0.2]))
    wrench = WaypointController().wrench(moving, Setpoint(np.array([1.0, 0.0, -1.0]), 0.0))
    assert wrench[2] < 0.0 and wrench[5] < 0.0


def test_right_above_the_waypoint_the_heading_is_left_alone() -> None:
    assert abs(towards(0.0, 1e-4, -1.0)[5]) < 0.01


def test_odometry_follows_steady_motion_without_lag_and_averages_noise() -> None:
    rng = np.random.default_rng(0)
    odometry = Odometry(1.5, 0.5, 0.1)
    errors = []
    for k in range(600):
        time = 0.1 * k
        yaw = wrapped(0.1 * time)
        place = np.array([1.5 * math.sin(0.1 * time), -1.5 * math.cos(0.1 * time), -1.0 + 0.01 * time])
        seen = Measurement(
            time,
            place + 0.02 * rng.standard_normal(3),
            yaw + 0.02 * rng.standard_normal(),
            np.array([0.15, 0.0, 0.01]),
            -place[2] + 0.005 * rng.standard_normal(),
            np.array([0.0, 0.0, 0.1]),
            0.0,
            0.0,
        )
        pose = odometry.step(seen)
        errors.append([*(pose.position - place), wrapped(pose.yaw - yaw)])
    late = np.array(errors[100:])
    assert np.abs(late.mean(axis=0)).max() < 3e-3
    assert (late.std(axis=0) < [0.008, 0.008, 0.003, 0.008]).all()
    assert pose.climb == pytest.approx(0.01, abs=1e-6)


def test_a_reset_controller_remembers_nothing() -> None:
    moving = STILL._replace(velocity=np.array([0.05, 0.0, 0.02]), depth=0.9, rates=np.array([0.0, 0.0, 0.3]))
    setpoint = Setpoint(np.array([1.0, 0.5, -1.0]), 0.15)
    controller = WaypointController()
    first = controller.wrench(STILL, setpoint)
    assert not np.array_equal(controller.wrench(moving, setpoint), first)
    controller.reset()
    np.testing.assert_array_equal(controller.wrench(STILL, setpoint), first)
