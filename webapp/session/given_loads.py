"""Loads that the user has given by a file, which capability plots are about."""

from dataclasses import dataclass

from finlab.analysis.ship_file import Ship

Wrench = tuple[float, ...]
"""A wrench (6,) [N, N m], body frame."""


@dataclass(frozen=True)
class GivenLoads:
    """What a file says: either a ship's particulars, or a wrench for each heading."""

    file: str
    """Its name."""
    ship: Ship | None = None
    """Particulars by which DNV-ST-0111, level 1, has the loads."""
    headings: tuple[float, ...] = ()
    """Where loads come from (H,) [deg]."""
    wrenches: tuple[Wrench, ...] = ()
    """The load from each of these (H, 6)."""
