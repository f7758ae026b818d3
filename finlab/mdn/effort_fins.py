"""The compiled fins of one robot, side by side: what they can do, looked up for many forces at once.

A planar force is a complex number: its horizontal part, and 1j times its vertical part, in newton.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.layout import Layout
from finlab.layout.angles import TURN
from finlab.mdn.effort_fin import DEFLECTION, LEVELS, EffortFin, effort_fin
from finlab.physics.effort import EffortWeights

LEAST = 1e-12
"""What sizes are kept above before something is divided by them."""
PLACES = 2.0 / np.pi * (LEVELS - 1) * (1.0 - 1e-12)
"""From the angle of a force in the table to its place among the levels, of which none is past the last."""


class Boundary(NamedTuple):
    """What R rows of n fins can do in given directions; (n,) where all fins are the same all round."""

    smallest: Array
    """Force at rest (R, n) [N]."""
    largest: Array
    """Largest force (R, n) [N]."""
    first: NDArray[np.intp]
    """Row of the table (R, n) with which the direction just before this one begins."""
    part: Array | None
    """How far towards the next row (R, n); None where there is but one."""


class Projected(NamedTuple):
    """What R rows of n fins can do nearest to given forces."""

    unit: AnyArray
    """Unit vector along the force (R, n), complex."""
    size: Array
    """Size of the force (R, n) [N]."""
    wanted: Array
    """The size (R, n) [N] that is given in that direction where limits of size do not hold."""
    boundary: Boundary
    """In these directions."""
    stopped: NDArray[np.bool_] | None
    """Where a stop keeps the fin from pointing along the given force (R, n); None where no fin has stops."""

    @property
    def force(self) -> AnyArray:
        """The forces (R, n) [N], complex."""
        return np.asarray(self.unit * self.size)

    @property
    def direction(self) -> Array:
        """Their directions (R, n) [rad]."""
        return np.asarray(np.arctan2(self.unit.imag, self.unit.real))


@dataclass(frozen=True, eq=False)
class EffortFins:
    """n compiled fins; each may be kept within a part of its arc."""

    smallest: Array
    """Force at rest (n, K) [N] by direction; K is 1 where all fins are the same all round."""
    largest: Array
    """Largest force (n, K) [N] by direction."""
    table: Array
    """The tables of the compiled fins (n * K * LEVELS, 7)."""
    domain: Array
    """Middle and half (2, n) [rad] of the arcs over which the K directions are spread."""
    middle: Array
    """Middle of the arc (n,) of force directions that are allowed [rad]."""
    half: Array
    """Half of that arc (n,) [rad]; pi for a full circle."""

    @classmethod
    def of(cls, fins: list[EffortFin]) -> Self:
        """Stack compiled fins."""
        count = max(len(fin.largest) for fin in fins)

        def spread(values: Array) -> Array:
            return values if len(values) == count else np.repeat(values, count, axis=0)

        table = np.stack([spread(fin.table) for fin in fins])
        middle, half = np.array([fin.middle for fin in fins]), np.array([fin.half for fin in fins])
        return cls(
            np.stack([spread(fin.smallest) for fin in fins]),
            np.stack([spread(fin.largest) for fin in fins]),
            np.ascontiguousarray(table.reshape(-1, table.shape[-1])),
            np.stack([middle, half]),
            middle,
            half,
        )

    @classmethod
    def of_layout(cls, layout: Layout, weights: EffortWeights) -> Self:
        """The compiled fins of a layout.

        Raises:
            DataError: a fin's force table cannot be read.
        """
        return cls.of([effort_fin(fin.model, fin.limits, weights) for fin in layout.fins])

    @cached_property
    def maximum(self) -> Array:
        """Largest force of each fin in any direction (n,) [N]."""
        return np.asarray(self.largest.max(axis=1))

    @cached_property
    def turns_fully(self) -> bool:
        """Whether every fin may point anywhere."""
        return bool((self.half >= np.pi).all())

    @cached_property
    def _steps(self) -> Array:
        """Rows of the table, and how much is added to them up to the next ones (n * K * LEVELS, 2, 7)."""
        return np.stack([self.table, np.diff(self.table, axis=0, append=self.table[-1:])], axis=1)

    @cached_property
    def _all_round(self) -> Boundary:
        """What fins that are the same all round can do."""
        first = np.arange(len(self.largest)) * LEVELS
        return Boundary(self.smallest[:, 0], self.largest[:, 0], first, None)

    def within(self, middle: Array, half: Array) -> "EffortFins":
        """The same fins kept within arcs (n,) of force directions [rad]."""
        return replace(self, middle=middle, half=half)

    def deflection(self, zero_direction: Array) -> Array:
        """By how much (n,) [rad] strong forces lean off zero directions (n,) [rad]."""
        found: Array = self.lookup(self.boundary(zero_direction[None]), self.maximum[None])
        return np.asarray(found[0, :, DEFLECTION])

    def boundary(self, direction: Array) -> Boundary:
        """What the fins can do in directions (R, n) [rad]."""
        count = self.largest.shape[1]
        if count == 1:
            return self._all_round
        middle, half = self.domain
        gap = np.maximum(2.0 * half / (count - 1), LEAST)
        # Directions just before an arc belong to its start, not to its end; a circle has none such.
        before = np.where(half < np.pi, 0.5 * gap, 0.0)
        place = np.mod(direction - (middle - half) + before, TURN)
        place = np.clip((place - before) / gap, 0.0, count - 1)
        row = np.minimum(place.astype(np.intp), count - 2)
        part = place - row
        row = row + np.arange(len(half)) * count
        low, high = (
            values.take(row) + part * (values.take(row + 1) - values.take(row))
            for values in (self.smallest.ravel(), self.largest.ravel())
        )
        return Boundary(low, high, row * LEVELS, part)

    def lookup(self, boundary: Boundary, size: Array) -> Array:
        """Rows (R, n, 7) of the tables for forces of sizes (R, n) [N] in the directions of a boundary."""
        place = size - boundary.smallest
        place /= boundary.largest - boundary.smallest + LEAST
        np.minimum(np.maximum(place, 0.0, out=place), 1.0, out=place)
        np.sqrt(np.sqrt(place, out=place), out=place)
        np.arcsin(place, out=place)
        place *= PLACES
        level = place.astype(np.intp)
        place -= level
        part = place[..., None]
        level += boundary.first
        found = self._between(level, part)
        if boundary.part is not None:
            found += (self._between(level + LEVELS, part) - found) * boundary.part[..., None]
        return found

    def _between(self, row: NDArray[np.intp], part: Array) -> Array:
        step = self._steps.take(row, axis=0)
        found: Array = step[..., 1, :] * part
        found += step[..., 0, :]
        return found

    def project(self, force: AnyArray) -> Projected:
        """What the fins can do nearest to forces (R, n), complex."""
        wanted, stopped = np.abs(force) + LEAST, None
        unit = force / wanted
        if not self.turns_fully:
            offset = np.angle(unit * np.exp(-1j * self.middle))
            held = np.clip(offset, -self.half, self.half)
            excess = np.abs(offset - held)
            stopped = excess > 0.0
            wanted = np.where(excess < 0.5 * np.pi, wanted * np.cos(excess), 0.0)
            unit = np.exp(1j * (self.middle + held))
        boundary = self._all_round
        if self.largest.shape[1] > 1:
            boundary = self.boundary(np.angle(unit))
        size = np.minimum(np.maximum(wanted, boundary.smallest), boundary.largest)
        return Projected(unit, size, wanted, boundary, stopped)
