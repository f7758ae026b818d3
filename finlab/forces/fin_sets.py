"""What each fin can push, as a convex set in its thrust plane, and how that adds up to a wrench.

A fin that may turn a full circle pushes anywhere within a disc whose radius is its largest thrust. A fin with
stops pushes within a sector of that disc. A sector wider than half a turn is not convex: here it stands for
its convex hull, the disc cut off along the chord between the stops, unless `convex_parts` has cut it
in two sectors that are convex. Every fin may rest: the tiny thrust that it cannot go below is left out.

Wrenches are scaled: torques are divided by `LEVER`, so that all six entries are in newton.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.forces.thrust_law import thrust_laws
from finlab.layout import Layout, planar_effectiveness, stack_layouts

Array = NDArray[np.float64]

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""What a wrench is divided by, entry by entry."""
FULL_TURN = 2 * np.pi - 1e-6
"""Arc of zero directions [rad] from which a fin counts as able to point anywhere."""
MAX_PIECES = 8
"""Most combinations of convex pieces that are looked at one by one, unless less is asked for."""


class FinSets(NamedTuple):
    """R robots of n fins each. A fin with radius 0 is not there."""

    columns: Array
    """Scaled wrench per newton (R, n, 2, 6) of each fin's horizontal and vertical force."""
    radius: Array
    """Largest thrust (R, n) [N]."""
    middle: Array
    """Middle of the arc of zero directions (R, n) [rad]."""
    half: Array
    """Half of the arc (R, n) [rad]; pi for a full circle."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> FinSets:
        """Returns some of the robots, in the order asked for, repeated where asked for twice."""
        return FinSets(*(field[rows] for field in self))

    def pull(self, normal: Array) -> Array:
        """Returns what each fin feels (R, n, 2) of the direction `normal` (R, 6): the columns' dot
        products."""
        rows, n = self.radius.shape
        return (self.columns.reshape(rows, 2 * n, 6) @ normal[..., None]).reshape(rows, n, 2)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, 6) of planar forces (R, n, 2) [N]."""
        rows, n = self.radius.shape
        return (force.reshape(rows, 1, 2 * n) @ self.columns.reshape(rows, 2 * n, 6))[:, 0]

    def farthest(self, normal: Array) -> tuple[Array, Array]:
        """Returns how far the sets reach along `normal` (R, 6), and the planar forces (R, n, 2) that do it.

        The first, (R,), is the support function of the set of all wrenches: exact, or exact for the hull
        where a sector is wider than half a turn.
        """
        pull = self.pull(normal)
        size = np.sqrt((pull**2).sum(-1))
        angle = _wrapped(np.arctan2(pull[..., 1], pull[..., 0]) - self.middle)
        held = np.clip(angle, -self.half, self.half)
        share = np.cos(angle - held)
        thrust = np.where(share > 1e-12, self.radius, 0.0)
        direction = self.middle + held
        force = thrust[..., None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
        return (thrust * size * share).sum(-1), force


def fin_sets(layouts: Sequence[Layout], failed: Collection[str] = ()) -> FinSets:
    """Returns what the fins of layouts can push; those called `failed` push nothing. Padded to one width."""
    arrays = stack_layouts(layouts)
    blocks = planar_effectiveness(arrays.position, arrays.mounting_angle)  # (R, n, 6, 2)
    radius = np.zeros(arrays.mask.shape)
    for row, layout in enumerate(layouts):
        for i, (name, law) in enumerate(zip(layout.names, thrust_laws(layout), strict=True)):
            radius[row, i] = 0.0 if name in failed else law.maximum
    arc = arrays.upper[..., 2] - arrays.lower[..., 2]
    return FinSets(
        np.ascontiguousarray(np.swapaxes(blocks / SCALE[:, None], -1, -2)),
        radius,
        0.5 * (arrays.upper[..., 2] + arrays.lower[..., 2]),
        np.where(arc >= FULL_TURN, np.pi, 0.5 * arc),
    )


def convex_parts(sets: FinSets, most: int = MAX_PIECES) -> list[FinSets]:
    """Returns sets of the same robots, all convex, whose union is exactly what each robot can push.

    Each fin whose sector is wider than half a turn but no full circle is cut in two along its middle; each
    combination of halves is one of the sets. All robots have the same arcs. Where there would be more than
    `most`, the sets are returned as they are, with the convex hulls of what is not convex.
    """
    wide = wide_fins(sets)
    if 2 ** len(wide) > most:
        return [sets]
    cut = []
    for signs in product((-0.5, 0.5), repeat=len(wide)):
        part = sets._replace(middle=sets.middle.copy(), half=sets.half.copy())
        part.middle[:, wide] += np.array(signs) * sets.half[:, wide]
        part.half[:, wide] *= 0.5
        cut.append(part)
    return cut


def wide_fins(sets: FinSets) -> NDArray[np.intp]:
    """Returns the places of working fins whose sets are not convex: wider than half a turn, no full
    circle."""
    alive = (sets.radius > 0.0).any(axis=0)
    return np.flatnonzero((sets.half[0] > np.pi / 2) & (sets.half[0] < np.pi) & alive)


def joined(parts: Sequence[FinSets]) -> FinSets:
    """Returns the robots of several sets as one, in order."""
    return FinSets(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))


def _wrapped(angle: Array) -> Array:
    """Angles [rad] within half a turn either way."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
