"""What the methods that know the fin model share: limits, starts, the objective by which starts compete."""

import math
import time
from abc import abstractmethod
from functools import lru_cache
from inspect import Parameter, signature
from typing import Unpack

from finlab.allocation.aim import Aim, checked_objective
from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant, plant_of

ENERGY_TRADEOFF = 1e-4
"""Weight of the cost beside the squared normalized error where a method weighs both; see `command_cost`."""
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
    """A method that optimizes over the fins' own laws and tables, those that score every method.

    Args:
        normalization: the yardstick of the error; nothing else is taken from a checkpoint.
        aim: what is kept least, as settings of every such method.
    """

    def __init__(self, normalization: Normalization, **aim: Unpack[Aim]) -> None:
        self.normalization = normalization
        self.aim = checked_objective(**aim)
        self.objective, self.energy_weights = self.aim.name, self.aim.weights
        self.copper_loss = self.aim.copper_loss
        self._plant = plant_of
        self._cost = lru_cache(CACHE_SIZE)(self._weigh)
        self._inverse = lru_cache(CACHE_SIZE)(lambda plant: PseudoInverse(plant, normalization.std, self.aim))

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of what can be set when the method is made."""
        own = list(signature(cls).parameters.values())[1:]
        return [each.name for each in own if each.kind != Parameter.VAR_KEYWORD] + list(Aim.__annotations__)

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

    def _weigh(self, plant: Plant, tradeoff: float = ENERGY_TRADEOFF) -> CommandCost:
        """What a robot's commands cost, weighed beside the squared normalized error."""
        return command_cost(plant, self.aim, self.normalization.std, tradeoff)

    def _total(self, plant: Plant, command: Array, target: Array) -> Array:
        """`J = err_norm^2 + cost` (B,) of commands (B, n, 3)."""
        total: Array = self.normalization.error(plant.wrench(command), target) ** 2 + self._cost(plant)(
            command
        )
        return total
