"""Method `multistart`: random seeds, batched Levenberg-Marquardt within the limits, the lowest J wins."""

from functools import lru_cache
from typing import Unpack

import numpy as np

from finlab.allocation.aim import Aim
from finlab.allocation.baselines.model_based import (
    CACHE_SIZE,
    ENERGY_TRADEOFF,
    TIME_LIMIT_S,
    ModelBased,
    TimeLimit,
    check_time_limit,
)
from finlab.allocation.weighted_descent import DescentOptions, descend
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.physics import Plant

CHUNK_ROWS = 2048
"""Commands refined together; more would not fit the caches."""
POLISH = DescentOptions(n_steps=20, damping=1e-6)
"""Last steps of the winner, on the error alone."""


class Multistart(ModelBased):
    """Uniform random commands refined on error and cost, the best one polished on the error alone.

    Args:
        normalization: sigma scales the error.
        n_candidates: random commands per target.
        n_steps: most refinement steps of each.
        energy_tradeoff: weight of the cost beside the squared normalized error; see `command_cost`.
        time_limit_s: processor time per target after which the best command so far is the answer.
        aim: see `ModelBased`.
    """

    name = "multistart"

    def __init__(
        self,
        normalization: Normalization,
        *,
        n_candidates: int = 16,
        n_steps: int = 20,
        energy_tradeoff: float = ENERGY_TRADEOFF,
        time_limit_s: float = TIME_LIMIT_S,
        **aim: Unpack[Aim],
    ) -> None:
        super().__init__(normalization, **aim)
        self.n_candidates, self.n_steps, self.energy_tradeoff = n_candidates, n_steps, energy_tradeoff
        self.time_limit_s = check_time_limit(time_limit_s)
        if not 0.0 <= energy_tradeoff < np.inf:
            raise AllocationError(f"energy_tradeoff: expected a number from 0, got {energy_tradeoff}")
        self._cost = lru_cache(CACHE_SIZE)(lambda plant: self._weigh(plant, energy_tradeoff))
        self._descent = DescentOptions(n_steps=n_steps)

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
