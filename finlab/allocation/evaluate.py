"""What commands really give: every method's answers are judged by the plant, in one place."""

from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.objective import EffortMeter
from finlab.physics.plant import Plant, plant_of

REACHED = 1e-3
"""Share of the yardstick up to which an error is none: the wrench counts as delivered."""


def judged_power(plant: Plant, command: Array) -> Array:
    """Mean mechanical power (N,) [W] of commands (N, n, 3); what has failed (NaN) takes none."""
    power: Array = np.nansum(plant.power(command), axis=-1)
    return power


def judged_effort(layout: Layout, command: Array) -> Array:
    """Effort `J_en` (N,) of commands (N, n, 3), the paper's energy proxy, without what has failed (NaN)."""
    failed = np.isnan(command).any(axis=-1, keepdims=True)
    effort: Array = _meter(layout)(np.where(failed, 0.0, command) if failed.any() else command)
    return effort


def costs(layout: Layout, command: Array) -> tuple[Array, Array]:
    """Effort (K,) and power (K,) [W] of commands (K, n, 3) of fins that all work."""
    return _meter(layout)(command), judged_power(plant_of(layout), command)


@lru_cache(maxsize=256)
def _meter(layout: Layout) -> EffortMeter:
    return EffortMeter(layout.upper)
