"""What the methods that know the fin model share: limits, starts, the objective by which starts compete."""

import math
import time
from abc import abstractmethod
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant, plant_of
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights
from finlab.physics.objective import Name, Objective

ENERGY_TRADEOFF = 1e-4
"""Weight of the cost beside the squared normalized error where a method weighs both; see `command_cost`."""
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


@dataclass(eq=False, repr=False)
class ModelBased(Allocator):
    """A method that optimizes over the fins' own laws and tables, those that score every method.

    All its fields but the first can be set.
    """

    normalization: Normalization
    """The yardstick of the error; nothing else is taken from a checkpoint."""
    _: KW_ONLY
    objective: Name = "power"
    """What is kept least: `power` in watts, or `effort`, the paper's energy proxy."""
    energy_weights: EnergyWeights = DEFAULT_WEIGHTS
    """Weights of the effort."""
    copper_loss: float = 0.0
    """Heat in a motor's windings [W/(N m)^2] that counts beside the mechanical power."""

    def __post_init__(self) -> None:
        self.aim = Objective(self.objective, self.energy_weights, self.copper_loss)
        self._cost = lru_cache(CACHE_SIZE)(self._weigh)
        self._inverse = lru_cache(CACHE_SIZE)(self._invert)

    @abstractmethod
    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6).

        Random starts are drawn once and shared by all targets, so that a target gets the same answer alone
        and among others.
        """

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        plant = plant_of(layout)
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


@dataclass(eq=False, repr=False, kw_only=True)
class TimeLimited(ModelBased):
    """A slow method, which ends in time."""

    time_limit_s: float = 0.6
    """Processor time [s] per target after which the best command so far is the answer: with what a call does
    besides, less than a second."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.time_limit_s > 0.0:
            raise AllocationError(
                f"time_limit_s: expected a number of seconds above 0, got {self.time_limit_s}"
            )
