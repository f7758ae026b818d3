"""What breaks on the way: a fin that is lost, weak or stuck, or whole again, and when."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from finlab.errors import FinlabError

KINDS = ("lost", "weak", "stuck", "whole")
"""What can become of a fin: it hangs still and drags; it gives a share of its thrust; it beats but no longer
turns; it works again as it should."""


class FinFault(NamedTuple):
    """One event of a swim; `("front_left", 30.0)` is a fin that is lost."""

    fin: str
    """Its name."""
    time_s: float
    """When [s]."""
    kind: str = "lost"
    """One of `KINDS`."""
    share: float = 0.5
    """Share of the thrust that is left of a weak fin, above 0 and below 1; of no meaning for the others."""

    def checked(self) -> "FinFault":
        """Itself; a `FinlabError` where a time, a kind or a share is none."""
        if not (math.isfinite(self.time_s) and self.time_s >= 0.0):
            raise FinlabError(f"failure of {self.fin}: expected a time of 0 s or more, got {self.time_s}")
        if self.kind not in KINDS:
            raise FinlabError(f"failure of {self.fin}: expected {', '.join(KINDS)}, got {self.kind!r:.60}")
        if not 0.0 < self.share < 1.0:
            raise FinlabError(
                f"failure of {self.fin}: expected a share of the thrust between 0 and 1, got {self.share}"
            )
        return self


def names_of(faults: Mapping[str, FinFault], kind: str) -> tuple[str, ...]:
    """Fins to which that has happened, in order."""
    return tuple(name for name, fault in faults.items() if fault.kind == kind)
