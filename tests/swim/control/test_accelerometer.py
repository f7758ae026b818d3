"""What an accelerometer should show, against differences and by hand."""

import numpy as np

from finlab.arrays import Array
from finlab.layout import load_layout
from finlab.swim.control.accelerometer import specific_force
from finlab.swim.control.motion_model import BIAS, UNKNOWN, MotionModel
from tests.plant_mujoco import NO_NOISE, NO_SPREAD, MujocoRobot

PLACE = np.array([0.1, -0.05, 0.2])
"""Of the accelerometer, from the centre of gravity [m]."""


def expected(model: MotionModel, state: Array, command: Array) -> tuple[Array, Array]:
    """Specific force and derivatives over a period so short that all stays as it is."""
    step = model.step(state, 0.3, command, 1e-9)
    return specific_force(state, step, PLACE)


def moving_state(model: MotionModel) -> Array:
    """A state with all that counts, of a robot that heels and turns."""
    rng = np.random.default_rng(3)
    state = np.zeros(model.size)
    state[:9] = 0.3 * rng.normal(size=9)
    state[9:49] = 0.03 * rng.normal(size=40)
    state[model.strength] = 1.0
    return state


def test_the_derivatives_are_those_of_differences() -> None:
    model = MotionModel(load_layout("bluerov2_heavy"))
    state = moving_state(model)
    command = np.zeros((8, 3))
    command[:, 0] = np.arange(8.0) - 3.0
    for _ in range(10):
        model.step(state, 0.3, command, 0.1)
    expected(model, state, command)  # from now on forces stay
    _, rows = expected(model, state, command)
    by_differences = np.zeros_like(rows)
    for number in range(len(state)):
        change = np.zeros(len(state))
        change[number] = 1e-6
        above, _ = expected(model, state + change, command)
        below, _ = expected(model, state - change, command)
        by_differences[:, number] = (above - below) / 2e-6
    np.testing.assert_allclose(rows, by_differences, atol=2e-6)


def test_at_rest_it_shows_the_way_up_and_its_bias() -> None:
    model = MotionModel(load_layout("bluerov2_heavy"))
    state = np.zeros(model.size)
    state[UNKNOWN.start + 2] = model.dynamics.weight - model.dynamics.buoyancy  # it floats still
    state[BIAS] = 0.01, 0.02, -0.03
    force, _ = expected(model, state, np.zeros((8, 3)))
    np.testing.assert_allclose(force, [0.01, 0.02, 9.78], atol=1e-9)


def test_it_is_what_a_robot_in_mujoco_feels() -> None:
    """A robot as its layout says, with exact sensors, that accelerates and turns."""
    layout = load_layout("bluerov2_heavy")
    robot = MujocoRobot(layout, 1, NO_SPREAD, NO_NOISE, sensors="imu+accelerometer")
    model = MotionModel(layout)
    command = np.zeros((8, 3))
    command[:, 0] = 6.0, 2.0, -4.0, 5.0, 3.0, 3.0, 3.0, -2.0
    for _ in range(20):
        state = np.zeros(model.size)
        state[:6] = robot.motion
        state[model.strength] = 1.0
        measured = robot.measure()
        state[6:8] = measured.roll, measured.pitch
        robot.step(command, 0.02)
        # What has a lag is in the model from its beginning on, as in the robot.
        step = model.step(state, measured.yaw, command, 0.02)
        force, _ = specific_force(state, step, np.zeros(3))
    np.testing.assert_allclose(robot.measure().acceleration, force, atol=0.03)
    assert np.linalg.norm(force - [0.0, 0.0, 9.81]) > 0.3, "it accelerates"
