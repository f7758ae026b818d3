"""The answer of one actuator to a price: the force that is worth its watts, as a table over the
price.

An actuator that is paid `v` [W/N] for its force along a direction gives the force `T(v)` that
maximizes `v T - c(T)`, with `c` its power. `T` rises with the price; its integral is the conjugate
`c*`. Both are kept as piecewise polynomials on prices that are dense near zero, so that `T =
dc*/dv` to rounding whatever the law is, and powers `T ~ v^2` (cost `~ T^1.5`) are exact. A cost
that is not convex is replaced by its convex hull, at which `T` has a steep place.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from finlab.arrays import NOTHING, Array

CELLS = 1024
"""Intervals of price of a table; their ends are `top (j / CELLS)^4`."""

POINTS = 512
"""Directions around a circle, and sizes of a force, for which a fin is asked."""


_GRID = np.linspace(0.0, 1.0, CELLS + 1) ** 4


def price_grid(top: float) -> Array:
    """Prices (CELLS + 1,) [W/N] from 0 to `top`, the ends of a table's intervals."""
    return np.asarray(top * _GRID)


@dataclass(frozen=True, eq=False)
class RadialTable:
    """Force over price in one direction, cubic in each interval."""

    top: float
    """Price [W/N] from which on the force is the largest one."""
    force: Array
    """Force (CELLS + 1,) [N] at the ends of the intervals, rising."""
    slope: Array
    """Its derivative (CELLS + 1,) [N^2/W] there."""
    rest: float
    """Power [W] at the least force."""
    base: "tuple[RadialTable, float, float] | None" = None
    """Another table that this one is scaled of, see `origin`."""

    @classmethod
    def of_forces(cls, top: float, force: Array, rest: float) -> "RadialTable":
        """A table of forces (CELLS + 1,) at `price_grid(top)`, monotone cubic (Fritsch and Carlson,
        1980)."""
        force = np.maximum.accumulate(np.asarray(force, np.float64))
        return cls(float(top), force, monotone_slopes(price_grid(top), force), float(rest))

    @property
    def largest(self) -> float:
        """The largest force [N]."""
        return float(self.force[-1])

    @property
    def origin(self) -> tuple["RadialTable", float, float]:
        """The table that this one is scaled of, by shares of its force and of its power."""
        return self.base or (self, 1.0, 1.0)

    def scaled(self, share: float, cost: float = 1.0) -> "RadialTable":
        """The table with `share` times the force, and `cost` times the power, at each command."""
        per = share / cost
        base, force, power = self.origin
        scaled = base, share * force, cost * power
        return RadialTable(
            self.top / per, self.force * share, self.slope * share * per, self.rest * cost, scaled
        )

    def cost(self, force: Array) -> Array:
        """Power (...) [W] of forces (...) [N] within the table."""
        price = np.interp(force, self.force, price_grid(self.top))
        return np.asarray(price * force - self.conjugate(price))

    def conjugate(self, price: Array) -> Array:
        """The most (...) [W] that a force is worth, less its power, at prices (...) [W/N] from 0 to
        `top`."""
        cell = np.clip(np.searchsorted(_GRID, price / self.top, side="right") - 1, 0, CELLS - 1)
        width = self.top * np.diff(_GRID)
        share = price / self.top - _GRID[cell]
        t = share / np.diff(_GRID)[cell]
        first = self.force[cell]
        last = self.force[cell + 1]
        (m0, m1) = self._bends[:, cell]
        rise = last - first
        part = first + t * (
            m0 / 2.0 + t * ((3.0 * rise - 2.0 * m0 - m1) / 3.0 + t * (m0 + m1 - 2.0 * rise) / 4.0)
        )
        return np.asarray(self._starts[cell] + width[cell] * t * part)

    @cached_property
    def _bends(self) -> Array:
        """Derivatives (2, CELLS) of the force at both ends of each interval, over its width."""
        width = self.top * np.diff(_GRID)
        return np.stack([self.slope[:-1] * width, self.slope[1:] * width])

    @cached_property
    def _starts(self) -> Array:
        """Conjugates (CELLS + 1,) [W] at the ends of the intervals."""
        mean = 0.5 * (self.force[:-1] + self.force[1:]) + (self._bends[0] - self._bends[1]) / 12.0
        return np.concatenate([[0.0], np.cumsum(self.top * np.diff(_GRID) * mean)]) - self.rest

    @cached_property
    def numbers(self) -> Array:
        """The table as the core takes it, at as few of the grid's prices as say the same."""
        step = CELLS
        while step > 1 and not self._stands_for_all(step):
            step //= 2
        return table_numbers(self.top, self.force[::step], self.slope[::step], self.rest)

    def _stands_for_all(self, step: int) -> bool:
        """Whether every `step`-th of the grid's prices says what all do."""
        few = [values[::step] for values in (_GRID, self.force, self.top * self.slope)]
        cell = np.minimum(np.arange(CELLS + 1) // step, CELLS // step - 1)
        width = np.diff(few[0])[cell]
        t = (_GRID - few[0][cell]) / width
        m0 = few[2][cell] * width
        m1 = few[2][cell + 1] * width
        rise = np.diff(few[1])[cell]
        found = few[1][cell] + t * (
            m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise))
        )
        return bool(np.abs(found - self.force).max() <= 0.1 * NOTHING * self.largest)

    def with_square(self, weight: float) -> "RadialTable":
        """The table where a force T [N] costs `weight` T^2 [W] more: it answers v + 2 weight T as
        before v."""
        price = price_grid(self.top) + 2.0 * weight * self.force
        top = float(price[-1])
        rest = self.rest + weight * float(self.force[0]) ** 2
        return self.of_forces(top, np.interp(price_grid(top), price, self.force), rest)


def table_numbers(top: float, force: Array, slope: Array, rest: float) -> Array:
    """Returns a table as the core takes it: `top`, cells k, `rest`, then force, its derivative and
    conjugate (k + 1,) at prices top (j / k)^4."""
    width = np.diff(top * np.linspace(0.0, 1.0, len(force)) ** 4)
    mean = 0.5 * (force[:-1] + force[1:]) + width * (slope[:-1] - slope[1:]) / 12.0
    start = np.concatenate([[0.0], np.cumsum(width * mean)]) - rest
    knots = np.stack([force, slope, start], axis=-1)
    return np.concatenate([[top, len(force) - 1, rest], knots.ravel()])


def monotone_slopes(x: Array, y: Array) -> Array:
    """Slopes (K,) of a rising cubic spline through points (K,), third order where the data
    allow."""
    width = np.diff(x)
    chord = np.diff(y) / np.diff(x)
    slope = np.empty_like(y)
    slope[1:-1] = (width[1:] * chord[:-1] + width[:-1] * chord[1:]) / (width[1:] + width[:-1])
    slope[0] = chord[0] + (chord[0] - chord[1]) * width[0] / (width[0] + width[1])
    slope[-1] = chord[-1] + (chord[-1] - chord[-2]) * width[-1] / (width[-1] + width[-2])
    most = 3.0 * np.minimum(np.append(chord, chord[-1]), np.insert(chord, 0, chord[0]))
    return np.clip(slope, 0.0, most)


@dataclass(frozen=True, eq=False)
class Line:
    """What an actuator with one direction offers: a force between two limits, of either sign."""

    effectiveness: Array
    """Wrench (6,) per newton [-, m], body frame."""
    table: RadialTable
    """Answer to a positive price."""
    reverse: RadialTable | None = None
    """Answer to a negative price, as sizes; None where the force has one sign."""
    band: float = 0.0
    """Forces smaller than this one, other than 0, cannot be held [N]."""
    low: float = -np.inf
    """Least force [N], where that is more than the tables give."""
    high: float = np.inf
    """Largest force [N], where that is less than the tables give."""
    drag: Array | None = None
    """Wrench (6,) per newton of drag [-, m] that comes with the force; None where none does."""
    speed: float = 0.0
    """Power per newton of it [m/s]."""

    @property
    def rows(self) -> Array:
        """Wrench (2, 6) per newton of the force, and of its drag."""
        return np.stack([self.effectiveness, np.zeros(6) if self.drag is None else self.drag])

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest force [N]."""
        low = -self.reverse.largest if self.reverse else float(self.table.force[0])
        return max(self.low, low), min(self.high, self.table.largest)


@dataclass(frozen=True, eq=False)
class Plane:
    """What an actuator with two directions offers: forces within an arc, up to a largest size."""

    effectiveness: Array
    """Wrench (2, 6) per newton along its two directions [-, m], body frame."""
    table: RadialTable
    """Answer to a price along the force; its first force is the least one."""
    middle: float = 0.0
    """Middle of the arc of force directions, from the first direction towards the second [rad]."""
    half: float = np.pi
    """Half of that arc [rad]; pi for a full circle."""
    gauge: Array | None = None
    """Share (G,) of the table's force that the same cost gives in each of G directions around the
    circle, from angle 0 on; None for a fin that is alike all round."""
    band: float = 0.0
    """Forces smaller than this one, other than 0, cannot be held [N]."""
    reverse: RadialTable | None = None
    """Answer of forces against the directions of the arc, from rest on; None where it pushes one
    way."""
    high: float = np.inf
    """Largest force [N], below 0 in reverse, where that is less than the tables give."""

    @property
    def rows(self) -> Array:
        """Wrench (2, 6) per newton along its directions."""
        return self.effectiveness

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest force [N], below 0 in reverse."""
        low = -self.reverse.largest if self.reverse else float(self.table.force[0])
        return low, min(self.high, self.table.largest)


Response = Line | Plane
"""What one actuator offers."""


def with_square(response: Response, weight: float) -> Response:
    """Returns what an actuator offers where a force F [N] costs `weight` F^2 [W] more; of a fin
    that is not alike all round with the mean over all directions."""
    if isinstance(response, Line):
        reverse = response.reverse and response.reverse.with_square(weight)
        return replace(response, table=response.table.with_square(weight), reverse=reverse)
    if response.gauge is not None:
        weight *= float(np.mean(response.gauge**2))
    reverse = response.reverse and response.reverse.with_square(weight)
    return replace(response, table=response.table.with_square(weight), reverse=reverse)


def power_of(response: Response, force: Array) -> Array:
    """Returns the power (...) [W] of forces (...) [N], of planes sizes, below 0 in reverse."""
    ahead, astern = (
        table.cost(np.abs(force)) for table in (response.table, response.reverse or response.table)
    )
    return np.where(force < 0.0, astern, ahead)


class Form(NamedTuple):
    """How a force of one actuator becomes a command, and a command a force, as numbers for the
    core: finlab/core/src/command_law.c reads them."""

    kind: Literal["thruster", "pod", "fin", "foil"]
    """A force; an angle and a force; a beat of a fin; an angle of a foil."""
    axes: Array | None = None
    """Axes (3, 3) of the law's forces in the actuator's own ones; None where they are the same."""
    law: Array | None = None
    """A grid of the law, see `finlab.actuators.hermite_grid.grid_numbers`."""
    beat: Array | None = None
    """Of a fin: amplitudes and frequencies (K + 1, 2) of the shares (j / K)^2 of its largest force.
    Of a foil: coefficients of lift, rising, and angles (K, 2)."""
    deflection: Array | None = None
    """Of a fin with a gauge: angles (POINTS,) [rad] from the command's direction to the force's."""
    sign: float = 1.0
    """Of a thruster's command over its force: -1 where it only pulls."""
    lean: float = 0.0
    """Angle [rad] from the command of a fin to its force; of a foil the direction of travel."""
    uneven: float = 0.0
    """Of a fin, whose force grows by the factor 1 + uneven cos(angle - uneven_at)."""
    uneven_at: float = 0.0
    """See `uneven` [rad]."""
    pressure: float = 1.0
    """Dynamic pressure times area of a foil [N]."""
    zero_lift_angle: float = 0.0
    """Command of a foil at which it has no lift [rad]."""
    zero_lift_drag: float = 0.0
    """Coefficient of its drag there."""


class Group(ABC):
    """The m actuators of one type in a robot: what they offer for prices, and which commands give a
    force."""

    responses: list[Response]
    """What each offers, by the effectiveness of its own directions."""
    feels_flow: bool = False
    """Whether that depends on the water that meets them."""

    def at(self, inflow: Array | None) -> "Group":
        """Returns the group with velocities (m, 3) [m/s] of its places through the water, own
        frames, or None."""
        return self

    @property
    def beside(self) -> Array:
        """Wrench (m, 6) [N, N m] that comes on top of forces of 0, such as the drag of a rudder."""
        return np.zeros((len(self.responses), 6))

    def beside_of(self, force: Array) -> Array:
        """Wrenches (N, 6) [N, N m] that come on top of forces (N, m, 2) of the answers."""
        return np.zeros((len(force), 6))

    def radial_worth(self, price: Array, back: Array, ends: Array | None) -> Array | None:
        """Returns the most that force along its own direction is worth, less its power, by the law
        itself.

        Args:
            price: prices (N, m) [W/N] of that force, of lines signed.
            back: the same of a force in reverse, of planes that push either way.
            ends: least and largest force (m, 2) [N] now, of planes below 0 in reverse; None for all
                that the limits allow. What a law may give beyond them makes the bound weaker, not
                wrong.

        Returns:
            (N, m) [W]; NaN, or None, where that is what the tables say.
        """
        return None

    def worth(self, price: Array) -> Array | None:
        """Returns the most (N, m) [W] that all that the actuators can give, but `beside`, is worth
        at prices (N, 6) of the wrench, less its power, or more; NaN, or None, where the answers'
        forces are all."""
        return None

    @property
    @abstractmethod
    def forms(self) -> list[Form]:
        """How the forces of each become commands."""
