"""What commands may follow a previous one: from tick to tick they change no faster than the drives
allow."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics.plant import Plant


class Box(NamedTuple):
    """Commands that may follow a previous one."""

    lower: Array
    """Least commands (n, 3); angles that turn freely are counted from the previous one."""
    upper: Array
    """Largest commands (n, 3)."""
    free: NDArray[np.bool_]
    """Angles (n, 3) that may be any."""
    turns: NDArray[np.bool_]
    """Angles (n, 3) that are counted around the circle."""

    def held(self, command: Array, plant: Plant) -> Array:
        """Returns commands (..., n, 3) brought into the box, their angles within the limits of a
        robot; NaN of a lost actuator stays."""
        return plant.feasible(self.clipped(command))

    def clipped(self, command: Array) -> Array:
        """Commands (..., n, 3) brought into the box."""
        middle = 0.5 * (self.lower + self.upper)
        turned = np.where(self.turns, middle + wrapped(command - middle), command)
        return np.clip(turned, self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class Rates:
    """How far the commands of a robot may change in a tick."""

    plant: Plant
    """The robot."""
    step: Array
    """Largest changes (n, 3) in a tick; infinite where nothing limits them."""

    def allow(self, previous: Array, command: Array) -> bool:
        """Whether a command (n, 3) may follow a previous one (n, 3), of which actuators may be
        NaN."""
        change = np.abs(command - previous)
        around = np.minimum(change, np.abs(2.0 * np.pi - change))
        return not (np.where(self.plant.turns, around, change) > self.step).any()

    def box(self, previous: Array) -> Box:
        """What may follow a previous command (n, 3); an actuator with NaN is left free."""
        lower = self.plant.lower
        upper = self.plant.upper
        step = self.step
        known = np.asarray(np.isfinite(previous).all(axis=1))[:, None]
        turns = self.plant.turns & known & (step < np.pi)
        center = np.where(known, np.where(turns, previous, np.clip(previous, lower, upper)), lower)
        low = np.maximum(center - step, lower)
        high = np.minimum(center + step, upper)
        low = np.where(turns, center - step, low)
        high = np.where(turns, center + step, high)
        low = np.where(known, low, lower)
        high = np.where(known, high, upper)
        free = self.plant.turns & ~turns
        return Box(np.where(free, lower, low), np.where(free, upper, high), free, turns)
