"""What the methods that know the fin model share: limits, starts, the objective by which starts compete."""

import time
from abc import abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.allocation.settings import AimSettings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.networks.normalization import Normalization
from finlab.physics import Plant, plant_of

ENERGY_TRADEOFF = 1e-4
"""Weight of the cost beside the squared normalized error where a method weighs both; see `command_cost`."""
CACHE_SIZE = 64
"""Layouts whose prepared quantities a method keeps; a control loop asks for the same one again and again."""


class TimeLimit:
    """Processor time of this thread, which other work on the machine does not shorten.

    Args:
        seconds: how long from now.
    """

    def __init__(self, seconds: float) -> None:
        self._end = time.thread_time() + seconds

    @property
    def over(self) -> bool:
        """Whether the time is up."""
        return time.thread_time() > self._end


class ModelBased(Allocator):
    """A method that optimizes over the fins' own laws and tables, those that score every method."""

    settings_class: type[AimSettings] = AimSettings

    def __init__(self, normalization: Normalization, **settings: Any) -> None:
        """Make it.

        Args:
            normalization: the yardstick of the error; nothing else is taken from a checkpoint.
            settings: fields of the method's settings.

        Raises:
            AllocationError: a setting that the method cannot work with.
        """
        self.normalization = normalization
        self.settings = chosen = self.settings_class(**settings)
        self.aim = chosen.aim
        self._cost = lru_cache(CACHE_SIZE)(self._weigh)
        self._inverse = lru_cache(CACHE_SIZE)(self._invert)

    @abstractmethod
    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6).

        Random starts are drawn once and shared by all targets, so that a target gets the same answer alone
        and among others.
        """

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        plant = plant_of(layout).at(self.flow)
        command = self._commands(plant, targets, seed)
        return Solution(plant.feasible(command))

    def _weigh(self, plant: Plant) -> CommandCost:
        """What a robot's commands cost, weighed beside the squared normalized error."""
        return command_cost(plant, self.aim, self.normalization.std, ENERGY_TRADEOFF)

    def _invert(self, plant: Plant) -> PseudoInverse:
        """What answers by the pseudo-inverse, and where others start."""
        return PseudoInverse(plant, self.normalization.std, self.aim)

    def _total(self, plant: Plant, command: Array, target: Array) -> Array:
        """`J = err_norm^2 + cost` (B,) of commands (B, n, 3)."""
        total: Array = self.normalization.error(plant.wrench(command), target) ** 2 + self._cost(plant)(
            command
        )
        return total


@dataclass(frozen=True)
class TimeLimitedSettings(AimSettings):
    """Settings of a slow method, which ends in time."""

    time_limit_s: float = number(
        0.6,
        0.0,
        3600.0,
        "processor time per target after which the best command so far is the answer",
        "s",
        above=True,
    )
