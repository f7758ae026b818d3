"""The tracking controller, in single calls and in swims."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab import load_layout
from finlab.layout import Layout, Servo
from finlab.research.evaluation.method_specs import load_method_spec
from finlab.swim.control import Controller, Measurement, Setpoint, TrackingController, gains_for
from finlab.swim.control.tracking_controller import SENSOR_DELAY_S
from finlab.swim.simulation import ClosedLoop, make_trajectory
from finlab.swim.simulation.truth import perturbed
from tests.allocator_cache import AllocatorCache


@pytest.fixture(scope="module")
def robot() -> Layout:
    """Robot A, four fins."""
    return load_layout("A")


def first_wrench(robot: Layout, setpoint: Setpoint, yaw: float = 0.0) -> np.ndarray:
    """Wrench (6,) of a new controller for a robot at rest."""
    still = Measurement(
        0.0, np.array([0.0, 0.0, -1.0]), yaw, np.zeros(3), 1.0, np.zeros(3), 0.0, 0.0
    )
    return TrackingController(robot).wrench(still, setpoint, np.zeros(6))


def test_all_gains_follow_from_the_slowest_fin(robot: Layout) -> None:
    slow = replace(
        robot, actuators=(replace(robot.fins[0], servo=Servo(direction_pole=1.75)), *robot.fins[1:])
    )
    fast = gains_for(robot)
    halved = gains_for(slow)
    for name in ("velocity", "heading", "path"):
        late = (2.0 / 1.75 + SENSOR_DELAY_S) / (2.0 / 3.5 + SENSOR_DELAY_S)
        assert getattr(halved, name) == pytest.approx(getattr(fast, name) / late)
    assert halved.max_wrench == fast.max_wrench


def test_it_pushes_towards_a_point_ahead_and_above(robot: Layout) -> None:
    wrench = first_wrench(
        robot, Setpoint(np.array([1.0, 0.0, -0.5]), 0.1, np.array([0.1, 0.0, 0.0]))
    )
    assert wrench[0] > 1.0 and wrench[2] > 1.0
    assert wrench[[1, 3, 4]] == pytest.approx(0.0)
    assert abs(wrench[5]) < 1e-9


def test_where_the_path_rests_it_turns_to_where_the_path_goes_on(robot: Layout) -> None:
    here = Setpoint(np.array([0.0, 0.0, -1.0]), 0.0, onward=0.5 * math.pi)
    wrench = first_wrench(robot, here)
    assert abs(wrench[0]) < 0.02
    assert wrench[5] > 0.5
    assert first_wrench(robot, here, yaw=0.5 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_no_more_than_the_bounds_is_asked_for(robot: Layout) -> None:
    far = Setpoint(np.array([90.0, 90.0, 90.0]), 0.0)
    wrench = first_wrench(robot, far)
    most = np.array(gains_for(robot).max_wrench)
    assert (np.abs(wrench) <= most + 1e-12).all()


def error(
    robot: Layout,
    pilot: Controller,
    truth: Layout | None = None,
    current: float = 0.0,
    path: str = "circle",
) -> float:
    """Root mean square distance from a path [m]."""
    path_ = make_trajectory(path)
    flow = (current, 0.0, 0.0)
    loop = ClosedLoop(robot, AllocatorCache().on(robot), path_, pilot, truth=truth, current=flow)
    log = loop.run()
    return float(np.sqrt(((log.position - log.reference) ** 2).sum(1).mean()))


@pytest.mark.parametrize(
    ("damping", "current", "most"),
    [
        (2.0, 0.0, 0.1),
        pytest.param(1.0, 0.0, 0.05, marks=pytest.mark.exhaustive),
        pytest.param(0.5, 0.0, 0.05, marks=pytest.mark.exhaustive),
        pytest.param(1.0, 0.07, 0.05, marks=pytest.mark.exhaustive),
    ],
)
def test_it_stays_near_to_a_path(
    robot: Layout, damping: float, current: float, most: float
) -> None:
    """The plant is not what the controller was told."""
    truth = perturbed(robot, damping=damping)
    assert error(robot, TrackingController(robot), truth, current) < most


@pytest.mark.exhaustive
def test_it_stops_at_corners_and_sets_off_again(robot: Layout) -> None:
    assert error(robot, TrackingController(robot), path="square") < 0.04


def test_fins_that_turn_before_the_wrench_comes_keep_nearer_to_a_square() -> None:
    robot = load_layout("A")
    error = {}
    for name in ("analytic", "dual"):
        log = ClosedLoop(
            robot, load_method_spec(name).on(robot), make_trajectory("square"), seed=3
        ).run()
        error[name] = np.sqrt(np.square(log.position - log.reference).sum(axis=1).mean())
    assert error["dual"] < 0.93 * error["analytic"]
