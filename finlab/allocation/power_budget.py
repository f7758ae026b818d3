"""A limit of the power that actuators take together: of all, or of those of each bus."""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import AllocationError

if TYPE_CHECKING:
    from finlab.layout.layout import Layout

ALL = "power"
"""Name of the bus that feeds all actuators."""
MOST_WATTS = 1e12
"""Largest budget [W]; beyond it something is wrong upstream."""


class PowerBudget(NamedTuple):
    """What the b buses of a robot of n actuators may take."""

    names: tuple[str, ...]
    """Of the buses."""
    members: NDArray[np.bool_]
    """Which actuators (b, n) each one feeds; an actuator has one bus at most."""
    watts: Array
    """The most that each may take (b,) [W]."""

    def power_of_buses(self, power: Array) -> Array:
        """Returns the power (..., b) [W] of each bus at powers (..., n) [W] of the actuators, NaN
        of lost ones."""
        return np.asarray(np.nan_to_num(power) @ self.members.T)


def check_power(power: object, layout: Layout) -> PowerBudget:
    """Returns the budget that a question names.

    Args:
        power: the most power of all actuators together [W].
        layout: the robot.

    Raises:
        AllocationError: it is no number above 0.
    """
    is_number = isinstance(power, Real) and not isinstance(power, bool)
    watts = float(power) if is_number else math.nan  # type: ignore[arg-type]
    if not 0.0 < watts <= MOST_WATTS:
        raise AllocationError(
            f"power: expected watts above 0, at most {MOST_WATTS:g}, for all actuators together, "
            f"got {power!r:.60}"
        )
    return PowerBudget((ALL,), np.ones((1, layout.n), bool), np.array([watts]))
