"""Our derivatives against Fossen's matrices in NED with Euler angles, written apart from the
library.

T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control: rotation and Euler rates
(2.4, 2.27), Coriolis matrix from a mass matrix (3.46), restoring forces of a submerged body (4.6),
relative motion (8).
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from finlab.layout import Body, Layout
from finlab.swim.vehicle.fossen import (
    accelerations,
    complete_body,
    damping_jacobian,
    damping_rates,
    dynamics_of,
    jacobian,
    water_wrench,
)
from finlab.swim.vehicle.vehicle import Vehicle

SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Of surge, sway, heave, roll, pitch, yaw under half a turn about x, from NED to FLU or back."""
FLIP = np.diag(SIGNS[:3])
"""Matrix (3, 3) between z up and y left, and z down and y right."""


def skew(a: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) S(a) with S(a) b = a x b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def coriolis(m: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """C(nu) = [[0, -S(M11 v + M12 w)], [-S(M11 v + M12 w), -S(M21 v + M22 w)]]."""
    linear = m[:3, :3] @ nu[:3] + m[:3, 3:] @ nu[3:]
    angular = m[3:, :3] @ nu[:3] + m[3:, 3:] @ nu[3:]
    return np.block([[np.zeros((3, 3)), -skew(linear)], [-skew(linear), -skew(angular)]])


def euler_of(r: np.ndarray) -> np.ndarray:
    """Roll, pitch and yaw [rad] of a rotation matrix."""
    return np.array(
        [np.arctan2(r[2, 1], r[2, 2]), -np.arcsin(r[2, 0]), np.arctan2(r[1, 0], r[0, 0])]
    )


def rotation_of(phi: float, theta: float, psi: float) -> np.ndarray:
    """Rotation matrix (3, 3) of roll, pitch and yaw [rad]: Fossen's R(Theta)."""
    c = np.cos
    s = np.sin
    rx = np.array([[1, 0, 0], [0, c(phi), -s(phi)], [0, s(phi), c(phi)]])
    ry = np.array([[c(theta), 0, s(theta)], [0, 1, 0], [-s(theta), 0, c(theta)]])
    rz = np.array([[c(psi), -s(psi), 0], [s(psi), c(psi), 0], [0, 0, 1]])
    return rz @ ry @ rx


def fossen(p: Body, eta: np.ndarray, nu: np.ndarray, current: np.ndarray, tau: np.ndarray):
    """(eta', nu') in NED for eta = (position, Euler angles), nu, the current in the world and
    tau."""
    mass_rigid = np.diag([p.mass_kg] * 3 + list(p.inertia_kgm2))
    mass_added = np.diag(p.added_mass)
    phi, theta, psi = eta[3:]
    r = rotation_of(phi, theta, psi)
    rates = np.array(
        [
            [1, np.sin(phi) * np.tan(theta), np.cos(phi) * np.tan(theta)],
            [0, np.cos(phi), -np.sin(phi)],
            [0, np.sin(phi) / np.cos(theta), np.cos(phi) / np.cos(theta)],
        ]
    )
    water = np.concatenate([r.T @ current, np.zeros(3)])
    relative = nu - water
    water_rate = np.concatenate([-skew(nu[3:]) @ water[:3], np.zeros(3)])
    damping = np.diag(np.array(p.linear_damping) + np.array(p.quadratic_damping) * abs(relative))
    xb, yb, zb = FLIP @ p.center_of_buoyancy_m
    w = p.mass_kg * 9.81
    b = p.mass_kg * 9.81 if p.buoyancy_n is None else p.buoyancy_n
    sp = np.sin(phi)
    cp = np.cos(phi)
    st = np.sin(theta)
    ct = np.cos(theta)
    restoring = np.array(
        [
            (w - b) * st,
            -(w - b) * ct * sp,
            -(w - b) * ct * cp,
            yb * b * ct * cp - zb * b * ct * sp,
            -zb * b * st - xb * b * ct * cp,
            xb * b * ct * sp + yb * b * st,
        ]
    )
    # Rigid body by its motion over ground, water by the relative motion.
    force = (
        tau
        - coriolis(mass_rigid, nu) @ nu
        - coriolis(mass_added, relative) @ relative
        - damping @ relative
        - restoring
    )
    nu_rate = np.linalg.solve(mass_rigid + mass_added, force + mass_added @ water_rate)
    return np.concatenate([r @ nu[:3], rates @ nu[3:]]), nu_rate


@pytest.mark.parametrize("buoyancy", [None, 200.0])
def test_derivatives_agree_on_random_states(buoyancy: float | None, layout_a: Layout) -> None:
    rng = np.random.default_rng(1)
    base = complete_body(layout_a)
    for _ in range(50):
        offset = tuple(rng.uniform(-0.05, 0.05, 3))
        p = replace(base, center_of_buoyancy_m=offset, buoyancy_n=buoyancy)
        current = rng.uniform(-0.3, 0.3, 3)
        quaternion = rng.standard_normal(4)
        quaternion /= np.linalg.norm(quaternion)
        state = np.concatenate([rng.uniform(-5, 5, 3), quaternion, rng.uniform(-1, 1, 6)])
        tau = rng.uniform(-10, 10, 6)
        ours = np.array(Vehicle(p, current).derivative(state.tolist(), tau.tolist()))

        r_ned = FLIP @ Rotation.from_quat(np.roll(quaternion, -1)).as_matrix() @ FLIP
        eta = np.concatenate([FLIP @ state[:3], euler_of(r_ned)])
        eta_rate, nu_rate = fossen(p, eta, SIGNS * state[7:], FLIP @ current, SIGNS * tau)

        np.testing.assert_allclose(SIGNS * ours[7:], nu_rate, atol=1e-10)
        np.testing.assert_allclose(FLIP @ ours[:3], eta_rate[:3], atol=1e-12)
        # Attitude: the rotation a moment later, from the quaternion's rate and from the Euler
        # angles' rates.
        h = 1e-6
        later = quaternion + h * ours[3:7]
        ours_later = FLIP @ Rotation.from_quat(np.roll(later, -1)).as_matrix() @ FLIP
        np.testing.assert_allclose(
            ours_later, rotation_of(*(eta[3:] + h * eta_rate[3:])), atol=1e-9
        )


def test_what_the_water_gives_is_what_fossens_matrices_say(layout_a: Layout) -> None:
    """Added mass, its Coriolis terms, damping and buoyancy, the weight compensated."""
    rng = np.random.default_rng(3)
    base = complete_body(layout_a)
    for _ in range(20):
        offset = tuple(rng.uniform(-0.05, 0.05, 3))
        p = replace(base, center_of_buoyancy_m=offset, buoyancy_n=200.0)
        nu_r = rng.uniform(-1, 1, 6)
        tau = rng.uniform(-10, 10, 6)
        up = rng.standard_normal(3)
        up /= np.linalg.norm(up)
        dynamics = dynamics_of(p)
        nu_rate = np.array(accelerations(dynamics, nu_r, up, tau))
        rigid_inertia = (p.mass_kg, *p.inertia_kgm2)
        found = np.array(water_wrench(dynamics, rigid_inertia, nu_r, up, tau))

        mass_added = np.diag(p.added_mass)
        damping = np.diag(np.array(p.linear_damping) + np.array(p.quadratic_damping) * abs(nu_r))
        lift = 200.0 * up
        buoyancy = np.concatenate([lift - p.mass_kg * 9.81 * up, np.cross(offset, lift)])
        expected = buoyancy - mass_added @ nu_rate - damping @ nu_r
        expected -= coriolis(mass_added, nu_r) @ nu_r
        np.testing.assert_allclose(found, expected, atol=1e-10)


def test_the_jacobian_is_that_of_the_accelerations(layout_a: Layout) -> None:
    """By central differences, at many states side by side; one body in plain floats agrees."""
    rng = np.random.default_rng(2)
    body = dynamics_of(replace(complete_body(layout_a), center_of_buoyancy_m=(0.01, -0.02, 0.05)))
    flow = rng.uniform(-1, 1, (6, 20))
    up = np.array([0.1, 0.2, 0.97])
    wrench = rng.uniform(-5, 5, 6)
    h = 1e-6
    found = np.array(jacobian(body, flow))
    for k in range(6):
        step = h * np.eye(6)[k][:, None]
        ahead, behind = (
            np.array(accelerations(body, flow + s * step, up, wrench)) for s in (1, -1)
        )
        np.testing.assert_allclose(found[:, k], (ahead - behind) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(jacobian(body, flow[:, 3].tolist()), found[:, :, 3], atol=1e-12)
    np.testing.assert_allclose(damping_jacobian(body, flow), -found.diagonal().T, atol=1e-12)
    still = np.zeros((6, 20))
    still[2] = flow[2]
    slowed = -np.array(accelerations(body, still, 0.0 * up, np.zeros(6)))[2]
    np.testing.assert_allclose(damping_rates(body, still)[2] * flow[2], slowed, atol=1e-12)
