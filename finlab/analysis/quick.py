"""What a layout holds, told in a millisecond while it is being changed, and what each loss costs."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.authority import AXES
from finlab.forces.extent import RANK_TOLERANCE, singular_values
from finlab.forces.fin_sets import fin_sets
from finlab.layout import Layout


@dataclass(frozen=True)
class QuickCheck:
    """Axes that the working fins hold, before any limit. Torques are scaled by the lever 0.2 m."""

    rank: int
    """How many of the six axes the fins act on independently."""
    condition: float | None
    """Largest over smallest singular value; None below rank 6."""
    without_authority: tuple[str, ...]
    """Axes that no fin pushes at all."""
    coupled: tuple[str, ...]
    """Axes that are pushed, but never without pushing others too."""
    lost: tuple[tuple[str, tuple[str, ...]], ...]
    """Working fins with the axes that the loss of each costs; fins that cost none are left out."""


def quick_check(layout: Layout, failed: Collection[str] = ()) -> QuickCheck:
    """Returns what the working fins hold, from singular values alone.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    working = [name for name in layout.names if name not in failed]
    losses = working if len(working) > 1 else []
    sets = fin_sets(layout, failed).tile(1 + len(losses))
    for row, name in enumerate(losses, start=1):
        sets.radius[row, layout.index(name)] = 0.0
    values, vectors = singular_values(sets)
    held = [_held(*pair) for pair in zip(values, vectors, strict=True)]
    pushed, alone = held[0] > RANK_TOLERANCE, held[0] > 1.0 - RANK_TOLERANCE
    kept = values[0] > RANK_TOLERANCE * max(values[0, 0], 1e-9)
    lost = [
        (name, tuple(AXES[k] for k in range(6) if alone[k] and after[k] <= 1.0 - RANK_TOLERANCE))
        for name, after in zip(losses, held[1:], strict=True)
    ]
    return QuickCheck(
        rank=int(kept.sum()),
        condition=float(values[0, 0] / values[0, 5]) if kept.all() else None,
        without_authority=tuple(name for name, p in zip(AXES, pushed, strict=True) if not p),
        coupled=tuple(name for name, p, a in zip(AXES, pushed, alone, strict=True) if p and not a),
        lost=tuple(pair for pair in lost if pair[1]),
    )


def _held(values: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of each axis (6,) lies in the span of all wrenches: 1 can be pushed alone, 0 not at all."""
    kept = values > RANK_TOLERANCE * max(values[0], 1e-9)
    return np.asarray(np.linalg.norm(vectors[:, kept], axis=1))
