"""Where the model expects the robot to go, against the simulated body, and its slopes against
differences."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.core.shared_array import SharedArray
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.swim.control.motion_model import (
    COUPLING,
    CURRENT,
    DAMPING,
    INERTIA,
    MOTION,
    RIGHTING,
    TILT,
    UNKNOWN,
    MotionModel,
)
from finlab.swim.vehicle.attitude import euler
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle

PERIOD_S = 0.1
"""Of the model [s]."""


def any_state(model: MotionModel, seed: int) -> Array:
    """A state in which nothing is zero."""
    rng = np.random.default_rng(seed)
    z = np.zeros(model.size)
    z[MOTION] = 0.3 * rng.normal(size=6)
    z[TILT] = 0.3 * rng.normal(size=2)
    z[CURRENT] = 0.1 * rng.normal(size=3)
    z[UNKNOWN] = rng.normal(size=6)
    z[INERTIA] = 0.1 * rng.normal(size=6)
    z[COUPLING] = 0.03 * rng.normal(size=15)
    z[DAMPING] = 0.1 * rng.normal(size=6)
    z[RIGHTING] = 0.1
    z[model.strength] = 1.0 + 0.1 * rng.normal(size=model.n)
    z[model.place] = 0.01 * rng.normal(size=3 * model.n)
    z[model.held] = 0.5 * rng.normal(size=model.n_held)
    return z


def settled(layout: Layout, seed: int) -> tuple[MotionModel, Array]:
    """A model whose actuators have followed a command (n, 3)."""
    rng = np.random.default_rng(seed)
    model = MotionModel(layout)
    middle = 0.5 * (layout.lower + layout.upper)
    command = middle + 0.2 * rng.uniform(-1.0, 1.0, middle.shape) * (layout.upper - layout.lower)
    z = any_state(model, seed)
    for _ in range(400):  # until differences of what they do are below rounding
        model.step(z, 0.3, command, PERIOD_S)
    return model, command


@pytest.mark.parametrize("name", ["bluerov2_heavy", "catamaran", "turtle_hybrid", "A"])
def test_its_slopes_are_those_of_its_accelerations(name: str) -> None:
    model, command = settled(load_layout(name), 1)
    z = any_state(model, 2)
    step = model.step(z, 0.3, command, PERIOD_S)
    size = 1e-5
    for column in range(model.size):
        moved = [z.copy(), z.copy()]
        moved[0][column] -= size
        moved[1][column] += size
        below, above = [model.step(each, 0.3, command, PERIOD_S).acceleration for each in moved]
        np.testing.assert_allclose(
            step.acceleration_slope[:, column],
            (above - below) / (2.0 * size),
            rtol=1e-5,
            atol=1e-6,
            err_msg=f"column {column}",
        )


def test_the_model_goes_where_the_vehicle_goes(layout_a: Layout) -> None:
    """Period by period in a current, against the simulated body."""
    vehicle = Vehicle(complete_body(layout_a), (0.05, -0.03, 0.0))
    model = MotionModel(layout_a)
    body = np.array([0.0, 0.0, 0.0, 1.0, *np.zeros(9)])
    z = np.zeros(model.size)
    z[model.strength] = 1.0
    z[CURRENT] = (0.05, -0.03, 0.0)
    command = np.array([[0.5, 1.0, 0.1], [0.5, 1.0, 3.0], [0.5, 1.05, 3.1], [0.5, 1.0, 0.0]])
    plant = plant_of(layout_a)
    for _ in range(50):
        before = plant.wrench(model.motion.command)
        w, x, y, q = body[3:7]
        yaw = float(np.arctan2(2 * (w * q + x * y), 1 - 2 * (y * y + q * q)))
        z = model.step(z, yaw, command, PERIOD_S).state
        mean = 0.5 * (before + plant.wrench(model.motion.command))
        for _ in range(5):
            body = vehicle.step(body, mean.tolist(), PERIOD_S / 5)
        np.testing.assert_allclose(z[MOTION], body[7:], atol=5e-3)  # half of the gyro's noise
        z[MOTION] = body[7:]
        z[TILT] = euler(body[3:7])[:2]
    assert np.abs(body[7:]).max() > 0.1, "it moved"


def test_what_a_stuck_one_gives_is_linear_in_what_the_state_holds(layout_a: Layout) -> None:
    """A fin stuck at an angle by the state pushes as one that points there by its command."""
    model, command = settled(layout_a, 3)
    z = np.zeros(model.size)
    z[model.strength] = 1.0
    z[model.strength][1] = 0.0
    z[model.held][model.held_of[1]] = np.cos(0.7), np.sin(0.7)
    stuck = model.step(z, 0.0, command, PERIOD_S)
    does = model.motion.command
    does[1, 2] = 0.7
    force = plant_of(layout_a).force(does)
    wrench = plant_of(layout_a).wrench_of(force)
    np.testing.assert_allclose(stuck.acceleration[MOTION] * model.inertia, wrench, atol=1e-9)


def test_a_fin_that_is_told_to_turn_about_may_go_either_way(layout_a: Layout) -> None:
    """For a second its force may be the opposite of what is expected."""
    model = MotionModel(layout_a)
    z = np.zeros(model.size)
    z[model.strength] = 1.0
    ahead = np.tile([0.5, 1.5, 0.0], (4, 1))
    for _ in range(20):
        step = model.step(z, 0.0, ahead, PERIOD_S)
    assert not step.noise[3].any()
    about = ahead.copy()
    about[1, 2] = 3.1
    step = model.step(z, 0.0, about, PERIOD_S)
    of_one = model._wrench_before[1] / model.inertia
    assert (np.sqrt(step.noise[3]) >= 1.9 * np.abs(of_one)).all()
    for _ in range(15):
        step = model.step(z, 0.0, about, PERIOD_S)
    assert not step.noise[3].any()


@pytest.mark.parametrize("dt", [0.001, 0.1, 3.0])
def test_a_step_is_that_of_the_exponential_of_its_slopes(dt: float) -> None:
    """Against an eigenvalue decomposition: F = e^(A dt), z <- z + A^-1 (F - 1) f, and the same of
    derivatives by what only drifts."""
    model, command = settled(load_layout("bluerov2_heavy"), 4)
    z = any_state(model, 5)
    step = model.step(z, 0.3, command, dt)
    A = step.acceleration_slope[:8, :8]  # the depth moves nothing: without it A has an inverse
    values, vectors = np.linalg.eig(A)
    F = ((vectors * np.exp(values * dt)) @ np.linalg.inv(vectors)).real
    integral = np.linalg.solve(A, F - np.eye(8))
    np.testing.assert_allclose(step.transition[:8, :8], F, rtol=1e-6, atol=1e-9)
    moved = z[:8] + integral @ step.acceleration[:8]
    np.testing.assert_allclose(step.state[:8], moved, rtol=1e-6, atol=1e-9)
    by_drifting = integral @ step.acceleration_slope[:8, 9:]
    np.testing.assert_allclose(step.transition[:8, 9:], by_drifting, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(step.state[9:], z[9:])


def test_an_actuator_beside_its_place_pushes_from_there() -> None:
    """Against a layout in which it stands there."""
    layout = load_layout("bluerov2_heavy")
    offset = np.array([0.03, -0.02, 0.05])
    part = layout.actuators[2]
    moved_part = replace(part, position=tuple((np.array(part.position) + offset).tolist()))
    actuators = (*layout.actuators[:2], moved_part, *layout.actuators[3:])
    elsewhere = replace(layout, actuators=actuators)
    model, command = settled(layout, 6)
    other, _ = settled(elsewhere, 6)
    z = any_state(model, 7)
    z[model.place] = 0.0
    z_beside = z.copy()
    z_beside[model.place.start + 6 : model.place.start + 9] = offset
    beside = model.step(z_beside, 0.3, command, PERIOD_S)
    there = other.step(z, 0.3, command, PERIOD_S)
    np.testing.assert_allclose(beside.acceleration, there.acceleration, atol=1e-10)


def test_what_is_not_linear_in_errors_counts_as_noise() -> None:
    """Variances of the angular accelerations beyond their linear part, against samples of states
    whose velocity, current and inertia are in doubt."""
    rng = np.random.default_rng(8)
    layout = load_layout("bluerov2_heavy")
    model, command = settled(layout, 9)
    z = np.zeros(model.size)
    z[model.strength] = 1.0
    z[:3] = 0.3, -0.2, 0.1
    deviation = np.zeros(model.size)
    deviation[:3] = 0.1
    deviation[CURRENT] = 0.05
    deviation[INERTIA][:3] = 0.13
    deviation[COUPLING] = 0.04
    step = model.step(z, 0.3, command, PERIOD_S, SharedArray(np.diag(deviation**2)))
    beyond = []
    for _ in range(3000):
        error = deviation * rng.normal(size=model.size)
        exact = model.step(z + error, 0.3, command, PERIOD_S).acceleration
        beyond.append(exact - step.acceleration - step.acceleration_slope @ error)
    found = np.mean(np.square(beyond), axis=0)[3:6]
    assert (step.noise[1, :3] == 0.0).all()
    ratio = step.noise[1, 3:] / found
    assert (ratio > 0.5).all(), ratio
    assert (ratio < 2.0).all(), ratio
    assert not model.step(z, 0.3, command, PERIOD_S).noise[1].any(), "nothing is in doubt"
