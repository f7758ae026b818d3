"""Published NED values and this project's FLU."""

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.sim.attitude import euler, quaternion_of_yaw, rotation
from finlab.sim.frames import body_from_ned, flip_matrix, flip_vector
from finlab.sim.parameters import ucat_body

# Signed derivatives as published for U-CAT: CAD inertia and added mass from its on-board dynamics, damping
# from the simulator's set of September 2024, whose centre of buoyancy is 0.05 m above the centre of gravity.
PUBLISHED = {
    "X_udot": -40.0, "Y_vdot": -21.0, "Z_wdot": -149.0,
    "K_pdot": -0.1269, "M_qdot": -1.2052, "N_rdot": -2.3064,
    "X_u": -28.542, "Y_v": -100.7, "Z_w": -30.61, "N_r": -0.313,
    "X_uu": -21.98, "Y_vv": -260.0, "Z_ww": -161.0, "K_pp": -3.4244, "M_qq": -2.1014, "N_rr": -0.7226,
}  # fmt: skip


def test_ucats_layout_file_holds_the_published_values() -> None:
    made = body_from_ned(19.0, (0.1574, 0.4646, 0.51151), PUBLISHED, (0.0, 0.0, -0.05))
    shipped = ucat_body()
    for name in ("mass_kg", "inertia_kgm2", "added_mass", "linear_damping", "quadratic_damping"):
        assert getattr(made, name) == getattr(shipped, name), name
    assert made.center_of_buoyancy_m == shipped.center_of_buoyancy_m


def test_flipping_keeps_cross_products_and_power() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 3))
    np.testing.assert_allclose(np.cross(flip_vector(a), flip_vector(b)), flip_vector(np.cross(a, b)))
    motion, matrix = rng.standard_normal(6), rng.standard_normal((6, 6))
    np.testing.assert_allclose(flip_matrix(matrix) @ flip_vector(motion), flip_vector(matrix @ motion))
    np.testing.assert_allclose(flip_vector(flip_vector(motion)), motion)


def test_what_is_no_braking_derivative_is_refused() -> None:
    with pytest.raises(DataError, match="X_u"):
        body_from_ned(19.0, (1, 1, 1), {"X_u": 3.0}, (0, 0, 0))
    with pytest.raises(DataError, match="expected one of"):
        body_from_ned(19.0, (1, 1, 1), {"Xu": -3.0}, (0, 0, 0))


def test_attitude_by_hand() -> None:
    np.testing.assert_allclose(rotation(quaternion_of_yaw(np.pi / 2)) @ [1, 0, 0], [0, 1, 0], atol=1e-12)
    nose_down = (np.cos(0.1), 0.0, np.sin(0.1), 0.0)
    np.testing.assert_allclose(euler(nose_down), [0, 0.2, 0], atol=1e-12)
    assert (rotation(nose_down) @ [1, 0, 0])[2] < 0
