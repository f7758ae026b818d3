"""The equations that a fit integrates are those of the vehicle."""

import numpy as np

from finlab.fit.robot.equations import Bodies, body_rates, body_velocity, derivative, integrate
from finlab.layout import Body
from finlab.physics.vehicle import GRAVITY, Vehicle, euler, ucat_body

CURRENT = (0.07, -0.04)


def quaternion(angles: np.ndarray) -> np.ndarray:
    half = 0.5 * angles
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def bodies(body: Body, count: int) -> Bodies:
    assert body.mass_kg and body.inertia_kgm2 and body.added_mass
    inertia = np.array([body.mass_kg] * 3 + list(body.inertia_kgm2)) + np.array(body.added_mass)
    weight = body.mass_kg * GRAVITY
    columns = (inertia, body.linear_damping, body.quadratic_damping)
    spread = [np.repeat(np.array(part)[:, None], count, axis=1) for part in columns]
    center = np.repeat(np.array([0.001, -0.002, 0.05])[:, None], count, axis=1)
    current = np.repeat(np.array(CURRENT)[:, None], count, axis=1)
    return Bodies(*spread, np.full(count, weight), np.full(count, weight + 1.5), center, current)


def of_vehicle() -> Vehicle:
    from dataclasses import replace

    body = ucat_body()
    assert body.mass_kg
    lift = body.mass_kg * GRAVITY + 1.5
    return Vehicle(
        replace(body, center_of_buoyancy_m=(0.001, -0.002, 0.05), buoyancy_n=lift), (*CURRENT, 0.0)
    )


def test_derivatives_agree_with_the_vehicle() -> None:
    rng = np.random.default_rng(0)
    state = rng.uniform(-0.6, 0.6, (12, 30))
    wrench = rng.uniform(-3.0, 3.0, (6, 30))
    pace = derivative(state, wrench, bodies(ucat_body(), 30))
    for k in range(30):
        angles = state[3:6, k]
        full = np.concatenate([state[:3, k], quaternion(angles), state[6:, k]])
        np.testing.assert_allclose(euler(full[3:7]), angles, atol=1e-12)
        exact = np.array(of_vehicle().derivative(full.tolist(), wrench[:, k].tolist()))
        np.testing.assert_allclose(
            pace[[0, 1, 2, *range(6, 12)], k], exact[[0, 1, 2, *range(7, 13)]], atol=1e-9
        )
        ahead = (euler(full[3:7] + 1e-6 * exact[3:7]) - euler(full[3:7] - 1e-6 * exact[3:7])) / 2e-6
        np.testing.assert_allclose(pace[3:6, k], ahead, atol=1e-6)


def test_integration_follows_the_vehicle() -> None:
    rng = np.random.default_rng(1)
    wrench = np.repeat(rng.uniform(-1.0, 1.0, (8, 6)) * [3.0, 3.0, 3.0, 0.2, 0.4, 0.4], 10, axis=0)
    start = np.concatenate([rng.uniform(-0.2, 0.2, 6), rng.uniform(-0.1, 0.1, 6)])
    found = integrate(start[:, None], wrench[..., None], bodies(ucat_body(), 1), 0.1)[..., 0]
    state, vehicle = np.concatenate([start[:3], quaternion(start[3:6]), start[6:]]), of_vehicle()
    for k in range(80):
        np.testing.assert_allclose(
            found[k, [0, 1, 2, *range(6, 12)]], state[[0, 1, 2, *range(7, 13)]], atol=2e-3
        )
        np.testing.assert_allclose(found[k, 3:6], euler(state[3:7]), atol=2e-3)
        for _ in range(10):
            state = vehicle.step(state, wrench[k].tolist(), 0.01)


def test_rates_and_velocities_from_the_pose() -> None:
    rng = np.random.default_rng(2)
    state = rng.uniform(-0.5, 0.5, (12, 20))
    pace = derivative(state, np.zeros((6, 20)), bodies(ucat_body(), 20))
    np.testing.assert_allclose(body_rates(state[3:6].T, pace[3:6].T), state[9:].T, atol=1e-12)
    np.testing.assert_allclose(body_velocity(state[3:6].T, pace[:3].T), state[6:9].T, atol=1e-12)
