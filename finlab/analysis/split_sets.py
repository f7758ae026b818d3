"""Sets of forces of any star shape, as convex parts below one convex cover, and the largest share
of a wrench that they can hold, by branch and bound.

A pod with forbidden sectors or with losses behind a skeg has no convex set of forces. Its `cover`
is convex and contains the set; its `parts` are convex and make it up. A search first takes the
covers of all actuators. Where its forces lie within parts, that is the answer; else one actuator
outside of its set is replaced by each of its parts in turn. Every leaf of that tree ends with a
price, which proves how much no forces of the leaf can exceed: together they are a certificate,
which `refusal_check.py` verifies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.force_pieces import Piece, PieceTable
from finlab.arrays import Array
from finlab.forces.force_sets import Shape, is_wide
from finlab.forces.reach import FINE

SAME_SHARE = 1e-9
"""Share by which a leaf has to promise more than what is held already to be searched on [1]."""


class SplitSet(NamedTuple):
    """Feasible forces of one actuator."""

    name: str
    effectiveness: Array
    """Wrench (2, 6) of 1 N along both axes of its plane [1, m], body frame."""
    cover: Piece
    """A convex set that contains all forces."""
    parts: tuple[Piece, ...] = ()
    """Convex sets that make up all forces; none where these are the cover."""

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        return {
            "name": self.name,
            "wrench_per_newton": self.effectiveness.tolist(),
            "cover": self.cover.to_dict(),
            "parts": [part.to_dict() for part in self.parts],
        }


def split_set(name: str, effectiveness: Array, shape: Shape) -> SplitSet:
    """Returns the set of an actuator by its shape; an arc wider than half a turn has two parts, and
    one with several arcs a part for each.

    Args:
        name: of the actuator.
        effectiveness: wrench (3, 6) of 1 N along its own axes [1, m], body frame.
        shape: its feasible forces.
    """
    in_plane = shape.directions @ effectiveness
    if shape.polygons:
        pieces = [Piece(shape.radius, corners=_counterclockwise(c)) for c in shape.polygons]
        return SplitSet(name, in_plane, pieces[0], tuple(pieces[1:]))
    whole = Piece(shape.radius, shape.sector_center, shape.sector_half_angle)
    if not is_wide(whole.half_angle):
        return SplitSet(name, in_plane, whole)
    quarter = 0.5 * whole.half_angle
    upper = Piece(whole.radius, whole.center + quarter, quarter)
    lower = Piece(whole.radius, whole.center - quarter, quarter)
    return SplitSet(name, in_plane, whole, (upper, lower))


def _counterclockwise(corners: Array) -> Array:
    """Corners (K, 2) of a convex polygon in this order."""
    ahead = np.roll(corners, -1, axis=0)
    area = (corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0]).sum()
    return corners if area >= 0.0 else corners[::-1].copy()


class Leaf(NamedTuple):
    """A leaf of the search for one wrench: sets that are searched no further, and the price that
    bounds what they can hold."""

    parts: dict[str, int]
    """Which part of an actuator, by its name; the cover of all others."""
    price: Array
    """Price (6,) of the axes of a wrench [1/N, 1/(N m)]."""


class Shares(NamedTuple):
    """Largest shares of Q wrenches that actuators can hold."""

    share: Array
    """The shares (Q,), never too small; infinite for no wrench."""
    leaves: tuple[tuple[Leaf, ...], ...]
    """Of each wrench the leaves of its search, whose prices prove it."""


class _Row(NamedTuple):
    """One node of the tree of one question."""

    question: int
    choice: tuple[int, ...]
    """0 for the cover of an actuator, k for its part k - 1."""


def largest_shares(sets: Sequence[SplitSet], target: Array, factor: Array) -> Shares:
    """Returns the largest shares of wrenches that can be held with nothing besides.

    Args:
        sets: feasible forces of n actuators.
        target: wrenches (Q, 6) [N, N m]; axes on which all are zero and that no actuator may push
            are to be zero in `effectiveness`, too.
        factor: share (Q, n) of each actuator's forces that is left for each wrench [1].

    Returns:
        The shares, exact to about 1e-8, and their proofs.
    """
    if not sets:
        # Nothing is held, as any price of the wrench itself proves.
        is_asked = (target != 0.0).any(axis=-1)
        alone = [
            (Leaf({}, wrench),) if asked else ()
            for wrench, asked in zip(target, is_asked, strict=True)
        ]
        return Shares(np.where(is_asked, 0.0, np.inf), tuple(alone))
    search = _Search(sets, target, factor)
    asked = np.flatnonzero(search.length > 0.0)
    best = np.zeros(len(target))
    upper = np.where(search.length > 0.0, 0.0, np.inf)
    leaves: list[list[Leaf]] = [[] for _ in target]
    rows = [_Row(int(q), (0,) * len(sets)) for q in asked]
    while rows:
        share, price, force = search.solve(rows)
        outside = search.outside(rows, force)
        question = np.array([row.question for row in rows])
        # What forces within the sets hold is held, whatever the other leaves promise.
        np.maximum.at(best, question, np.where(outside < 0, share, 0.0))
        is_open = (outside >= 0) & (share > best[question] * (1.0 + SAME_SHARE))
        children = []
        for k, row in enumerate(rows):
            if is_open[k]:
                children.extend(search.split(row, int(outside[k])))
                continue
            leaves[row.question].append(Leaf(search.parts_of(row), price[k]))
            upper[row.question] = max(upper[row.question], float(share[k]))
        rows = children
    return Shares(upper, tuple(tuple(of_one) for of_one in leaves))


class _Search:
    """Sets of actuators as the core reads them, with which rows of the search are solved."""

    def __init__(self, sets: Sequence[SplitSet], target: Array, factor: Array) -> None:
        self._sets = sets
        self._factor = factor
        self._effectiveness = np.array([each.effectiveness for each in sets])
        # Torques over the longest lever, so that all axes are of one size, whatever the robot's.
        lever = max(float(np.abs(self._effectiveness[..., 3:]).max(initial=0.0)), 1e-9)
        self._scale = np.array([1.0, 1.0, 1.0, lever, lever, lever])
        scaled = target / self._scale
        self.length = np.linalg.norm(scaled, axis=-1)
        nonzero = np.where(self.length > 0.0, self.length, 1.0)
        self._ray = scaled / nonzero[:, None]
        self._pieces = [(each.cover, *each.parts) for each in sets]
        self._table = PieceTable(self._pieces)

    def solve(self, rows: Sequence[_Row]) -> tuple[Array, Array, Array]:
        """Returns shares (R,), prices (R, 6) and planar forces (R, n, 2) [N] of rows."""
        question = np.array([row.question for row in rows])
        choice = np.array([row.choice for row in rows])
        factor = self._factor[question][..., None, None]
        sets = self._table.sets(choice, factor * self._effectiveness / self._scale)
        ray = self._ray[question]
        size, normal, force = sets.reach(np.zeros_like(ray), ray, FINE)
        missed = np.flatnonzero(np.isneginf(size))
        if len(missed):
            # Actuators that cannot stop: the ray misses all wrenches. One from among these to the
            # target ends before it, and the plane there parts them.
            of_missed = sets.take(missed)
            inside = of_missed.wrench(self._table.middles(choice[missed]))
            target = ray[missed] * self.length[question[missed], None]
            normal[missed] = of_missed.reach(inside, target - inside, FINE)[1]
        share = np.maximum(size, 0.0) / self.length[question]
        # A price of a unit norm: only its direction counts.
        norm = np.linalg.norm(normal, axis=-1, keepdims=True)
        price = normal / np.where(norm > 0.0, norm, 1.0) / self._scale
        return share, price, force

    def outside(self, rows: Sequence[_Row], force: Array) -> NDArray[np.intp]:
        """Returns for each row (R,) an actuator whose force (R, n, 2) is in its cover, but in none
        of its parts; -1 where there is none."""
        choice = np.array([row.choice for row in rows])
        found = np.full(len(rows), -1)
        largest = np.zeros(len(rows))
        for i, pieces in enumerate(self._pieces):
            if len(pieces) == 1:
                continue
            within = choice[:, i] > 0
            for part in pieces[1:]:
                within |= part.contains(force[:, i])
            size = np.linalg.norm(force[:, i], axis=-1)
            is_worse = ~within & (size > largest)
            found[is_worse] = i
            largest[is_worse] = size[is_worse]
        return found

    def split(self, row: _Row, actuator: int) -> list[_Row]:
        """Returns a row for each part of an actuator."""
        children = []
        for part in range(1, len(self._pieces[actuator])):
            choice = list(row.choice)
            choice[actuator] = part
            children.append(_Row(row.question, tuple(choice)))
        return children

    def parts_of(self, row: _Row) -> dict[str, int]:
        """Returns which parts a row has, by the actuators' names."""
        chosen = zip(self._sets, row.choice, strict=True)
        return {each.name: part - 1 for each, part in chosen if part > 0}
