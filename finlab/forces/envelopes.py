"""The compiled fins of one robot, side by side: what they can do, looked up for many forces at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.forces.fin_envelope import DEFLECTION, LEVELS, SHAFT, FinEnvelope, fin_envelope
from finlab.layout import Layout
from finlab.layout.angles import TURN
from finlab.physics.objective import Objective

LEAST = 1e-12
"""What sizes are kept above before something is divided by them."""
BOUNDARY = 48
"""Sides of the polygon around what an uneven fin can push: at most a fifth of a percent too wide."""
PLACES = 2.0 / np.pi * (LEVELS - 1) * (1.0 - 1e-12)
"""From the angle of a force in the table to its place among the levels, of which none is past the last."""
LONGEST_TURN = 0.3
"""Largest turn [rad] from a direction to that of the nearest force on the rim."""


class Boundary(NamedTuple):
    """What R rows of n fins can do in given directions; (n,) where all fins are the same all round."""

    largest: Array
    """Largest force (R, n) [N]."""
    smallest: Array
    """Force at rest (R, n) [N]."""
    span: Array
    """What lies between the two (R, n) [N], above zero."""
    hessian: Array | float
    """Derivative of the largest force by the direction (R, n) [N/rad]."""
    first: NDArray[np.intp]
    """Row of the table (R, n) with which the direction just before this one begins."""
    part: Array | None
    """How far towards the next row (R, n); None where there is but one."""


class Projected(NamedTuple):
    """What R rows of n fins can do near given forces."""

    unit: Array
    """Unit vector along the force (R, 2, n)."""
    direction: Array
    """The same as an angle (R, n) [rad]."""
    size: Array
    """Size of the force (R, n) [N]."""
    wanted: Array
    """The size (R, n) [N] that is given in that direction where limits of size do not hold."""
    boundary: Boundary
    """In these directions."""
    stopped: NDArray[np.bool_] | None
    """Where a stop keeps the fin from pointing along the given force (R, n); None where no fin has stops."""


@dataclass(frozen=True, eq=False)
class Envelopes:
    """n compiled fins; each may be kept within a part of its arc."""

    largest: Array
    """Largest force (n, K) [N] by direction; K is 1 where all fins are the same all round."""
    smallest: Array
    """Force at rest (n, K) [N] by direction."""
    table: Array
    """What `finlab.forces.fin_envelope` has compiled, (n * K * LEVELS, 8)."""
    domain: Array
    """Middle and half (2, n) [rad] of the arcs over which the K directions are spread."""
    middle: Array
    """Middle of the arc (n,) of force directions that are allowed [rad]."""
    half: Array
    """Half of that arc (n,) [rad]; pi for a full circle."""

    @classmethod
    def of(cls, fins: list[FinEnvelope]) -> Envelopes:
        """Stack compiled fins."""
        count = max(len(fin.largest) for fin in fins)

        def spread(values: Array) -> Array:
            return values if len(values) == count else np.repeat(values, count, axis=0)

        table = np.stack([spread(fin.table) for fin in fins])
        middle, half = np.array([fin.middle for fin in fins]), np.array([fin.half for fin in fins])
        return cls(
            np.stack([spread(fin.largest) for fin in fins]),
            np.stack([spread(fin.smallest) for fin in fins]),
            np.ascontiguousarray(table.reshape(-1, table.shape[-1])),
            np.stack([middle, half]),
            middle,
            half,
        )

    @cached_property
    def maximum(self) -> Array:
        """Largest force of each fin in any direction (n,) [N]."""
        return np.asarray(self.largest.max(axis=1))

    @cached_property
    def minimum(self) -> Array:
        """Largest force of each fin at rest (n,) [N]."""
        return np.asarray(self.smallest.max(axis=1))

    @cached_property
    def turns_fully(self) -> bool:
        """Whether every fin may point anywhere."""
        return bool((self.half >= np.pi).all())

    @cached_property
    def pushes_sideways(self) -> bool:
        """Whether any fin has a force along its shaft."""
        return bool(np.abs(self.table[:, SHAFT]).max() > 1e-9 * self.maximum.max())

    @cached_property
    def boundary_shares(self) -> Array | None:
        """How far the convex hulls of what the fins can push reach along `BOUNDARY` evenly spaced directions
        (n, RIM), as shares of their largest forces; None where all fins are the same all round."""
        count = self.largest.shape[1]
        if count == 1:
            return None
        along = self.domain[0][:, None] + self.domain[1][:, None] * np.linspace(-1.0, 1.0, count)
        sides = 2.0 * np.pi / BOUNDARY * np.arange(BOUNDARY)
        reach = (self.largest[..., None] * np.cos(along[..., None] - sides)).max(axis=1)
        return np.asarray(np.maximum(reach, 0.0) / self.maximum[:, None])

    @cached_property
    def _steps(self) -> Array:
        """Rows of the table, and how much is added to them up to the next ones (n * K * LEVELS, 2, 8)."""
        return np.stack([self.table, np.diff(self.table, axis=0, append=self.table[-1:])], axis=1)

    @cached_property
    def _all_round(self) -> Boundary:
        """The rim of fins that are the same all round."""
        largest, smallest = self.largest[:, 0], self.smallest[:, 0]
        first = np.arange(len(largest)) * LEVELS
        return Boundary(largest, smallest, largest - smallest + LEAST, 0.0, first, None)

    @cached_property
    def _grid(self) -> tuple[Array, Array, Array, NDArray[np.intp], Array, Array]:
        """First direction, gap between directions and what counts as just before the first (n,) [rad], first
        row of each fin (n,), and largest and smallest forces of all rows."""
        middle, half = self.domain
        count = self.largest.shape[1]
        gap = np.maximum(2.0 * half / max(count - 1, 1), LEAST)
        before = np.where(half < np.pi, 0.5 * gap, 0.0)  # a circle has nothing before its first direction
        first = np.arange(len(gap)) * count
        return middle - half, gap, before, first, self.largest.ravel(), self.smallest.ravel()

    def within(self, middle: Array, half: Array) -> Envelopes:
        """The same fins kept within arcs (n,) of force directions [rad]."""
        return replace(self, middle=middle, half=half)

    def without_rest(self) -> Envelopes:
        """The same fins, had they no smallest force."""
        return replace(self, smallest=np.zeros_like(self.smallest))

    def deflection(self, zero_direction: Array) -> Array:
        """By how much (n,) [rad] strong forces lean off zero directions (n,) [rad]."""
        boundary = self.boundary(zero_direction[None])
        deflection: Array = self.lookup(boundary, self.maximum[None])[0, :, DEFLECTION]
        return deflection

    def boundary(self, direction: Array) -> Boundary:
        """What the fins can do in directions (R, n) [rad]."""
        count = self.largest.shape[1]
        if count == 1:
            return self._all_round
        start, gap, before, first, largest, smallest = self._grid
        # Directions just before an arc belong to its start, not to its end.
        place = np.mod(direction - start + before, TURN)
        place = np.minimum(np.maximum((place - before) / gap, 0.0), count - 1)
        row = np.minimum(place.astype(np.intp), count - 2)
        part = place - row
        row += first
        low, high = largest.take(row), largest.take(row + 1)
        rest, rest_after = smallest.take(row), smallest.take(row + 1)
        rise = high - low
        most, least = low + part * rise, rest + part * (rest_after - rest)
        return Boundary(most, least, most - least + LEAST, rise / gap, row * LEVELS, part)

    def lookup(self, boundary: Boundary, size: Array) -> Array:
        """Rows (R, n, 8) of the tables for forces of sizes (R, n) [N] in the directions of a rim."""
        place = size - boundary.smallest
        place /= boundary.span
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

    def project(self, force: Array, size: Array) -> Projected:
        """What the fins can do near forces (R, 2, n) of sizes (R, n) [N], none of them zero."""
        unit = force / size[:, None]
        if self.turns_fully and self.largest.shape[1] == 1:
            boundary = self.boundary(size)
            held = np.minimum(np.maximum(size, boundary.smallest), boundary.largest)
            return Projected(unit, size, held, size, boundary, None)
        direction = np.arctan2(force[:, 1], force[:, 0])
        wanted, stopped = size, None
        if not self.turns_fully:
            offset = np.mod(direction - self.middle + np.pi, TURN) - np.pi
            held = np.minimum(np.maximum(offset, -self.half), self.half)
            excess = np.abs(offset - held)
            stopped = excess > 0.0
            wanted = np.where(excess < 0.5 * np.pi, size * np.cos(excess), 0.0)
            direction = self.middle + held
        asked, boundary = wanted, self.boundary(direction)
        over = wanted > boundary.largest
        if boundary.part is not None and over.any():
            # The nearest force on the rim lies where the rim is farther out.
            over = over if stopped is None else over & ~stopped
            curved = boundary.largest * wanted + boundary.hessian**2 + LEAST
            turn = (wanted - boundary.largest) * boundary.hessian / curved
            turn = np.where(over, np.clip(turn, -LONGEST_TURN, LONGEST_TURN), 0.0)
            direction = self._stopped(direction + turn)
            boundary = self.boundary(direction)
            wanted = np.where(over, boundary.largest, wanted)
        unit = np.stack([np.cos(direction), np.sin(direction)], axis=1)
        size = np.minimum(np.maximum(wanted, boundary.smallest), boundary.largest)
        return Projected(unit, direction, size, asked, boundary, stopped)

    def _stopped(self, direction: Array) -> Array:
        """Directions (R, n) [rad] brought within the arcs."""
        if self.turns_fully:
            return direction
        offset = np.mod(direction - self.middle + np.pi, TURN) - np.pi
        return np.asarray(self.middle + np.clip(offset, -self.half, self.half))


def largest_forces(layout: Layout) -> Array:
    """Returns the largest force (n,) [N] that each fin of a layout can give in any direction.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return layout_envelopes(layout, Objective()).maximum


def layout_envelopes(layout: Layout, objective: Objective) -> Envelopes:
    """Returns the compiled fins of a layout, by their own laws.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return _stacked(tuple(fin_envelope(fin.model, fin.limits, objective) for fin in layout.fins))


@lru_cache(maxsize=256)
def _stacked(fins: tuple[FinEnvelope, ...]) -> Envelopes:
    """Robots with the same compiled fins share the stack, wherever their fins are."""
    return Envelopes.of(list(fins))
