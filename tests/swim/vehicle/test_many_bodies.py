"""The equations that a fit integrates are those of the vehicle."""

from dataclasses import replace

import numpy as np

from finlab.swim.vehicle.attitude import euler, quaternion_of
from finlab.swim.vehicle.fossen import GRAVITY, Dynamics, dynamics_of, ucat_body
from finlab.swim.vehicle.many_bodies import Bodies, body_rates, body_velocity, derivative, integrate
from finlab.swim.vehicle.vehicle import Vehicle

CURRENT = (0.07, -0.04)
"""Current of the water, horizontal [m/s]."""


CENTER_OF_BUOYANCY = (0.001, -0.002, 0.05)
"""Of the body [m]."""
NET_BUOYANCY = 1.5
"""Buoyancy less weight [N]."""
BODY = ucat_body()
assert BODY.mass_kg is not None
BODY = replace(
    BODY, center_of_buoyancy_m=CENTER_OF_BUOYANCY, buoyancy_n=BODY.mass_kg * GRAVITY + NET_BUOYANCY
)
"""U-CAT's body, lighter than water, with its center of buoyancy a little off the vertical."""


def quaternion(angles: np.ndarray) -> np.ndarray:
    """Quaternion (4,) of roll, pitch and yaw (3,) [rad]."""
    return np.array(quaternion_of(*angles.tolist()))


def bodies(count: int) -> tuple[Bodies, np.ndarray]:
    """So many bodies, and the current around each."""

    def spread(values: object) -> np.ndarray:
        return np.repeat(np.array(values)[..., None], count, axis=-1)

    return Dynamics(*map(spread, dynamics_of(BODY))), spread(CURRENT)


def vehicle_of_body() -> Vehicle:
    """The vehicle of the body in this current."""
    return Vehicle(BODY, (*CURRENT, 0.0))


def test_derivatives_agree_with_the_vehicle() -> None:
    rng = np.random.default_rng(0)
    state = rng.uniform(-0.6, 0.6, (12, 30))
    wrench = rng.uniform(-3.0, 3.0, (6, 30))
    rate = np.array(derivative(state, wrench, *bodies(30)))
    for k in range(30):
        angles = state[3:6, k]
        full = np.concatenate([state[:3, k], quaternion(angles), state[6:, k]])
        np.testing.assert_allclose(euler(full[3:7]), angles, atol=1e-12)
        exact = np.array(vehicle_of_body().derivative(full.tolist(), wrench[:, k].tolist()))
        np.testing.assert_allclose(
            rate[[0, 1, 2, *range(6, 12)], k], exact[[0, 1, 2, *range(7, 13)]], atol=1e-9
        )
        ahead = (euler(full[3:7] + 1e-6 * exact[3:7]) - euler(full[3:7] - 1e-6 * exact[3:7])) / 2e-6
        np.testing.assert_allclose(rate[3:6, k], ahead, atol=1e-6)


def test_integration_follows_the_vehicle() -> None:
    rng = np.random.default_rng(1)
    wrench = np.repeat(rng.uniform(-1.0, 1.0, (8, 6)) * [3.0, 3.0, 3.0, 0.2, 0.4, 0.4], 10, axis=0)
    start = np.concatenate([rng.uniform(-0.2, 0.2, 6), rng.uniform(-0.1, 0.1, 6)])
    found = integrate(start[:, None], wrench[..., None], *bodies(1), 0.1)[..., 0]
    state = np.concatenate([start[:3], quaternion(start[3:6]), start[6:]])
    vehicle = vehicle_of_body()
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
    rate = np.array(derivative(state, np.zeros((6, 20)), *bodies(20)))
    np.testing.assert_allclose(body_rates(state[3:6].T, rate[3:6].T), state[9:].T, atol=1e-12)
    np.testing.assert_allclose(body_velocity(state[3:6].T, rate[:3].T), state[6:9].T, atol=1e-12)
