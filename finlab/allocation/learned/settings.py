"""How widely and how long the learned method searches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finlab.errors import AllocationError


@dataclass(frozen=True)
class Settings:
    """How widely and how long the pipeline searches."""

    n_candidates: int = 64
    """Number K of candidates drawn from the mixture."""
    temperature: float = 0.02
    """T of the sampling; 0.02 in the paper."""
    gamma: float = 1e-2
    """Weight of the energy in the ranking J = J_norm + gamma J_en."""
    n_seeds: int = 6
    """Candidates that enter the search."""
    n_refined: int = 4
    """Allocations that are refined and offered as candidates."""
    search_steps: int | None = None
    """Reweighting steps of the search in force space; None: 4, and 12 from six fins on, where there is
    more to choose from."""
    refine_steps: int = 1
    """Levenberg-Marquardt steps."""
    subsets: bool = True
    """Whether sub-layouts are searched as well."""
    energy_tradeoff: float = 0.0
    """w of the weighted sum `err_norm^2 + w J_en` to minimize; 0: the least energy among exact answers."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.energy_tradeoff < np.inf:
            raise AllocationError(f"energy_tradeoff: expected a number from 0, got {self.energy_tradeoff}")
        if self.n_candidates < 1 or self.n_seeds < 1 or self.n_refined < 1 or not self.temperature >= 0.0:
            raise AllocationError(
                "method 'learned' needs at least one candidate, seed and refined answer and a temperature "
                f"from 0, got n_candidates={self.n_candidates}, n_seeds={self.n_seeds}, "
                f"n_refined={self.n_refined}, temperature={self.temperature}"
            )
