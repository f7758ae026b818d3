"""Answers to many targets on one layout."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.judging import REACHED, Judge
from finlab.allocation.plain_data import PlainData
from finlab.allocation.policy import CLOSEST, Policy
from finlab.layout import Layout

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class BatchAllocation(PlainData):
    """Answers to N targets, as plain data; the fields are those of `Allocation`, with N rows."""

    layout: Layout
    """The whole layout, failed fins included, with the limits that damage has left."""
    failed: tuple[str, ...]
    """Names of the fins that were left out."""
    target: Array
    """Desired wrenches (N, 6), [N, N m], body frame."""
    command: Array
    """Commands (N, n, 3): amplitude [rad], frequency [Hz], zero direction [rad]; NaN for failed fins."""
    fin_forces: Array
    """Forces (N, n, 3) that the judge finds for each fin [N], body frame; zero if failed."""
    wrench: Array
    """Delivered wrenches (N, 6) as the judge finds them [N, N m]."""
    err_norm: Array
    """Sizes (N,) of what is missing from the targets, each axis over its `sigma`."""
    energy: Array
    """Energy proxy `J_en` (N,) of the commands."""
    sigma: Array
    """Per-axis standard deviation (6,) of the error measure."""
    judged_by: Judge
    """Who computed `fin_forces` and `wrench`: the analytic fin models, or the learned surrogate."""
    method: str
    """Name of the method that answered."""
    solve_ms: Array = field(compare=False)
    """Time per target (N,) [ms]; the whole time divided by N where targets were solved together."""
    checkpoint: str | None = None
    """Name of the checkpoint that was used, if any."""
    policy: Policy = CLOSEST
    """What was to be done about targets out of reach."""
    seed: int = 0
    """Seed that makes the answers repeatable."""
    wrench_surrogate: Array | None = None
    """Wrenches (N, 6) that the method itself expected, if it used a learned model."""
    unknown_fins: tuple[str, ...] = ()
    """Names of fins whose model the method's networks have not learned; answers for them are wrong."""
    notes: tuple[str, ...] = ()
    """Sentences that the user should read, such as a fin model that the checkpoint never saw."""

    @property
    def fins(self) -> tuple[str, ...]:
        """Names of the fins, in the order of `command`."""
        return self.layout.names

    @property
    def unallocated(self) -> Array:
        """What the robot does not deliver: targets minus delivered wrenches (N, 6)."""
        return self.target - self.wrench

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Which targets are delivered (N,): an `err_norm` of at most 0.01."""
        return self.err_norm <= REACHED

    def __len__(self) -> int:
        return len(self.target)

    def __repr__(self) -> str:
        worst = f"{self.err_norm.max():.2e}" if len(self) else "none"
        return (
            f"BatchAllocation({len(self)} targets, layout={self.layout.name!r:.60}, fins={len(self.fins)}, "
            f"method={self.method!r}, delivered={int(self.reachable.sum())}, "
            f"largest err_norm={worst} by the {self.judged_by})"
        )
