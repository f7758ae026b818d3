"""From tick to tick: commands change no faster than the drives of the actuators allow."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.layout.angles import wrapped
from finlab.physics.plant import Plant


class Box(NamedTuple):
    """Commands that may follow a previous one."""

    lower: Array
    """Least commands (n, 3); angles that turn freely are counted from the previous one."""
    upper: Array
    """Largest commands (n, 3)."""
    free: NDArray[np.bool_]
    """Angles (n, 3) that may be any."""

    def holds(self, command: Array) -> bool:
        """Whether a command (n, 3) is in the box."""
        middle = 0.5 * (self.lower + self.upper)
        turned = np.where(self.turns, middle + wrapped(command - middle), command)
        return bool(((turned >= self.lower) & (turned <= self.upper) | self.free).all())

    turns: NDArray[np.bool_] = np.zeros((1, 3), bool)
    """Angles (n, 3) that are counted around the circle."""

    def clipped(self, command: Array) -> Array:
        """Commands (..., n, 3) brought into the box."""
        middle = 0.5 * (self.lower + self.upper)
        turned = np.where(self.turns, middle + wrapped(command - middle), command)
        return np.clip(turned, self.lower, self.upper)


def box_after(plant: Plant, previous: Array, rates: Array, period_s: float) -> Box | None:
    """What may follow a previous command.

    Args:
        plant: the robot.
        previous: commands (n, 3); an actuator with NaN is left free.
        rates: fastest changes (n, 3) [per second]; infinite where nothing limits them.
        period_s: time between ticks [s].

    Returns:
        The box, or None where nothing is limited.
    """
    known = np.isfinite(previous).all(axis=1)[:, None]
    step = rates * period_s
    turns = plant.turns & known & (step < np.pi)
    lower, upper = plant.lower, plant.upper
    center = np.where(known, np.where(turns, previous, np.clip(previous, lower, upper)), lower)
    low, high = np.maximum(center - step, lower), np.minimum(center + step, upper)
    low, high = np.where(turns, center - step, low), np.where(turns, center + step, high)
    low, high = np.where(known, low, lower), np.where(known, high, upper)
    free = plant.turns & ~turns
    low, high = np.where(free, lower, low), np.where(free, upper, high)
    if (low <= lower).all() and (high >= upper).all() and not turns.any():
        return None
    return Box(low, high, free, turns)
