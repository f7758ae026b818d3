"""What each fin can push, as a convex set in its thrust plane, and how that adds up to a wrench.

A fin that may turn a full circle pushes anywhere within a disc whose radius is its largest thrust. A fin with
stops pushes within a sector of that disc. A sector wider than half a turn is not convex: here it stands for
its convex hull, the disc cut off along the chord between the stops, unless `convex_parts` has cut it in two.
Where a fin pushes harder in some directions than in others, the disc is cut down to its convex hull, too.
Every fin may rest: the tiny thrust that it cannot go below is left out.

Wrenches are scaled: torques are divided by `LEVER`, so that all six entries are in newton.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.response import FinTable, fin_table
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN, wrapped
from finlab.layout.arrays import own_effectiveness

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""What a wrench is divided by, entry by entry."""
HALF_TURN_TOLERANCE = 1e-9
"""By how much half an arc [rad] may exceed a quarter turn and still be convex."""
BOUNDARY, POINTS = 48, 193
"""Sides of the polygon around what an uneven fin can push: at most a fifth of a percent too wide; and
directions in its arc that are looked at."""
MAX_CUT = 3
"""Most fins whose wide sectors are cut with both halves kept, which doubles the number of parts each time."""


class FinSets(NamedTuple):
    """R robots of n fins each, in m coordinates of a wrench. A fin with radius 0 is not there."""

    effectiveness: Array
    """Scaled wrench per newton (R, n, 2, m) of each fin's horizontal and vertical force."""
    radius: Array
    """Largest thrust (R, n) [N]."""
    middle: Array
    """Middle of the arc of zero directions (R, n) [rad]."""
    half: Array
    """Half of the arc (R, n) [rad]; pi for a full circle."""
    boundary: Array | None = None
    """How far the sets reach along M evenly spaced directions (R, n, M), the first at zero, as shares of the
    radius; None where every fin is the same all round."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> FinSets:
        """Returns some of the robots, in the order asked for, repeated where asked for twice."""
        known = FinSets(*(field[rows] for field in self[:4]))
        return known if self.boundary is None else known._replace(boundary=self.boundary[rows])

    def repeat(self, times: int) -> FinSets:
        """Returns each robot several times, side by side."""
        return self.take(np.repeat(np.arange(len(self.radius)), times))

    def tile(self, times: int) -> FinSets:
        """Returns all robots several times, one round after the other."""
        return self.take(np.tile(np.arange(len(self.radius)), times))

    def pull(self, normal: Array) -> Array:
        """Returns what each fin feels (R, n, 2) of the direction `normal` (R, m): the columns' dot
        products."""
        rows, n = self.radius.shape
        return (self.effectiveness.reshape(rows, 2 * n, -1) @ normal[..., None]).reshape(rows, n, 2)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, m) of planar forces (R, n, 2) [N]."""
        rows, n = self.radius.shape
        return (force.reshape(rows, 1, 2 * n) @ self.effectiveness.reshape(rows, 2 * n, -1))[:, 0]

    def farthest(self, normal: Array) -> tuple[Array, Array]:
        """Returns how far the sets reach along `normal` (R, m), and the planar forces (R, n, 2) that do it.

        The first, (R,), is the support function of the set of all wrenches: exact, or exact for the hull
        where a sector is wider than half a turn.
        """
        pull = self.pull(normal)
        size = np.sqrt((pull**2).sum(-1))
        angle = wrapped(np.arctan2(pull[..., 1], pull[..., 0]) - self.middle)
        held = np.clip(angle, -self.half, self.half)
        share = np.cos(angle - held)
        thrust = np.where(share > 1e-12, self.radius, 0.0)
        direction = self.middle + held
        reach = thrust * share
        if self.boundary is not None:
            support, inside = _along_boundary(self.boundary, self.middle + angle, direction)
            reach, thrust = np.minimum(reach, self.radius * support), thrust * inside
        force = thrust[..., None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
        return (reach * size).sum(-1), force

    def full_effectiveness(self) -> Array:
        """Returns the scaled wrenches (R, 2n, m) of each fin's largest thrust along both axes of its plane.

        A fin whose stops coincide has but one, and zeros for the other.
        """
        full = self.effectiveness * self.radius[..., None, None]
        fixed = self.half == 0.0
        if fixed.any():
            only = np.stack([np.cos(self.middle), np.sin(self.middle)], axis=-1)
            both = np.stack([(only[..., None] * full).sum(-2), np.zeros_like(full[..., 0, :])], axis=-2)
            full = np.where(fixed[..., None, None], both, full)
        rows, n = self.radius.shape
        return full.reshape(rows, 2 * n, -1)


def fin_sets(layout: Layout, failed: Collection[str] = ()) -> FinSets:
    """Returns what the fins of one robot can push; those called `failed` push nothing.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    layout.only_fins("what computes reach")
    lost = layout.indices(tuple(failed))
    fins = [fin_table(fin) for fin in layout.fins]
    radius = np.array([fin.largest for fin in fins])
    radius[list(lost)] = 0.0
    uneven = any(fin.gauge is not None for fin in fins)
    return FinSets(
        np.ascontiguousarray(own_effectiveness(layout)[None, :, 1:] / SCALE),
        radius[None],
        np.array([[fin.middle for fin in fins]]),
        np.array([[fin.half for fin in fins]]),
        np.array([[_boundary(fin) for fin in fins]]) if uneven else None,
    )


def _boundary(fin: FinTable) -> Array:
    """How far the convex hull of what a fin can push reaches along `BOUNDARY` evenly spaced directions
    (BOUNDARY,), as shares of its largest force."""
    angle = fin.middle + fin.half * np.linspace(-1.0, 1.0, POINTS)
    reach = np.ones(POINTS)
    if fin.gauge is not None:
        count, gauge = len(fin.gauge), np.append(fin.gauge, fin.gauge[0])
        reach = np.interp(angle % TURN, TURN / count * np.arange(count + 1), gauge)
    sides = TURN / BOUNDARY * np.arange(BOUNDARY)
    ahead = (reach[:, None] * np.cos(angle[:, None] - sides)).max(axis=0)
    return np.asarray(np.maximum(ahead, 0.0) * fin.table.largest / fin.largest)


def _along_boundary(boundary: Array, pull: Array, direction: Array) -> tuple[Array, Array]:
    """How far (R, n) sets with rims (R, n, M) reach along the directions `pull` (R, n) [rad], and how far out
    along `direction` (R, n) they end, both as shares of the radius."""
    count = boundary.shape[-1]
    gap = 2.0 * np.pi / count
    place = np.mod(pull, 2.0 * np.pi) / gap
    before = np.minimum(place.astype(np.intp), count - 1)
    here = np.take_along_axis(boundary, before[..., None], axis=-1)[..., 0]
    after = np.take_along_axis(boundary, (before[..., None] + 1) % count, axis=-1)[..., 0]
    # The corner between two sides of the polygon.
    part = (place - before) * gap
    support = (here * np.sin(gap - part) + after * np.sin(part)) / np.sin(gap)
    deflection = np.cos(direction[..., None] - np.arange(count) * gap)
    ends = np.where(deflection > 0.1, boundary / np.where(deflection > 0.1, deflection, 1.0), np.inf)
    return support, np.minimum(ends.min(-1), 1.0)


def wide_fins(sets: FinSets) -> NDArray[np.intp]:
    """Returns the places of working fins whose sets are not convex: wider than half a turn, no full
    circle."""
    alive = (sets.radius > 0.0).any(axis=0)
    half = sets.half[0]
    return np.flatnonzero((half > np.pi / 2 + HALF_TURN_TOLERANCE) & (half < np.pi) & alive)


def convex_parts(sets: FinSets) -> FinSets:
    """Returns convex sets of R robots with the same arcs, P of each, one round of robots after the other.

    Wide sectors are cut along their middle. Of the first `MAX_CUT` of them both halves are kept, in all
    combinations: their union is exactly what each robot can push. Further ones stay what they are, with
    their hulls.
    """
    cut = wide_fins(sets)[:MAX_CUT]
    signs = np.zeros((2 ** len(cut), 1, sets.radius.shape[1]))
    signs[:, 0, cut] = list(product((-0.5, 0.5), repeat=len(cut)))
    signs = np.repeat(signs, len(sets.radius), axis=1)
    signs = signs.reshape(-1, signs.shape[-1])
    parts = sets.tile(2 ** len(cut))
    return parts._replace(
        middle=parts.middle + signs * parts.half, half=np.where(signs == 0.0, 1.0, 0.5) * parts.half
    )
