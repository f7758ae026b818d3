"""What can be set of the default method, and the same names for editors and type checkers.

A test holds the typed options against the settings.
"""

from dataclasses import dataclass

from finlab.allocation.settings import AimOptions, AimSettings, number, switch


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
