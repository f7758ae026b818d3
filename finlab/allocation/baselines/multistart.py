"""Method `multistart`: random seeds, batched Levenberg-Marquardt within the limits, the lowest J wins."""

from dataclasses import dataclass

import numpy as np

from finlab.allocation.baselines.model_based import ENERGY_TRADEOFF, TimeLimit, TimeLimited
from finlab.allocation.command_cost import CommandCost, command_cost
from finlab.allocation.weighted_descent import DescentOptions, descend
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.physics import Plant

CHUNK_ROWS = 2048
"""Commands refined together; more would not fit the caches."""
POLISH = DescentOptions(n_steps=20, damping=1e-6)
"""Last steps of the winner, on the error alone."""


@dataclass(eq=False, repr=False, kw_only=True)
class Multistart(TimeLimited):
    """Uniform random commands refined on error and cost, the best one polished on the error alone."""

    name = "multistart"
    n_candidates: int = 16
    """Random commands per target."""
    n_steps: int = 20
    """Most refinement steps of each."""
    energy_tradeoff: float = ENERGY_TRADEOFF
    """Weight of the cost beside the squared normalized error; see `command_cost`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.energy_tradeoff < np.inf:
            raise AllocationError(f"energy_tradeoff: expected a number from 0, got {self.energy_tradeoff}")
        self._descent = DescentOptions(n_steps=self.n_steps)

    def _weigh(self, plant: Plant) -> CommandCost:
        return command_cost(plant, self.aim, self.normalization.std, self.energy_tradeoff)

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        start = plant.sample(np.random.default_rng(seed), (self.n_candidates,))
        size = max(1, CHUNK_ROWS // self.n_candidates)
        limit = TimeLimit(self.time_limit_s * len(targets))
        parts = [
            self._best(plant, start, targets[first : first + size], limit)
            for first in range(0, len(targets), size)
        ]
        return np.concatenate(parts) if parts else np.empty((0, plant.n_fins, 3))

    def _best(self, plant: Plant, start: Array, targets: Array, limit: TimeLimit) -> Array:
        sigma, n_targets = self.normalization.std, len(targets)
        starts = np.tile(start, (n_targets, 1, 1))
        repeated = np.repeat(targets, len(start), axis=0)
        refined = descend(
            plant, starts, repeated, sigma, self._descent, self._cost(plant), lambda: limit.over
        )
        winner = refined.objective.reshape(n_targets, -1).argmin(axis=1)
        command = refined.command.reshape(n_targets, len(start), -1, 3)[np.arange(n_targets), winner]
        return descend(plant, command, targets, sigma, POLISH, is_over=lambda: limit.over).command
