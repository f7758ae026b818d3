"""Published NED values and this project's FLU."""

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.swim.vehicle.attitude import euler, quaternion_of
from finlab.swim.vehicle.fossen import ucat_body

# Signed derivatives as published for U-CAT: CAD inertia and added mass from its on-board dynamics,
# damping from the simulator's set of September 2024, whose centre of buoyancy is 0.05 m above the
# centre of gravity.
PUBLISHED = {
    "X_udot": -40.0, "Y_vdot": -21.0, "Z_wdot": -149.0,
    "K_pdot": -0.1269, "M_qdot": -1.2052, "N_rdot": -2.3064,
    "X_u": -28.542, "Y_v": -100.7, "Z_w": -30.61, "N_r": -0.313,
    "X_uu": -21.98, "Y_vv": -260.0, "Z_ww": -161.0, "K_pp": -3.4244, "M_qq": -2.1014, "N_rr": -0.7226,
}  # fmt: skip


def test_ucats_layout_file_holds_the_published_values() -> None:
    """Half a turn about x flips the signs of a diagonal in pairs, so its entries stay as they
    are."""
    shipped = ucat_body()
    assert (shipped.mass_kg, shipped.inertia_kgm2) == (19.0, (0.1574, 0.4646, 0.51151))
    names = {
        "added_mass": ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot"),
        "linear_damping": ("X_u", "Y_v", "Z_w", "K_p", "M_q", "N_r"),
        "quadratic_damping": ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"),
    }
    for key, derivatives in names.items():
        assert getattr(shipped, key) == tuple(-PUBLISHED.get(name, -0.0) for name in derivatives), (
            key
        )
    assert shipped.center_of_buoyancy_m == (0.0, 0.0, 0.05), "above the centre of gravity"


def forward(quaternion: tuple[float, ...]) -> np.ndarray:
    """Where the body's x axis points in the world."""
    return Rotation.from_quat(np.roll(quaternion, -1)).apply([1.0, 0.0, 0.0])


def test_attitude_by_hand() -> None:
    np.testing.assert_allclose(forward(quaternion_of(0.0, 0.0, np.pi / 2)), [0, 1, 0], atol=1e-12)
    nose_down = (np.cos(0.1), 0.0, np.sin(0.1), 0.0)
    np.testing.assert_allclose(euler(nose_down), [0, 0.2, 0], atol=1e-12)
    assert forward(nose_down)[2] < 0
