"""What each fin can push, as a convex set in its thrust plane, and how that adds up to a wrench.

A fin that may turn a full circle pushes anywhere within a disc whose radius is its largest thrust. A fin with
stops pushes within a sector of that disc. A sector wider than half a turn is not convex: here it stands for
its convex hull, the disc cut off along the chord between the stops, unless `pieces` has cut it in two sectors
that are convex. Every fin may rest: the tiny thrust that it cannot go below is left out.

Wrenches are scaled: torques are divided by `LEVER`, so that all six entries are in newton.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.thrust_law import thrust_laws
from finlab.layout import Layout, planar_effectiveness, stack_layouts

Array = NDArray[np.float64]

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""What a wrench is divided by, entry by entry."""
FULL_TURN = 2 * np.pi - 1e-6
"""Arc of zero directions [rad] from which a fin counts as able to point anywhere."""
MAX_PIECES = 32
"""Most combinations of convex pieces that are looked at one by one."""


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
        return np.einsum("rnck,rk->rnc", self.columns, normal)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, 6) of planar forces (R, n, 2) [N]."""
        return np.einsum("rnck,rnc->rk", self.columns, force)

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


def pieces(sets: FinSets) -> FinSets | None:
    """Returns convex robots whose union is exactly what one robot (R = 1) can push.

    Each fin whose sector is wider than half a turn but no full circle is cut in two along its middle; each
    combination of halves is one robot. None where that would be more than `MAX_PIECES`.
    """
    wide = np.flatnonzero((sets.half[0] > np.pi / 2) & (sets.half[0] < np.pi) & (sets.radius[0] > 0.0))
    if 2 ** len(wide) > MAX_PIECES:
        return None
    signs = np.array(list(product((-0.5, 0.5), repeat=len(wide)))).reshape(2 ** len(wide), len(wide))
    parts = sets.take(np.zeros(len(signs), dtype=np.intp))
    parts.middle[:, wide] += signs * sets.half[:, wide]
    parts.half[:, wide] *= 0.5
    return parts


def _wrapped(angle: Array) -> Array:
    """Angles [rad] within half a turn either way."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
