"""What commands really give: every method's answers are judged by the plant, in one place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Layout
from finlab.physics.energy import command_energy
from finlab.physics.plant import plant_of
from finlab.physics.wrench import body_force, wrench_of_forces

Array = NDArray[np.float64]

REACHED = 0.01
"""Normalized error up to which a wrench counts as delivered."""


class Verdict(NamedTuple):
    """What N commands give."""

    fin_forces: Array
    """Force of each fin (N, n, 3) [N], body frame; zero if failed."""
    wrench: Array
    """(N, 6) [N, N m]."""
    err_norm: Array
    """(N,)."""
    energy: Array
    """(N,)."""


def judge(layout: Layout, command: Array, target: Array, sigma: Array) -> Verdict:
    """Judge commands (N, n, 3), NaN for failed fins, by the analytic fin models.

    Args:
        layout: the robot.
        command: what its fins do.
        target: desired wrenches (N, 6).
        sigma: per-axis standard deviation (6,) of the error measure.
    """
    plant = plant_of(layout)
    force = plant.forces(command)
    in_body_frame = body_force(force, layout.mounting_angle)
    return verdict_of(layout, command, in_body_frame, wrench_of_forces(force, plant.columns), target, sigma)


def verdict_of(
    layout: Layout, command: Array, fin_forces: Array, wrench: Array, target: Array, sigma: Array
) -> Verdict:
    """The verdict where forces (N, n, 3) and wrenches (N, 6) are known."""
    missing = (target - wrench) / sigma
    err_norm = np.sqrt(np.einsum("ri,ri->r", missing, missing))
    return Verdict(fin_forces, wrench, err_norm, command_energy(command, layout.upper))
