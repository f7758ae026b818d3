"""Layouts that stay out of training: everything shipped in `layouts/`."""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.assets import shipped_layouts
from finlab.layout.arrays import stack_layouts
from finlab.layout.layout import Layout
from finlab.layout.load import load_layout

POSITION_TOLERANCE = 2e-3
"""Fins closer than this count as the same place [m]."""
ANGLE_TOLERANCE = math.radians(1.0)
"""Shafts closer than this count as the same direction [rad]."""


class Sieve(NamedTuple):
    """A top view of where reserved layouts have fins: a square grid around the origin."""

    occupied: NDArray[np.bool_]
    """(cells in x, cells in y), True if a reserved fin is there or within the tolerance of it."""

    cell: float
    """Side of a cell [m]."""

    reach: float
    """The grid covers -reach .. reach in x and y [m]; beyond, its outermost cells count."""


class ReservedLayouts:
    """A set of layouts and the question whether another layout is one of them, fins in any order."""

    def __init__(
        self,
        layouts: Sequence[Layout],
        position_tolerance: float = POSITION_TOLERANCE,
        angle_tolerance: float = ANGLE_TOLERANCE,
    ) -> None:
        """Takes the layouts and how close is the same, see `POSITION_TOLERANCE` and `ANGLE_TOLERANCE`."""
        self.layouts = tuple(layouts)
        self.position_tolerance = position_tolerance
        self.angle_tolerance = angle_tolerance
        self._arrays = stack_layouts(self.layouts)
        self.sieve = self._make_sieve()

    def matches(
        self, position: ArrayLike, mounting_angle: ArrayLike, mask: ArrayLike | None = None
    ) -> NDArray[np.bool_]:
        """Returns which layouts of a batch are reserved.

        A layout is one of the reserved ones when it has as many fins, each of its fins lies at one of
        theirs, and each of theirs at one of its own.

        Args:
            position: (B, n, 3) [m].
            mounting_angle: (B, n) [rad].
            mask: (B, n), False for padding; None when there is none.

        Returns:
            (B,) True where reserved.
        """
        theirs = self._arrays
        place = np.asarray(position, dtype=np.float64)[:, None, :, None]  # (B, layouts, n, fins of theirs, 3)
        angle = np.asarray(mounting_angle, dtype=np.float64)[:, None, :, None]
        here = np.ones(angle.shape, dtype=bool)
        if mask is not None:
            here = np.asarray(mask, dtype=bool)[:, None, :, None]
        there = theirs.mask[:, None, :]
        away = np.linalg.norm(place - theirs.position[:, None], axis=-1)
        turn = np.abs(np.mod(angle - theirs.mounting_angle[:, None] + math.pi, 2 * math.pi) - math.pi)
        near = (away <= self.position_tolerance) & (turn <= self.angle_tolerance) & here & there
        every_own = (near.any(axis=3) | ~here[..., 0]).all(axis=2)
        every_theirs = (near.any(axis=2) | ~theirs.mask).all(axis=2)
        as_many = here.sum(axis=(2, 3)) == theirs.mask.sum(axis=1)
        result: NDArray[np.bool_] = (as_many & every_own & every_theirs).any(axis=1)
        return result

    def _make_sieve(self, cell: float = 0.005, reach: float = 0.5) -> Sieve:
        count = round(2 * reach / cell)
        occupied = np.zeros((count, count), dtype=bool)
        # Half a millimetre more than the tolerance covers the rounding of float32 positions.
        margin = self.position_tolerance + 5e-4
        for x, y, _ in self._arrays.position[self._arrays.mask]:
            low = np.clip((np.array([x, y]) - margin + reach) // cell, 0, count - 1).astype(int)
            high = np.clip((np.array([x, y]) + margin + reach) // cell, 0, count - 1).astype(int)
            occupied[low[0] : high[0] + 1, low[1] : high[1] + 1] = True
        return Sieve(occupied, cell, reach)


@functools.cache
def shipped_reserved() -> ReservedLayouts:
    """Returns the layouts shipped with finlab as a reserved set, read once."""
    return ReservedLayouts([load_layout(path) for path in shipped_layouts().values()])
