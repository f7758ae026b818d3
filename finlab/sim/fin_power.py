"""Mechanical power of the servos that move the fins."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.sim.fin_force import FinShape
from finlab.sim.fin_motion import FinMotion

Array = NDArray[np.float64]

FIN_INERTIA = 0.0097
"""Of a fin about its shaft [kg m^2]: U-CAT's robot description has a plate of 0.8 kg, 0.22 x 0.10 x 0.02 m,
its centre 0.09 m from the shaft."""


class FinPower(NamedTuple):
    """Power of each fin (n,) [W] at one moment, by two measures."""

    inertial: Array
    """|I alpha omega|, the paper's: what turns the fin's own inertia, braking counted like driving."""
    torque: Array
    """max(tau omega, 0): inertia, carried water and drag together, nothing won back by braking."""


def fin_power(motion: FinMotion, shape: FinShape | None = None, inertia: float = FIN_INERTIA) -> FinPower:
    """The power of fins as they move now.

    The torque is that of a rigid plate in still water:
    (I + m L^3/3) theta'' + 1/8 rho Cd W L^4 theta' |theta'|.
    """
    plate = FinShape() if shape is None else shape
    speed, acceleration = motion.speed, motion.acceleration
    water = plate.virtual_mass * plate.length**3 / 3
    drag = 0.25 * plate.drag_per_length * plate.length**4 * speed * np.abs(speed)
    torque = (inertia + water) * acceleration + drag
    return FinPower(np.abs(inertia * acceleration * speed), np.maximum(torque * speed, 0.0))
