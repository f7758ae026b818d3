"""What a method's solver hands over, before anybody has judged it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.plain_data import PlainData

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidates(PlainData):
    """Several commands for one target, best first. Failed fins hold NaN."""

    command: Array
    """Commands (K, n, 3): amplitude [rad], frequency [Hz], zero direction [rad]."""
    wrench: Array
    """Wrench (K, 6) that the method's own model expects [N, N m]."""
    err_norm: Array
    """Normalized error (K,) of that wrench."""
    energy: Array
    """Energy proxy (K,)."""
    source: tuple[str, ...]
    """Where each one comes from, in words."""

    def __len__(self) -> int:
        return len(self.command)


class Solution(NamedTuple):
    """What a method's solver returns for N targets on the n healthy fins of one layout."""

    command: Array
    """Chosen commands (N, n, 3)."""
    wrench_surrogate: Array | None = None
    """Wrench (N, 6) that the method itself believed, where it used a model of its own."""
    candidates: Callable[[], Candidates] | None = None
    """Gives the refined candidates, for a single target."""
    samples: Callable[[], Candidates] | None = None
    """Gives the raw candidates before refinement, for a single target."""
    alternatives: Callable[[], Candidates] | None = None
    """Gives many refined answers to a single target, the chosen one first, by a wider search."""
