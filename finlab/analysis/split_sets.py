"""Sets of forces of any star shape, as convex parts below one convex cover, and the largest share
of a wrench that they can hold, by branch and bound.

A pod with forbidden sectors or with losses behind a skeg has no convex set of forces. Its `cover`
is convex and contains the set; its `parts` are convex and make it up. A search first takes the
covers of all actuators. Where its forces lie within parts, that is the answer; else one actuator
outside of its set is replaced by each of its parts in turn. Every leaf of that tree ends with a
price, which proves how much no forces of the leaf can exceed: together they are a certificate,
which `refusal_check.py` verifies.

Within power budgets a piece has sides, whose forces have a power (`Side`). Where a cover takes less
power for its forces than the parts do, it is replaced by these as well. Then a leaf has a price of
the power of each bus beside that of the axes (Eq. 30).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.power_budget import PowerBudget
from finlab.arrays import Array
from finlab.core.ray_reach import block_of_planes
from finlab.forces.force_sets import ForceSets, Shape, is_wide
from finlab.forces.power_sides import PowerSets, Sides, power_sets
from finlab.forces.reach import FINE

INSIDE = 1e-7
"""Distance by which a force may be outside of a part and still count as within, over the largest
force of its actuator [1]."""
SAME_POWER = 1e-7
"""Share of its budget by which a bus may take more with the parts of its actuators than with their
covers, and still have enough [1]."""
SAME_SHARE = 1e-9
"""Share by which a leaf has to promise more than what is held already to be searched on [1]."""


class Piece(NamedTuple):
    """A convex set of forces of one actuator in its plane: a sector of a disc, or its hull, or a
    polygon."""

    radius: float
    """Largest force [N]."""
    center: float = 0.0
    """Middle of the arc of a sector [rad]."""
    half_angle: float = np.pi
    """Half of that arc [rad]; pi for a disc."""
    corners: Array | None = None
    """Corners (K, 2) [N] of a polygon, in place of the arc."""
    sides: Sides = ()
    """What its forces cost; none where no power budget counts."""

    @property
    def middle(self) -> Array:
        """A force (2,) [N] of the set: the middle of a polygon, and none of a sector."""
        return np.zeros(2) if self.corners is None else self.corners.mean(axis=0)

    def contains(self, force: Array) -> NDArray[np.bool_]:
        """Returns whether forces (R, 2) [N] are within the set, but for `INSIDE`."""
        margin = INSIDE * self.radius
        if self.corners is not None:
            edge = np.roll(self.corners, -1, axis=0) - self.corners
            length = np.linalg.norm(edge, axis=-1)
            offset = force[:, None, :] - self.corners
            # Counterclockwise corners: the inside is to the left of each edge.
            left = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]
            within: NDArray[np.bool_] = (left >= -margin * length).all(axis=-1)
            return within
        size = np.linalg.norm(force, axis=-1)
        angle = np.arctan2(force[:, 1], force[:, 0])
        turn = (angle - self.center + np.pi) % (2.0 * np.pi) - np.pi
        # Beyond the ends of the arc, the distance to the nearer radius counts.
        beyond = np.maximum(np.abs(turn) - self.half_angle, 0.0)
        distance = size * np.sin(np.minimum(beyond, 0.5 * np.pi))
        is_within: NDArray[np.bool_] = (size <= self.radius + margin) & (distance <= margin)
        return is_within

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        if self.sides:
            return {"sides": [side.to_dict() for side in self.sides]}
        if self.corners is not None:
            return {"corners_n": self.corners.tolist()}
        return {
            "radius_n": self.radius,
            "center_rad": self.center,
            "half_angle_rad": self.half_angle,
        }


class SplitSet(NamedTuple):
    """Feasible forces of one actuator."""

    name: str
    effectiveness: Array
    """Wrench (2, 6) of 1 N along both axes of its plane [1, m], body frame."""
    cover: Piece
    """A convex set that contains all forces."""
    parts: tuple[Piece, ...] = ()
    """Convex sets that make up all forces; none where these are the cover."""
    bus: str | None = None
    """Name of the bus whose power budget counts; None for no limit."""

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        return {
            "name": self.name,
            "wrench_per_newton": self.effectiveness.tolist(),
            "cover": self.cover.to_dict(),
            "parts": [part.to_dict() for part in self.parts],
            "bus": self.bus,
        }


def split_set(
    name: str,
    effectiveness: Array,
    shape: Shape,
    sides: Sequence[Sides] = (),
    bus: str | None = None,
) -> SplitSet:
    """Returns the set of an actuator by its shape; an arc wider than half a turn has two parts, and
    one with several arcs a part for each.

    Args:
        name: of the actuator.
        effectiveness: wrench (3, 6) of 1 N along its own axes [1, m], body frame.
        shape: its feasible forces.
        sides: what they cost, of the set and of each of its parts; none without a power budget.
        bus: name of the bus that feeds it, where that has one.
    """
    cover, *parts = _pieces(shape)
    if sides:
        cover = cover._replace(sides=sides[0])
        parts = [part._replace(sides=own) for part, own in zip(parts, sides[1:], strict=True)]
    return SplitSet(name, shape.directions @ effectiveness, cover, tuple(parts), bus)


def _pieces(shape: Shape) -> list[Piece]:
    """The cover of a shape, and its parts."""
    if shape.polygons:
        return [Piece(shape.radius, corners=_counterclockwise(c)) for c in shape.polygons]
    whole = Piece(shape.radius, shape.sector_center, shape.sector_half_angle)
    if not is_wide(whole.half_angle):
        return [whole]
    quarter = 0.5 * whole.half_angle
    upper = Piece(whole.radius, whole.center + quarter, quarter)
    lower = Piece(whole.radius, whole.center - quarter, quarter)
    return [whole, upper, lower]


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
    watt_prices: dict[str, float] = {}
    """Price of the power of each bus, by its name [1/W]; none without budgets."""


class Shares(NamedTuple):
    """Largest shares of Q wrenches that actuators can hold."""

    share: Array
    """The shares (Q,), never too small; infinite for no wrench."""
    leaves: tuple[tuple[Leaf, ...], ...]
    """Of each wrench the leaves of its search, whose prices prove it."""
    budget_worth: Array
    """What the budgets (Q, b) are worth of all that bounds each share, 0 to 1 [1]; 0 of one that
    does not bind."""


class _Row(NamedTuple):
    """One node of the tree of one question."""

    question: int
    choice: tuple[int, ...]
    """0 for the cover of an actuator, k for its part k - 1."""


@dataclass(frozen=True)
class _Answers:
    """What is found of R rows."""

    share: Array
    """(R,)."""
    price: Array
    """(R, 6)."""
    force: Array
    """(R, n, 2) [N]."""
    watt_price: Array
    """(R, b) [1/W]."""
    budget_worth: Array
    """(R, b) [1]."""


def largest_shares(
    sets: Sequence[SplitSet],
    target: Array,
    factor: Array,
    watts_of_buses: Mapping[str, float] | None = None,
) -> Shares:
    """Returns the largest shares of wrenches that can be held with nothing besides.

    Args:
        sets: feasible forces of n actuators.
        target: wrenches (Q, 6) [N, N m]; axes on which all are zero and that no actuator may push
            are to be zero in `effectiveness`, too.
        factor: share (Q, n) of each actuator's forces that is left for each wrench [1]; the power
            stays that of all.
        watts_of_buses: the power budgets of b buses by their names [W]; None without any.

    Returns:
        The shares, exact to about 1e-8, and their proofs.
    """
    watts = dict(watts_of_buses or {})
    if not sets:
        # Nothing is held, as any price of the wrench itself proves.
        is_asked = (target != 0.0).any(axis=-1)
        alone = [
            (Leaf({}, wrench),) if asked else ()
            for wrench, asked in zip(target, is_asked, strict=True)
        ]
        no_budget = np.zeros((len(target), len(watts)))
        return Shares(np.where(is_asked, 0.0, np.inf), tuple(alone), no_budget)
    search = _Search(sets, target, factor, watts)
    asked = np.flatnonzero(search.length > 0.0)
    best = np.zeros(len(target))
    upper = np.where(search.length > 0.0, 0.0, np.inf)
    leaves: list[list[Leaf]] = [[] for _ in target]
    budget_worth = np.zeros((len(target), len(watts)))
    rows = [_Row(int(q), (0,) * len(sets)) for q in asked]
    while rows:
        found = search.solve(rows)
        share = found.share
        outside = search.outside(rows, found.force)
        question = np.array([row.question for row in rows])
        # What forces within the sets hold is held, whatever the other leaves promise.
        np.maximum.at(best, question, np.where(outside < 0, share, 0.0))
        is_open = (outside >= 0) & (share > best[question] * (1.0 + SAME_SHARE))
        children = []
        for k, row in enumerate(rows):
            if is_open[k]:
                children.extend(search.split(row, int(outside[k])))
                continue
            watt_prices = dict(zip(watts, found.watt_price[k].tolist(), strict=True))
            leaf = Leaf(search.parts_of(row), found.price[k], watt_prices)
            leaves[row.question].append(leaf)
            if share[k] >= upper[row.question]:
                upper[row.question] = float(share[k])
                budget_worth[row.question] = found.budget_worth[k]
        rows = children
    return Shares(upper, tuple(tuple(of_one) for of_one in leaves), budget_worth)


class _Search:
    """Sets of actuators as the core reads them, with which rows of the search are solved."""

    def __init__(
        self,
        sets: Sequence[SplitSet],
        target: Array,
        factor: Array,
        watts_of_buses: Mapping[str, float],
    ) -> None:
        self._sets = sets
        self._powers = _powers(sets, watts_of_buses)
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
        self._begin = np.cumsum([0, *(len(pieces) for pieces in self._pieces)])[:-1]
        self._offset, self._block = _polygon_block(self._pieces)
        flat = [piece for pieces in self._pieces for piece in pieces]
        self._radius = np.array([piece.radius for piece in flat])
        self._center = np.array([piece.center for piece in flat])
        self._middle = np.array([piece.middle for piece in flat])
        self._half_angle = np.array(
            [piece.half_angle if piece.corners is None else 0.0 for piece in flat]
        )

    def solve(self, rows: Sequence[_Row]) -> _Answers:
        """Returns shares, prices and planar forces of rows."""
        question = np.array([row.question for row in rows])
        piece = self._begin + np.array([row.choice for row in rows])
        factor = self._factor[question][..., None, None]
        sets = ForceSets(
            effectiveness=factor * self._effectiveness / self._scale,
            radius=self._radius[piece],
            sector_center=self._center[piece],
            sector_half_angle=self._half_angle[piece],
            n_parts=np.ones_like(piece),
            polygon_offset=self._offset[piece],
            block=self._block,
        )
        ray = self._ray[question]
        length = self.length[question]
        if self._powers is not None:
            return self._solve_within(sets, self._powers, piece, ray, length)
        size, normal, force = sets.reach(np.zeros_like(ray), ray, FINE)
        missed = np.flatnonzero(np.isneginf(size))
        if len(missed):
            # Actuators that cannot stop: the ray misses all wrenches. One from among these to the
            # target ends before it, and the plane there parts them.
            of_missed = sets.take(missed)
            inside = of_missed.wrench(self._middle[piece[missed]])
            target = ray[missed] * length[missed, None]
            normal[missed] = of_missed.reach(inside, target - inside, FINE)[1]
        nothing = np.zeros((len(rows), 0))
        return self._answers(size, length, normal, force, nothing, nothing)

    def _solve_within(
        self, sets: ForceSets, powers: PowerSets, piece: NDArray[np.intp], ray: Array, length: Array
    ) -> _Answers:
        """What `solve` returns, within power budgets; `piece` (R, n) are the pieces of the rows, in
        the order of all."""
        sides = np.concatenate(powers.pieces)[piece]
        within = sets._replace(sides=sides, powers=powers)
        size, normal, force, multiplier = within.reach_within(np.zeros_like(ray), ray, FINE)
        missed = np.flatnonzero(np.isneginf(size))
        if len(missed):
            of_missed = within.take(missed)
            # From the forces of least power, as in `solve`.
            rest = np.zeros_like(ray[missed])
            _, _, least_forces, _ = of_missed.reach_within(rest, rest, np.inf)
            inside = of_missed.wrench(least_forces)
            target = ray[missed] * length[missed, None]
            _, normal[missed], _, multiplier[missed] = of_missed.reach_within(
                inside, target - inside, FINE
            )
            # Actuators that take more than a budget at rest refuse every wrench by its price alone.
            over = powers.over_budget(sides[missed], of_missed.radius > 0.0)
            is_over = over.any(axis=-1)
            normal[missed[is_over]] = 0.0
            multiplier[missed[is_over]] = over[is_over]
        asked = np.maximum(size, 0.0) * (normal * ray).sum(axis=-1)
        worth = multiplier * powers.within.budget / np.where(asked > 0.0, asked, np.inf)[:, None]
        return self._answers(size, length, normal, force, multiplier, np.minimum(worth, 1.0))

    def _answers(
        self,
        size: Array,
        length: Array,
        normal: Array,
        force: Array,
        multiplier: Array,
        budget_worth: Array,
    ) -> _Answers:
        """Answers by the scaled lengths of rays (R,) and their planes."""
        # A price of a unit norm: only its direction counts.
        norm = np.linalg.norm(normal, axis=-1, keepdims=True)
        unit = np.where(norm > 0.0, norm, 1.0)
        return _Answers(
            share=np.maximum(size, 0.0) / length,
            price=normal / unit / self._scale,
            force=force,
            watt_price=multiplier / unit,
            budget_worth=budget_worth,
        )

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
        if self._powers is not None:
            self._find_dearer(choice, force, self._powers, found)
        return found

    def _find_dearer(
        self, choice: NDArray[np.intp], force: Array, powers: PowerSets, found: NDArray[np.intp]
    ) -> None:
        """Puts into `found` (R,), where no actuator is outside of its parts, the one that takes
        most of a bus that has not enough for the forces (R, n, 2) by the parts of all, if its cover
        was taken."""
        watts = np.zeros(choice.shape)
        is_free = np.zeros(choice.shape, bool)
        for i, pieces in enumerate(self._pieces):
            is_free[:, i] = (choice[:, i] == 0) & (len(pieces) > 1)
            for k in range(len(pieces)):
                rows = np.flatnonzero((found < 0) & (choice[:, i] == k))
                watts[rows, i] = _watts(pieces, k, force[rows, i])
        budget = powers.within.budget * (1.0 + SAME_POWER)
        is_short = (watts @ powers.members.T > budget) @ powers.members
        dearest = np.where(is_short & is_free, watts, -1.0)
        most = dearest.argmax(axis=1)
        is_dearer = (found < 0) & (dearest.max(axis=1) > 0.0)
        found[is_dearer] = most[is_dearer]

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


def _powers(sets: Sequence[SplitSet], watts_of_buses: Mapping[str, float]) -> PowerSets | None:
    """Powers and budgets of actuators; None without budgets."""
    if not watts_of_buses:
        return None
    names = tuple(watts_of_buses)
    members = np.array([[each.bus == name for each in sets] for name in names])
    budget = PowerBudget(names, members, np.array(list(watts_of_buses.values())))
    sides = [[piece.sides for piece in (each.cover, *each.parts)] for each in sets]
    return power_sets(sides, budget)


def _watts(pieces: Sequence[Piece], chosen: int, force: Array) -> Array:
    """Power (R,) [W] of forces (R, 2) [N] of a part; of a cover, that of the parts in which they
    are, where it has some."""
    candidates = [pieces[chosen]] if chosen > 0 or len(pieces) == 1 else pieces[1:]
    least = np.full(len(force), np.inf)
    for piece in candidates:
        for side in piece.sides:
            least = np.minimum(least, side.watts(force))
    return np.where(np.isfinite(least), least, 0.0)


def _polygon_block(pieces_of: Sequence[Sequence[Piece]]) -> tuple[Array, Array]:
    """Offsets of the polygons of all pieces, 0 for sectors, and the block that holds them."""
    tables = [block_of_planes(len(pieces_of))]
    end_of_block = len(tables[0])
    offsets = []
    for pieces in pieces_of:
        for piece in pieces:
            if piece.corners is None:
                offsets.append(0.0)
                continue
            offsets.append(float(end_of_block))
            # A polygon in the block: the number of its corners, then their coordinates.
            tables.append(np.array([float(len(piece.corners))]))
            tables.append(piece.corners.ravel())
            end_of_block += 1 + piece.corners.size
    return np.array(offsets), np.concatenate(tables)
