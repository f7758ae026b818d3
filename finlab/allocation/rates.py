"""Commands that may follow those of the tick before: they change no faster than the drives allow.

Used by `Method.rates`, and by the fault monitor, which knows what a healthy drive can do.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics.plant import Plant


class CommandBox(NamedTuple):
    """Commands of n actuators that may follow those of the tick before: an interval of each number,
    in the units of the commands."""

    lower: Array
    """Least commands (n, 3); those of angles in `turns` are counted from the previous angle, and
    may lie beyond a full turn."""
    upper: Array
    """Largest commands (n, 3), counted in the same way."""
    any_angle: NDArray[np.bool_]
    """Angles (n, 3) that may be any: they reach all around the circle in one tick."""
    turns: NDArray[np.bool_]
    """Angles (n, 3) without limits of their own, of which the rates leave an interval."""

    def clip_feasible(self, command: Array, plant: Plant) -> Array:
        """Brings commands into the box, and their angles within the limits of the robot.

        Args:
            command: (..., n, 3); NaN of a lost actuator stays.
            plant: of the robot.

        Returns:
            Commands (..., n, 3) that the drives can follow and the robot takes.
        """
        return plant.feasible(self.clip(command))

    def clip(self, command: Array) -> Array:
        """Returns commands (..., n, 3) brought into the box, angles by the shorter way round."""
        middle = 0.5 * (self.lower + self.upper)
        nearest_turn = np.where(self.turns, middle + wrapped(command - middle), command)
        return np.clip(nearest_turn, self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class Rates:
    """How far the commands of a robot may change in a tick."""

    plant: Plant
    """The robot."""
    step: Array
    """Largest changes (n, 3) in a tick, in the units of the commands; infinite where nothing limits
    them."""

    def allow(self, previous: Array, command: Array) -> bool:
        """Returns whether a command may follow the one of the tick before.

        Args:
            previous: (n, 3), NaN where it is unknown, which forbids nothing.
            command: (n, 3), NaN of lost actuators.

        Returns:
            True where no number changes by more than `step`, angles by the shorter way round.
        """
        change = np.abs(command - previous)
        around = np.minimum(change, np.abs(2.0 * np.pi - change))
        return not (np.where(self.plant.turns, around, change) > self.step).any()

    def box(self, previous: Array) -> CommandBox:
        """Returns what may follow the command (n, 3) of the tick before; an actuator with NaN there
        is held by its limits alone."""
        lower = self.plant.lower
        upper = self.plant.upper
        step = self.step
        is_known = np.asarray(np.isfinite(previous).all(axis=1))[:, None]
        # A step of half a turn reaches every angle.
        turns = self.plant.turns & is_known & (step < np.pi)
        any_angle = self.plant.turns & ~turns
        center = np.where(turns, previous, np.clip(previous, lower, upper))
        center = np.where(is_known, center, lower)
        low = np.where(turns, center - step, np.maximum(center - step, lower))
        high = np.where(turns, center + step, np.minimum(center + step, upper))
        low = np.where(is_known & ~any_angle, low, lower)
        high = np.where(is_known & ~any_angle, high, upper)
        return CommandBox(low, high, any_angle, turns)
