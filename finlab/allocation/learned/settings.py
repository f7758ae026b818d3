"""What can be set of the methods with networks, and the same names for editors and type checkers.

A test holds the typed options against the settings.
"""

from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from finlab.allocation.search.settings import SearchOptions, Settings
from finlab.errors import AllocationError


@dataclass(frozen=True)
class MdnSettings(Settings):
    """How many ways the mixture proposes; each of them is searched."""

    n_candidates: int = 16
    """Number K of proposals: the components' means by falling weight, then samples of the mixture."""
    temperature: float = 1.0
    """What the variances of these samples are multiplied by; 1 draws from the mixture itself."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.n_candidates < 1 or not 0.0 <= self.temperature < np.inf:
            raise AllocationError(
                "method 'mdn' needs at least one candidate and a temperature from 0, got "
                f"n_candidates={self.n_candidates}, temperature={self.temperature}"
            )


STEPS = {"none": 0, "adam": 160, "levenberg-marquardt": 20}
"""Refinement -> its number of steps where the settings name none."""


@dataclass(frozen=True)
class PaperSettings:
    """The stages of the paper's pipeline.

    What the paper does not print is a choice made here: gamma and the weights of J_en, Adam's rate, the
    number of refined candidates and steps, that the best step is kept, and that zero directions turn on
    beyond the seam.
    """

    n_candidates: int = 64
    """Number K of candidates drawn from the mixture."""
    temperature: float = 0.02
    """T of the sampling; 0.02 in the paper."""
    gamma: float = 1e-4
    """Weight of the energy in J = J_norm + gamma J_en."""
    n_refined: int = 4
    """Best-ranked candidates that are refined."""
    refinement: str = "adam"
    """`adam`, `levenberg-marquardt` (ablation) or `none` (ablation)."""
    n_steps: int | None = None
    """Steps of the refinement; as in `STEPS` where None."""
    warm_start: str = "mdn"
    """`mdn` samples the mixture, `random` draws uniform commands (ablation)."""
    ranking: str = "physics"
    """`physics` ranks by J, `nll` by the mixture's likelihood (ablation)."""
    mean_only: bool = False
    """Take the mixture's mean and nothing else (ablation)."""

    def __post_init__(self) -> None:
        for key, known in (
            ("refinement", tuple(STEPS)),
            ("warm_start", ("mdn", "random")),
            ("ranking", ("physics", "nll")),
        ):
            if getattr(self, key) not in known:
                got = getattr(self, key)
                raise AllocationError(f"{key}: expected one of {', '.join(known)}, got {got!r}")
        if self.n_candidates < 1 or self.n_refined < 1 or not self.temperature >= 0.0:
            raise AllocationError(
                "method 'paper' needs at least one candidate and refined one and a temperature from 0, got "
                f"n_candidates={self.n_candidates}, n_refined={self.n_refined}, "
                f"temperature={self.temperature}"
            )


class MdnOptions(SearchOptions, total=False):
    """Settings of the method `mdn`."""

    n_candidates: int
    temperature: float


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
