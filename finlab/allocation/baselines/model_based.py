"""What the methods that know the fin model share: limits, starts, the objective by which starts compete."""

import math
import time
from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.solution import Solution
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy

Array = NDArray[np.float64]

ENERGY_TRADEOFF = 1e-4
"""Weight of the energy proxy beside the squared normalized error where a method weighs the two."""
TIME_LIMIT_S = 0.6
"""Processor time [s] that a slow method takes for one target unless set otherwise: with what a call does
besides, less than a second."""
CACHE_SIZE = 64
"""Layouts whose prepared quantities a method keeps; a control loop asks for the same one again and again."""


class TimeLimit:
    """Processor time of this thread, which other work on the machine does not shorten.

    Args:
        seconds: how long from now; None for as long as it takes.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._end = math.inf if seconds is None else time.thread_time() + seconds

    @property
    def over(self) -> bool:
        """Whether the time is up."""
        return time.thread_time() > self._end


def check_time_limit(seconds: float) -> float:
    """A time limit as a setting; `AllocationError` where there is no time at all."""
    if not seconds > 0.0:
        raise AllocationError(f"time_limit_s: expected a number of seconds above 0, got {seconds}")
    return float(seconds)


class ModelBased(Allocator):
    """A method that optimizes over the layout's own analytic fin models, the ones that score every method.

    Args:
        normalization: the yardstick of the error; nothing else is taken from a checkpoint.
    """

    def __init__(self, normalization: Normalization) -> None:
        self.normalization = normalization
        self._plant = plant_of

    @abstractmethod
    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6).

        Random starts are drawn once and shared by all targets, so that a target gets the same answer alone
        and among others.
        """

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        plant = self._plant(layout)
        command = self._commands(plant, targets, seed)
        return Solution(plant.feasible(command))

    def _objective(self, plant: Plant, command: Array, target: Array) -> Array:
        """`J = err_norm^2 + ENERGY_TRADEOFF * J_en` of commands (..., n, 3)."""
        error = self.normalization.error(plant.wrench(command), target)
        return error**2 + ENERGY_TRADEOFF * command_energy(command, plant.upper)
