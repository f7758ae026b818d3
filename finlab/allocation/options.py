"""Settings of the methods with networks, by name: what editors complete and type checkers check.

What each one does is told where it lives: in `finlab.allocation.learned.settings` and `...paper_settings`.
A test holds the two against each other.
"""

from __future__ import annotations

from typing import TypedDict

from finlab.physics.energy import EnergyWeights


class LearnedOptions(TypedDict, total=False):
    """Settings of the methods `learned` and `fast`."""

    energy_weights: EnergyWeights
    n_candidates: int
    temperature: float
    gamma: float
    n_seeds: int
    n_refined: int
    search_steps: int | None
    refine_steps: int
    subsets: bool
    energy_tradeoff: float


class PaperOptions(TypedDict, total=False):
    """Settings of the method `paper`."""

    n_candidates: int
    temperature: float
    gamma: float
    n_refined: int
    refinement: str
    n_steps: int | None
    warm_start: str
    ranking: str
    mean_only: bool
