"""Published NED quantities in this project's body frame, FLU.

Half a turn about x takes NED (x forward, y right, z down) to FLU (x forward, y left, z up) and back: y and z
change sign, and so do sway, heave, pitch and yaw and the forces and torques along them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.errors import DataError
from finlab.layout import Body

Array = NDArray[np.float64]

FLIP = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Signs of surge, sway, heave, roll, pitch, yaw under half a turn about x."""

ADDED_MASS = ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot")
"""SNAME derivatives of the added mass, in the order of the axes."""
LINEAR = ("X_u", "Y_v", "Z_w", "K_p", "M_q", "N_r")
"""SNAME derivatives of linear damping."""
QUADRATIC = ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")
"""SNAME derivatives of quadratic damping, of X = X_uu |u| u and so on."""


def flip_vector(vector: ArrayLike) -> Array:
    """NED to FLU or back: a vector (..., 3), or motion or wrench (..., 6)."""
    values = np.asarray(vector, dtype=np.float64)
    flipped: Array = values * FLIP[: values.shape[-1]]
    return flipped


def flip_matrix(matrix: ArrayLike) -> Array:
    """NED to FLU or back: a matrix (6, 6) that takes motions to wrenches, such as added mass."""
    flipped: Array = np.asarray(matrix, dtype=np.float64) * FLIP[:, None] * FLIP
    return flipped


def body_from_ned(
    mass_kg: float,
    inertia_kgm2: Sequence[float],
    derivatives: Mapping[str, float],
    center_of_buoyancy_m: Sequence[float],
) -> Body:
    """A body from published values: signed SNAME derivatives and a centre of buoyancy in NED.

    Args:
        mass_kg: mass [kg].
        inertia_kgm2: moments of inertia about x, y, z [kg m^2]; a diagonal is the same in both frames.
        derivatives: by SNAME name, each at most 0; those left out are 0.
        center_of_buoyancy_m: as seen from the centre of gravity, NED [m].

    Raises:
        DataError: an unknown name, or a derivative above 0, which would drive instead of brake.
    """
    known = (*ADDED_MASS, *LINEAR, *QUADRATIC)
    for name, value in derivatives.items():
        if name not in known:
            raise DataError(f"derivative {name!r}: expected one of {', '.join(known)}")
        if value > 0.0:
            raise DataError(
                f"derivative {name}: expected at most 0 as published signed values are, got {value:g}"
            )

    def diagonal(names: Sequence[str]) -> tuple[float, ...]:
        signed = np.diag([derivatives.get(name, 0.0) for name in names])
        return tuple(float(value) for value in np.abs(np.diag(flip_matrix(signed))))

    return Body(
        mass_kg=mass_kg,
        inertia_kgm2=tuple(inertia_kgm2),
        added_mass=diagonal(ADDED_MASS),
        linear_damping=diagonal(LINEAR),
        quadratic_damping=diagonal(QUADRATIC),
        center_of_buoyancy_m=tuple(float(value) + 0.0 for value in flip_vector(center_of_buoyancy_m)),
    )
