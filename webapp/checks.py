"""Quick checks of a layout while it is being edited: authority, failures, fins in each other's way."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Layout, layout_effectiveness
from webapp.meshes.fin import SPAN
from webapp.meshes.hull import hull_of
from webapp.targets import axis_reach

LEVER = 0.2
"""Length [m] that makes torques comparable to forces in the condition number."""


@dataclass(frozen=True)
class Checks:
    """What there is to know about a layout at a glance."""

    rank: int
    """How many of the six axes the fins can act on independently."""
    condition: float
    """Condition number of the effectiveness, torques measured at a lever of 0.2 m; infinite below rank 6."""
    reach: NDArray[np.float64]
    """Largest wrench along each axis (6,) [N, N m], other axes left free."""
    remaining: NDArray[np.float64]
    """Share of the reach (6,) that is left after the worst single failure; NaN with one fin."""
    costliest: tuple[str, ...]
    """Name of the fin whose loss costs most, per axis, `""` where all cost the same; empty with one fin."""
    warnings: tuple[str, ...]
    """Sentences about fins that are in the way of each other or of the hull."""


def check(layout: Layout) -> Checks:
    """Look over a layout."""
    matrix = layout_effectiveness(layout) / np.array([1, 1, 1, LEVER, LEVER, LEVER])[:, None]
    singular = np.linalg.svd(matrix, compute_uv=False)
    rank = int((singular > 1e-6 * max(singular[0], 1e-12)).sum())
    reach = axis_reach(layout)
    remaining: NDArray[np.float64] = np.full(6, np.nan)
    costliest: tuple[str, ...] = ()
    if layout.n_fins > 1:
        with np.errstate(invalid="ignore", divide="ignore"):
            left = np.array([axis_reach(layout, (name,)) for name in layout.names]) / np.where(
                reach > 1e-6, reach, 1
            )
        remaining = left.min(axis=0)
        same = np.ptp(left, axis=0) < 1e-3
        costliest = tuple("" if same[k] else layout.names[i] for k, i in enumerate(left.argmin(axis=0)))
    condition = float(singular[0] / singular[5]) if rank == 6 else float("inf")
    return Checks(rank, condition, reach, remaining, costliest, _warnings(layout))


def _warnings(layout: Layout) -> tuple[str, ...]:
    hull = hull_of(layout)
    sentences = []
    for a, b in combinations(layout.fins, 2):
        gap = float(np.linalg.norm(np.subtract(a.position, b.position)))
        if gap < SPAN:
            sentences.append(f"{a.name} and {b.name} are {100 * gap:.0f} cm apart and may touch.")
    for fin in layout.fins:
        shaft = np.array([np.cos(fin.mounting_angle), np.sin(fin.mounting_angle), 0.0])
        if hull.contains(np.array(fin.position) + 0.05 * shaft):
            sentences.append(f"{fin.name} beats inside the hull.")
    return tuple(sentences)
