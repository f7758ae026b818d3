"""What breaks on the way: which fin, when, and what becomes of it, in the words of `finlab.layout.damage`."""

import math
from collections.abc import Mapping
from typing import NamedTuple, cast

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.damage import Damage, Kind

KINDS: tuple[Kind, ...] = ("lost", "torn", "stuck", "whole")
"""What can become of a fin in a swim: it hangs still; it gives a share of its thrust; it beats but
no longer turns; it works again as it should."""


class FinFault(NamedTuple):
    """One event of a swim; `("front_left", 30.0)` is a fin that is lost."""

    fin: str
    time_s: float
    """When [s]."""
    kind: Kind = "lost"
    share: float = 0.5
    """Share of the thrust that is left of a torn fin, above 0 and below 1; of no meaning for the others."""

    @classmethod
    def parse(cls, text: str) -> "FinFault":
        """What `NAME@SECONDS`, `NAME@SECONDS:KIND` or `NAME@SECONDS:torn=SHARE` says; else
        a `FinlabError`."""
        name, at, rest = text.rpartition("@")
        number, _, what = rest.partition(":")
        kind, equals, share = what.partition("=")
        try:
            known = cast(Kind, kind or "lost")
            fault = cls(name, float(number), known, float(share) if equals else 0.5).checked()
        except (ValueError, FinlabError):
            fault = None
        if not at or not name or fault is None or (equals and kind != "torn"):
            raise FinlabError(
                "--fail: expected NAME@SECONDS such as front_left@30, with :torn=0.5, :stuck or :whole after "
                f"it for what is no loss, got {text!r:.60}"
            )
        return fault

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


def damage_of(layout: Layout, faults: Mapping[str, FinFault], held: Array) -> Damage:
    """What faults, by name, leave of a robot; `held` (n,) is where actuators are stuck."""
    torn = {name: fault.share for name, fault in faults.items() if fault.kind == "torn"}
    stuck = {name: float(held[layout.index(name)]) for name, fault in faults.items() if fault.kind == "stuck"}
    lost = [name for name, fault in faults.items() if fault.kind == "lost"]
    return Damage.of(layout, lost, torn, stuck)
