"""What can be set of the default method, and the same names for editors and type checkers.

A test holds the typed options against the settings.
"""

from dataclasses import dataclass

from finlab.allocation.settings import AimOptions, AimSettings, number, switch

MOST_CANDIDATES = 4096
"""Most candidates that may be drawn; more would keep a robot from answering."""


@dataclass(frozen=True)
class SearchSettings(AimSettings):
    """How widely and how long the search goes."""

    n_refined: int = number(4, 1, 256, "allocations that are refined and offered as candidates")
    search_steps: int | None = number(
        None, 1, 100, "quadratic problems of the search in force space; None for as many as are needed"
    )
    refine_steps: int = number(1, 0, 100, "Levenberg-Marquardt steps on the commands, by the fins' own laws")
    subsets: bool = switch(True, "whether allocations that rest some fins are searched for effort")
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)


class SearchOptions(AimOptions, total=False):
    """Settings of the method `search`."""

    n_refined: int
    search_steps: int | None
    refine_steps: int
    subsets: bool
    period_s: float


@dataclass(frozen=True)
class MdnSettings(SearchSettings):
    """How many ways the mixture proposes; each of them is searched."""

    n_candidates: int = number(
        16, 1, MOST_CANDIDATES, "proposals K: the components' means by falling weight, then samples"
    )
    temperature: float = number(1.0, 0.0, 100.0, "what the variances of these samples are multiplied by")


class MdnOptions(SearchOptions, total=False):
    """Settings of the method `mdn`."""

    n_candidates: int
    temperature: float
