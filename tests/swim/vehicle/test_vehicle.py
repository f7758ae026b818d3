"""The vehicle against what can be solved by hand, and against itself with smaller steps."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.layout import Body, Layout
from finlab.swim.vehicle.attitude import quaternion_of
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import STATE_SIZE, Vehicle

NO_WRENCH = (0.0,) * 6
"""No force and no torque."""


@pytest.fixture
def ucat(layout_a: Layout) -> Body:
    """Layout A says nothing of its body, so U-CAT's parameters are used."""
    return complete_body(layout_a)


def at_rest() -> np.ndarray:
    """State at rest at the origin, upright."""
    state = np.zeros(STATE_SIZE)
    state[3] = 1.0
    return state


def state_after(
    vehicle: Vehicle, state: np.ndarray, wrench: tuple[float, ...], seconds: float, dt: float
) -> np.ndarray:
    """State of a vehicle after some seconds of a constant wrench."""
    for _ in range(round(seconds / dt)):
        state = vehicle.step(state, wrench, dt)
    return state


def test_surge_under_quadratic_drag_is_a_hyperbolic_tangent(ucat: Body) -> None:
    """m u' = F - q u |u|: u = sqrt(F / q) tanh(sqrt(F q) t / m)."""
    force = 6.0
    time = 8.0
    vehicle = Vehicle(replace(ucat, linear_damping=(0.0,) * 6))
    mass = vehicle.inertia[0]
    drag = ucat.quadratic_damping[0]
    state = state_after(vehicle, at_rest(), (force, 0, 0, 0, 0, 0), time, 0.01)
    rate = math.sqrt(force * drag) / mass
    assert state[7] == pytest.approx(math.sqrt(force / drag) * math.tanh(rate * time), abs=1e-9)
    assert state[0] == pytest.approx(mass / drag * math.log(math.cosh(rate * time)), abs=1e-8)


def test_a_robot_without_thrust_ends_up_drifting_with_the_water(ucat: Body) -> None:
    current = (0.15, -0.1, 0.0)
    state = at_rest()
    state[3:7] = quaternion_of(0.0, 0.0, 0.7)
    vehicle = Vehicle(ucat, current)
    state = state_after(vehicle, state, NO_WRENCH, 150.0, 0.1)
    after = vehicle.step(state, NO_WRENCH, 0.1)
    np.testing.assert_allclose((after[:3] - state[:3]) / 0.1, current, atol=2e-3)


def energy_of(vehicle: Vehicle, state: np.ndarray) -> float:
    """Kinetic energy of body and carried water, and potential energy of weight and buoyancy [J]."""
    kinetic = 0.5 * float(np.dot(vehicle.inertia, state[7:13] ** 2))
    _, _, z, qw, qx, qy, qz = state[:7]
    up = (2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
    return (
        kinetic
        + vehicle.weight * z
        - vehicle.buoyancy * (z + float(np.dot(up, vehicle.dynamics.center_of_buoyancy)))
    )


def test_without_drag_the_energy_is_kept(ucat: Body) -> None:
    vehicle = Vehicle(replace(ucat, linear_damping=(0.0,) * 6, quadratic_damping=(0.0,) * 6))
    state = at_rest()
    state[7:] = (0.3, 0.1, -0.2, 0.4, 0.3, 0.5)
    before = energy_of(vehicle, state)
    assert energy_of(vehicle, state_after(vehicle, state, NO_WRENCH, 10.0, 0.01)) == pytest.approx(
        before, abs=1e-5
    )


def test_runge_kutta_is_of_fourth_order(ucat: Body) -> None:
    """Half the step, a sixteenth of the error, for a robot that tumbles under a wrench."""
    vehicle = Vehicle(ucat, (0.1, 0.05, 0.0))
    start = at_rest()
    start[7:] = (0.4, -0.2, 0.1, 0.5, -0.4, 0.6)
    wrench = (4.0, 1.0, -2.0, 0.3, 0.2, 0.8)
    fine = state_after(vehicle, start, wrench, 2.0, 0.000625)
    errors = [
        np.abs(state_after(vehicle, start, wrench, 2.0, dt) - fine).max()
        for dt in (0.04, 0.02, 0.01)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.7).all(), orders
    assert np.abs(state_after(vehicle, start, wrench, 2.0, 0.01) - fine).max() < 1e-7, (
        "the step that is used"
    )


def test_many_steps_at_once_are_as_many_single_ones(ucat: Body) -> None:
    vehicle = Vehicle(ucat, (0.1, 0.05, 0.0))
    state = at_rest()
    state[7:] = (0.4, -0.2, 0.1, 0.5, -0.4, 0.6)
    wrenches = np.random.default_rng(2).uniform(-3.0, 3.0, (7, 6))
    together = vehicle.steps(state, wrenches, 0.02)
    np.testing.assert_array_equal(together[0], state)
    for k, wrench in enumerate(wrenches):
        state = vehicle.step(state, wrench, 0.02)
        np.testing.assert_array_equal(together[k + 1], state)


def test_steps_are_those_of_the_rule_with_its_rates(ucat: Body) -> None:
    """Runge-Kutta's and the midpoint rule written here, on the rates of change."""
    vehicle = Vehicle(ucat, (0.1, -0.05, 0.02))
    y = at_rest()
    y[3:7] = quaternion_of(0.3, -0.2, 1.1)
    y[7:] = (0.4, -0.2, 0.1, 0.5, -0.4, 0.6)
    tau = (4.0, 1.0, -2.0, 0.3, 0.2, 0.8)
    h = 0.05
    k1 = vehicle.derivative(y, tau)
    k2 = vehicle.derivative(y + 0.5 * h * k1, tau)
    k3 = vehicle.derivative(y + 0.5 * h * k2, tau)
    k4 = vehicle.derivative(y + h * k3, tau)
    after = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    after[3:7] /= np.linalg.norm(after[3:7])
    np.testing.assert_allclose(vehicle.step(y, tau, h), after, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(vehicle.coarse_step(y, tau, h), y + h * k2, rtol=1e-13, atol=1e-15)


def test_water_that_holds_a_light_body_fast_does_not_shake_it(ucat: Body) -> None:
    """Damping many times faster than the step: the body comes to the speed at which drag meets the
    thrust."""
    body = replace(
        ucat, linear_damping=(0.0,) * 6, quadratic_damping=(2e3,) * 6, added_mass=None, mass_kg=1.0
    )
    state = state_after(Vehicle(body), at_rest(), (8.0, 0, 0, 0, 0, 0), 2.0, 0.02)
    assert state[7] == pytest.approx(math.sqrt(8.0 / 2e3), rel=1e-4)


def test_shipped_robots_need_one_step_and_impossible_ones_say_so(ucat: Body) -> None:
    assert Vehicle(ucat).n_steps((0.6, 0.2, 0.3, 1.0, 0.5, 1.0), 0.02) == 1
    vehicle = Vehicle(replace(ucat, linear_damping=(0.0,) * 3 + (1e5, 0.0, 0.0)))
    with pytest.raises(
        LayoutError, match=r"body: its motion changes .* times a second.*check mass, inertia"
    ):
        vehicle.step(at_rest(), NO_WRENCH, 0.02)
    with pytest.raises(LayoutError, match="beyond all bounds"):
        vehicle.step(np.full(STATE_SIZE, np.nan), NO_WRENCH, 0.02)


def test_a_motion_beyond_all_bounds_is_a_sentence(ucat: Body) -> None:
    """Whatever a body's numbers are: no step overflows, and the next one is refused."""
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(200):
        light = replace(
            ucat,
            inertia_kgm2=tuple((10.0 ** rng.uniform(-9, -3, 3)).tolist()),
            added_mass=tuple((10.0 ** rng.uniform(-9, 7, 6)).tolist()),
            linear_damping=(0.0,) * 6,
            quadratic_damping=(0.0,) * 6,
        )
        vehicle = Vehicle(light)
        wrench = tuple((10.0 ** rng.uniform(0, 6, 6)).tolist())
        try:
            state_after(vehicle, at_rest(), wrench, 0.5, 0.1)
        except LayoutError as error:
            refused += "its motion changes" in str(error)
    assert refused > 100
