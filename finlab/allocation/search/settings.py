"""What can be set of the default method, and the same names for editors and type checkers.

A test holds the typed options against the settings.
"""

from dataclasses import dataclass
from typing import TypedDict

from finlab.errors import AllocationError
from finlab.physics.energy import EnergyWeights
from finlab.physics.objective import Name


@dataclass(frozen=True)
class Settings:
    """How widely and how long the search goes."""

    n_refined: int = 4
    """Allocations that are refined and offered as candidates."""
    search_steps: int | None = None
    """Quadratic problems solved in turn by the search in force space; None: as many as the objective and the
    number of fins ask for."""
    refine_steps: int = 1
    """Levenberg-Marquardt steps on the commands, by the fins' own laws."""
    subsets: bool = True
    """Whether allocations that rest some fins are searched, where the objective may prefer them; of many fins
    also near the best that any method began with."""
    period_s: float = 0.1
    """Time between ticks [s], by which the previous command is taken to be old."""

    def __post_init__(self) -> None:
        if (
            self.n_refined < 1
            or self.refine_steps < 0
            or (self.search_steps is not None and self.search_steps < 1)
        ):
            raise AllocationError(
                "method 'search' needs at least one refined answer, one step of search and no negative "
                f"number of refining steps, got n_refined={self.n_refined}, "
                f"search_steps={self.search_steps}, refine_steps={self.refine_steps}"
            )


class SearchOptions(TypedDict, total=False):
    """Settings of the method `search`."""

    objective: Name
    energy_weights: EnergyWeights
    copper_loss: float
    n_refined: int
    search_steps: int | None
    refine_steps: int
    subsets: bool
    period_s: float
