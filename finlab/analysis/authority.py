"""Which axes the fins hold, how evenly, and what the loss of each single fin costs."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.forces.extent import RANK_TOLERANCE, singular_values, strongest, weakest
from finlab.forces.fin_sets import SCALE, fin_sets
from finlab.forces.reach import max_wrench_along_exactly
from finlab.layout import Layout

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
NOTHING = 1e-4
"""Largest wrench [N, scaled] below which an axis counts as out of reach; the solver is exact to about
1e-5."""


@dataclass(frozen=True)
class HeldAxes:
    """Axes that fins hold, before any limit. Torques are scaled by the lever 0.2 m."""

    rank: int
    condition: float | None
    """Largest over smallest singular value; None below rank 6."""
    without_authority: tuple[str, ...]
    """Axes that no fin pushes at all."""
    coupled: tuple[str, ...]
    """Axes that are pushed, but never without pushing others too."""

    @property
    def alone(self) -> tuple[str, ...]:
        """Axes that can be pushed alone."""
        return tuple(axis for axis in AXES if axis not in self.without_authority + self.coupled)


@dataclass(frozen=True)
class Authority(HeldAxes):
    """What a set of fins holds, within their limits too."""

    singular_values: tuple[float, ...]
    """Of the matrix whose columns are the fins' scaled wrenches at full thrust (6,) [N], falling."""
    largest: tuple[float, ...]
    """Largest wrench along each axis with the other five at zero (6,) [N, N m]."""
    most_negative: tuple[float, ...]
    """The same along the negative axes, as a size (6,) [N, N m]."""
    weakest: float
    """Scaled wrench [N] that is within reach in every direction; 0 below rank 6."""
    weakest_direction: tuple[float, ...]
    """Unit scaled wrench (6,) along which no more than `weakest` can be had."""
    isotropy: float
    """`weakest` over the largest scaled wrench in any direction: 1 is the same everywhere, 0 none
    somewhere."""
    gap: float
    """`largest` and `most_negative` are too large by at most this [N, scaled]."""

    @property
    def reachable(self) -> tuple[str, ...]:
        """Axes along which something can be had both ways with the other five at zero."""
        both = zip(AXES, self.largest, self.most_negative, SCALE, strict=True)
        return tuple(name for name, a, b, unit in both if min(a, b) > NOTHING * unit)


@dataclass(frozen=True)
class Loss:
    """What the loss of one fin costs."""

    fin: str
    rank: int
    reachable: tuple[str, ...]
    """Axes still reachable alone."""
    lost: tuple[str, ...]
    """Axes that were and no longer are."""
    share_left: tuple[float | None, ...]
    """Share of the largest wrench along each axis that is left (6,), the smaller of both signs; None where
    there was nothing."""
    weakest: float
    """Scaled wrench [N] that is within reach in every direction afterwards."""


def authority(layout: Layout, failed: Collection[str] = ()) -> Authority:
    """Returns what the working fins hold.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    return _authorities(layout, [failed])[0]


def losses(layout: Layout, failed: Collection[str] = (), before: Authority | None = None) -> tuple[Loss, ...]:
    """Returns what the loss of each working fin, on top of `failed`, would cost; none when only one is left.

    Args:
        layout: the robot.
        failed: fins that are lost already.
        before: what the working fins hold, if that is known.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    held = authority(layout, failed) if before is None else before
    working = [name for name in layout.names if name not in failed]
    if len(working) < 2:
        return ()
    left = _authorities(layout, [(*failed, name) for name in working])
    return tuple(_loss(held, name, after) for name, after in zip(working, left, strict=True))


def _authorities(layout: Layout, failures: Sequence[Collection[str]]) -> list[Authority]:
    """What is held after each of several failures; one call for all is quicker than many."""
    sets = fin_sets(layout).tile(len(failures))
    for row, failed in enumerate(failures):
        sets.radius[row, list(layout.indices(tuple(failed)))] = 0.0
    values, vectors = singular_values(sets)
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    size, gap = max_wrench_along_exactly(sets, axes)
    size = np.where(size > NOTHING, size, 0.0)
    least, most = weakest(sets), strongest(sets)
    isotropy = np.divide(least.size, most.size, out=np.zeros_like(least.size), where=most.size > 0.0)
    return [
        Authority(
            **vars(held_axes(values[k], vectors[k])),
            singular_values=_floats(values[k]),
            largest=_floats(size[k, :6] * SCALE),
            most_negative=_floats(size[k, 6:] * SCALE),
            weakest=float(least.size[k]),
            weakest_direction=_floats(least.direction[k]),
            isotropy=float(isotropy[k]),
            gap=gap,
        )
        for k in range(len(failures))
    ]


def held_axes(values: Array, vectors: Array) -> HeldAxes:
    """Returns what singular values (6,), falling, and left vectors (6, 6) hold."""
    kept = values > RANK_TOLERANCE * max(values[0], 1e-9)
    # How much of each axis lies in the span of all wrenches: one that is held whole can be pushed alone.
    held = np.linalg.norm(vectors[:, kept], axis=1)
    pushed = held > RANK_TOLERANCE
    coupled = pushed & (held <= 1.0 - RANK_TOLERANCE)
    return HeldAxes(
        rank=int(kept.sum()),
        condition=float(values[0] / values[5]) if kept.all() else None,
        without_authority=tuple(np.array(AXES)[~pushed].tolist()),
        coupled=tuple(np.array(AXES)[coupled].tolist()),
    )


def _loss(before: Authority, name: str, after: Authority) -> Loss:
    had = np.array([before.largest, before.most_negative])
    left = np.array([after.largest, after.most_negative])
    share = np.where(had > 0.0, left / np.where(had > 0.0, had, 1.0), np.inf).min(axis=0)
    return Loss(
        fin=name,
        rank=after.rank,
        reachable=after.reachable,
        lost=tuple(axis for axis in before.reachable if axis not in after.reachable),
        share_left=tuple(None if np.isinf(value) else float(min(value, 1.0)) for value in share),
        weakest=after.weakest,
    )


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in values + 0.0)
