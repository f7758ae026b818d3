"""What forces of an actuator cost, for sets of forces within power budgets (Eq. 30).

The feasible forces of an actuator have one side or several: a thruster one ahead and one astern, a
pod with several arcs one for each. A side is a convex set whose forces are shares of its largest
ones; power grows with the share alone. Any force of any side may be taken, and mixtures of these,
so that several sides count with their convex hull, as `force_sets` has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.power_budget import PowerBudget
from finlab.arrays import Array
from finlab.core.ray_reach import WithinBudgets

LEAST_RIM = 1e-9
"""Share of the largest force below which an edge passes through the rest."""
WITHIN = 1e-6
"""Distance over the largest force up to which a force still counts as one of a side."""


@dataclass(frozen=True, eq=False)
class PowerCurve:
    """Power over the share of the largest forces: a power law, or knots with parabolas between."""

    watts: float
    """At the largest forces [W]."""
    exponent: float = 1.5
    """A share g takes `watts` g^exponent."""
    knots: Array | None = None
    """Shares, powers and the slopes of the power (K, 3) [1, W, W], in place of the power law. The
    slope is linear between knots, and does not fall."""

    @classmethod
    def of_slopes(cls, share: Array, slope: Array, least_watts: float) -> PowerCurve:
        """Returns the curve with slopes (K,) [W] that do not fall at shares (K,) [1] that rise, and
        a power at the first one [W]."""
        rise = 0.5 * (slope[1:] + slope[:-1]) * np.diff(share)
        watts = least_watts + np.append(0.0, np.cumsum(rise))
        return cls(float(watts[-1]), knots=np.stack([share, watts, slope], axis=-1))

    def at(self, share: Array) -> Array:
        """Returns the power (...) [W] of shares (...) [1]."""
        if self.knots is None:
            return np.asarray(self.watts * share**self.exponent)
        shares, watts, slopes = self.knots.T
        cell = np.clip(np.searchsorted(shares, share) - 1, 0, len(shares) - 2)
        further = share - shares[cell]
        bend = np.diff(slopes)[cell] / np.diff(shares)[cell]
        return np.asarray(watts[cell] + further * (slopes[cell] + 0.5 * bend * further))

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        if self.knots is not None:
            return {"knots": self.knots.tolist()}
        return {"watts": self.watts, "exponent": self.exponent}


@dataclass(frozen=True, eq=False)
class Side:
    """A convex set of forces of one actuator in its plane, and what they cost: shares of forces of
    a sector's arc, or of those of a polygon."""

    curve: PowerCurve
    """Power over the share."""
    radius: float
    """Largest force [N]."""
    center: float = 0.0
    """Middle of the arc of a sector [rad]."""
    half_angle: float = np.pi
    """Half of that arc [rad]; pi for a disc."""
    corners: Array | None = None
    """Corners (K, 2) [N] of a polygon, in place of the arc."""
    least_share: float = 0.0
    """Least share of the largest forces that is given [1]."""

    @property
    def least_watts(self) -> float:
        """The least power of any of its forces [W]."""
        return float(self.curve.at(np.array(self.least_share)))

    def watts(self, force: Array) -> Array:
        """Returns the power (R,) [W] of forces (R, 2) [N]; infinity of those that are not of the
        side."""
        share = np.linalg.norm(force, axis=-1) / self.radius
        beyond = share - 1.0
        if self.corners is None:
            turn = np.arctan2(force[:, 1], force[:, 0]) - self.center
            turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
            off_arc = np.maximum(np.abs(turn) - self.half_angle, 0.0)
            beyond = np.maximum(beyond, share * np.sin(np.minimum(off_arc, 0.5 * np.pi)))
        elif len(self.corners) == 1:
            across = force - (force @ self.corners[0])[:, None] * self.corners[0] / self.radius**2
            beyond = np.maximum(beyond, np.linalg.norm(across, axis=-1) / self.radius)
            beyond = np.maximum(beyond, -(force @ self.corners[0]) / self.radius**2)
        else:
            share, beyond = self._shares_of_polygon(force)
        watts = self.curve.at(np.clip(share, self.least_share, 1.0))
        return np.where(beyond <= WITHIN, watts, np.inf)

    def _shares_of_polygon(self, force: Array) -> tuple[Array, Array]:
        """The shares (R,) of forces (R, 2) by the gauge of a polygon that contains the rest, and
        how far they are outside of it, over the largest force."""
        assert self.corners is not None
        edge = np.roll(self.corners, -1, axis=0) - self.corners
        outward = np.stack([edge[:, 1], -edge[:, 0]], axis=-1)
        outward = outward / np.linalg.norm(outward, axis=-1, keepdims=True)
        offset = (outward * self.corners).sum(axis=-1)
        along = force @ outward.T
        # An edge through the rest, such as those of a sector, bounds no share.
        is_rim = offset > LEAST_RIM * self.radius
        if is_rim.any():
            share = (along[:, is_rim] / offset[is_rim]).max(axis=-1)
        else:  # flat: a line from the rest
            share = np.linalg.norm(force, axis=-1) / self.radius
        return share, (along - offset).max(axis=-1) / self.radius

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        shape: dict[str, Any] = {
            "radius_n": self.radius,
            "center_rad": self.center,
            "half_angle_rad": self.half_angle,
        }
        if self.corners is not None:
            shape = {"corners_n": self.corners.tolist()}
        return shape | {"least_share": self.least_share} | self.curve.to_dict()


Sides = tuple[Side, ...]
"""Sides of one set; none of an actuator that gives no force."""


class SideTable(NamedTuple):
    """Sides of many sets, as the core reads them."""

    tables: Array
    """Polygons and curves one behind the other."""
    sides: Array
    """Their numbers (S, 8), those of a set side by side."""
    begin: Array
    """Of each set the first of its sides, and how many it has (P, 2)."""
    least_watts: Array
    """The least power of each side (S,), or of those that follow it in its set [W]."""


def side_table(sets: Sequence[Sides]) -> SideTable:
    """Returns the sides of P sets."""
    tables = [np.zeros(1)]
    end = 1
    numbers: list[tuple[float, ...]] = []
    begin = np.zeros((len(sets), 2))
    least_watts: list[float] = []
    for place, sides in enumerate(sets):
        begin[place] = len(numbers), len(sides)
        of_sides = [side.least_watts for side in sides]
        least_watts += [min(of_sides[k:]) for k in range(len(sides))]
        for side in sides:
            offsets = []
            for table in (side.corners, side.curve.knots):
                if table is None:
                    offsets.append(0)
                    continue
                offsets.append(end)
                tables.append(np.append(float(len(table)), table))
                end += 1 + table.size
            polygon, curve = offsets
            shape = (polygon, side.radius, side.center, side.half_angle, side.least_share)
            numbers.append((*shape, side.curve.watts, side.curve.exponent, curve))
    return SideTable(
        tables=np.concatenate(tables),
        sides=np.array(numbers, np.float64).reshape(-1, 8),
        begin=begin,
        least_watts=np.array(least_watts),
    )


class PowerSets(NamedTuple):
    """What `ForceSets` know of the power of n actuators, and of their budgets."""

    within: WithinBudgets
    """Sides and budgets, as the core reads them."""
    bus: Array
    """The bus of each actuator (n,), -1 for none."""
    members: NDArray[np.bool_]
    """Which actuators (b, n) each bus feeds."""
    pieces: tuple[Array, ...]
    """Of each actuator the sides of its set, and of the parts of that: rows of `SideTable.begin`
    (1 + parts, 2)."""
    least_watts: Array
    """The least power of sides (S,) and of those behind them that are of the same set [W]."""

    def sides_of_parts(self, part: NDArray[np.intp]) -> Array:
        """Returns the sides (R, n, 2) of parts (R, n) of the actuators, 0 for the whole set."""
        columns = [of_actuator[part[:, i]] for i, of_actuator in enumerate(self.pieces)]
        return np.stack(columns, axis=1)

    def over_budget(self, sides: Array, is_working: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Returns which buses (R, b) have not enough for the least power of sets with some sides
        (R, n, 2), of those actuators (R, n) that work."""
        least = np.where(is_working, self._least_watts_of(sides), 0.0)
        is_over: NDArray[np.bool_] = least @ self.members.T > self.within.budget
        return is_over

    def _least_watts_of(self, sides: Array) -> Array:
        """The least power (R, n) [W] of sets with some sides (R, n, 2)."""
        begin = sides[..., 0].astype(np.intp)
        watts = np.append(self.least_watts, 0.0)[np.minimum(begin, len(self.least_watts))]
        return np.where(sides[..., 1] > 0.0, watts, 0.0)


def power_sets(sides: Sequence[Sequence[Sides]], budget: PowerBudget) -> PowerSets:
    """Returns the powers of n actuators within a budget.

    Args:
        sides: of each actuator those of its set, then those of each of its convex parts.
        budget: what buses may take.
    """
    table = side_table([of_piece for of_actuator in sides for of_piece in of_actuator])
    ends = np.cumsum([len(of_actuator) for of_actuator in sides])[:-1]
    watts = np.ascontiguousarray(budget.watts, np.float64)
    return PowerSets(
        within=WithinBudgets(table.tables, table.sides, watts),
        bus=np.where(budget.members.any(axis=0), budget.members.argmax(axis=0), -1.0),
        members=budget.members,
        pieces=tuple(np.split(table.begin, ends)),
        least_watts=table.least_watts,
    )
