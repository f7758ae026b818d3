"""What a power budget leaves of the largest wrenches along the axes."""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.power_budget import budget_of
from finlab.arrays import Array
from finlab.layout import Layout


def sizes_within_budget(
    layout: Layout,
    failures: Sequence[Collection[str]],
    sizes: Array,
    axis_scale: Array,
    flow: ArrayLike | None,
) -> Array:
    """Returns the largest wrenches along the axes that a layout's power budget allows.

    Args:
        layout: the layout; without a budget the sizes stay.
        failures: for each of P cases the names of the actuators that are lost.
        sizes: largest scaled wrenches (P, 12) [N] without a budget: along the axes, and against
            them, with the other five at zero.
        axis_scale: what they are scaled by (6,) [1, m].
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Returns:
        The same (P, 12) [N] within the budget.

    Raises:
        AllocationError: no budget is kept for such a robot.
    """
    if budget_of(layout) is None:
        return sizes
    allocator = Allocator(layout)
    axes = np.concatenate([np.eye(6), -np.eye(6)]) * axis_scale
    within = sizes.copy()
    for size, lost in zip(within, failures, strict=True):
        for k in np.flatnonzero(size > 0.0):
            answer = allocator.allocate(
                size[k] * axes[k], lost=tuple(lost), policy="direction", flow=flow
            )
            size[k] *= answer.share
    return within
