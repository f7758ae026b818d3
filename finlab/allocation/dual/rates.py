"""From tick to tick: commands change no faster than the drives of the actuators allow."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.nearest_point import nearest_point
from finlab.allocation.dual.newton import solve
from finlab.allocation.dual.policies import cheapest
from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.layout.axes import wrapped
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
        """Whether a command (n, 3) may follow a previous one (n, 3), of which actuators may be NaN."""
        change = np.abs(command - previous)
        around = np.minimum(change, np.abs(2.0 * np.pi - change))
        return not (np.where(self.plant.turns, around, change) > self.step).any()

    def box(self, previous: Array) -> Box:
        """What may follow a previous command (n, 3); an actuator with NaN is left free."""
        lower, upper, step = self.plant.lower, self.plant.upper, self.step
        known = np.asarray(np.isfinite(previous).all(axis=1))[:, None]
        turns = self.plant.turns & known & (step < np.pi)
        center = np.where(known, np.where(turns, previous, np.clip(previous, lower, upper)), lower)
        low, high = np.maximum(center - step, lower), np.minimum(center + step, upper)
        low, high = np.where(turns, center - step, low), np.where(turns, center + step, high)
        low, high = np.where(known, low, lower), np.where(known, high, upper)
        free = self.plant.turns & ~turns
        return Box(np.where(free, lower, low), np.where(free, upper, high), free, turns)


def within_tick(robot: DualRobot, sets: Sets, wrench: Array, prices: Array, weight: Array) -> Array:
    """Forces (k, 1) [N] within the sets of a tick that give a wrench (1, 6) [N, N m], or come near to it by
    weights of the axes (6,) [1/N, 1/(N m)]; the search begins at prices (r, 1)."""
    target = robot.target(wrench)
    if not len(target):  # nothing pushes, such as foils at rest
        return np.zeros((len(robot.effectiveness), 1))
    result = solve(robot, target, sets, prices)
    if result.solved[0]:
        return result.force
    near = nearest_point(robot.farthest(sets), robot.effectiveness * weight, wrench[0] * weight)
    return cheapest(robot, sets, near.force, robot.effectiveness.T @ robot.middle(sets)).force[:, None]
