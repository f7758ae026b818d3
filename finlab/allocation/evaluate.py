"""What commands really give: every method's answers are judged by the plant, in one place."""

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.effort import EffortMeter
from finlab.physics.known_plants import plant_of
from finlab.physics.wrench import wrench_of_forces

REACHED = 0.01
"""Normalized error up to which a wrench counts as delivered."""


Judge = Literal["plant"]
"""Who says what commands give: the fins' own laws and tables."""


class Evaluation(NamedTuple):
    """What N commands give."""

    fin_forces: Array
    """Force of each fin (N, n, 3) [N], body frame; zero if failed."""
    wrench: Array
    """(N, 6) [N, N m]."""
    err_norm: Array
    """(N,)."""
    effort: Array
    """Effort `J_en` (N,)."""
    power: Array
    """Mean mechanical power (N,) [W]."""
    evaluated_by: Judge = "plant"
    """Whose forces these are."""


def evaluate(
    layout: Layout, command: Array, target: Array, sigma: Array, flow: Array | None = None
) -> Evaluation:
    """Judge commands (N, n, 3), NaN for failed fins, by the fins' own models.

    Args:
        layout: the robot.
        command: what its fins do.
        target: desired wrenches (N, 6).
        sigma: per-axis standard deviation (6,) of the error measure.
        flow: velocity (6,) or (N, 6) relative to the water [m/s, rad/s], body frame; None at rest.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    plant = plant_of(layout)
    force, effectiveness = plant.forces(command, flow=flow), plant.effectiveness
    # The first half of a column is its fin's axis in the body frame.
    fin_forces = np.matmul(force[..., None, :], effectiveness[..., :3])[..., 0, :]
    wrench = wrench_of_forces(force, effectiveness)
    missing = (target - wrench) / sigma
    err_norm = np.sqrt(np.einsum("ri,ri->r", missing, missing))
    if len(command) == 0:
        return Evaluation(fin_forces, wrench, err_norm, np.empty(0), np.empty(0))
    power = plant.power(command, flow=flow)
    failed = np.isnan(power)
    if failed.any():  # a failed fin costs nothing
        command, power = np.where(failed[..., None], 0.0, command), np.where(failed, 0.0, power)
    return Evaluation(fin_forces, wrench, err_norm, effort_of(layout, command), power.sum(-1))


def costs(layout: Layout, command: Array) -> tuple[Array, Array]:
    """Effort (K,) and power (K,) [W] of commands (K, n, 3) of fins that all work."""
    return effort_of(layout, command), power_of(layout, command)


def effort_of(layout: Layout, command: Array) -> Array:
    """Effort (K,) of commands (K, n, 3) of fins that all work."""
    return _meter(layout)(command)


def power_of(layout: Layout, command: Array) -> Array:
    """Mean mechanical power (K,) [W] of commands (K, n, 3) of fins that all work."""
    power: Array = plant_of(layout).power(command).sum(-1)
    return power


@lru_cache(maxsize=256)
def _meter(layout: Layout) -> EffortMeter:
    return EffortMeter(layout.upper)
