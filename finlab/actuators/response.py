"""The response of one actuator to a price, as a table (Eq. 5), and the `Group` of the responses of
a robot's actuators of one kind.

An actuator that is paid a price `v` [W/N] for its force along a direction responds with the force
`T(v)` that maximizes `v T - c(T)`, where `c` is its power. `T` rises with the price; its integral
is the convex conjugate `c*(v)` (Eq. 4). Both are kept as piecewise polynomials on prices that are
dense near zero, so that `T = dc*/dv` to rounding whatever the law is, and powers `T ~ v^2` (cost
`~ T^1.5`) are exact. A cost that is not convex is replaced by its convex hull, where `T` rises
steeply.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from finlab.arrays import NOTHING, Array

CELLS = 1024
"""Intervals of price of a table; their ends are `price_max (j / CELLS)^4`."""
POINTS = 512
"""Directions around a circle, and sizes of a force, at which a fin is tabulated."""
SAME_TABLE = 0.1
"""Error of a table with fewer knots, over `NOTHING` times its largest force, that is none."""

_GRID = np.linspace(0.0, 1.0, CELLS + 1) ** 4


def price_grid(price_max: float) -> Array:
    """Returns prices (CELLS + 1,) [W/N] from 0 to `price_max`, the ends of a table's intervals."""
    return np.asarray(price_max * _GRID)


class Origin(NamedTuple):
    """The table that another one is scaled of; the core keeps it once for all that share it."""

    table: RadialTable
    """The table, at a scale of 1."""
    force_scale: float
    """k_T, scale of its force [1]."""
    power_scale: float
    """k_P, scale of its power [1]."""


@dataclass(frozen=True, eq=False)
class RadialTable:
    """Force over price in one direction, cubic in each interval of price.

    Args:
        price_max: price from which on the force is the largest one [W/N].
        force: forces (CELLS + 1,) at the ends of the intervals, rising [N].
        slope: their derivatives by the price (CELLS + 1,) [N^2/W].
        power_at_least: power at the least force [W].
        base: table that this one is scaled of; None for one that is itself measured or computed.
    """

    price_max: float
    force: Array
    slope: Array
    power_at_least: float
    base: Origin | None = None

    @classmethod
    def of_forces(cls, price_max: float, force: Array, power_at_least: float) -> RadialTable:
        """Returns a table of forces (CELLS + 1,) [N] at `price_grid(price_max)`, monotone cubic
        (Fritsch and Carlson, 1980), with the power `power_at_least` [W] at the least force."""
        force = np.maximum.accumulate(np.asarray(force, np.float64))
        slope = monotone_slopes(price_grid(price_max), force)
        return cls(float(price_max), force, slope, float(power_at_least))

    @property
    def largest(self) -> float:
        """The largest force [N]."""
        return float(self.force[-1])

    @property
    def origin(self) -> Origin:
        """The table that this one is scaled of, itself at scales of 1 where it is of none."""
        return self.base or Origin(self, 1.0, 1.0)

    @cached_property
    def price(self) -> Array:
        """Prices (CELLS + 1,) [W/N] of `force`."""
        return price_grid(self.price_max)

    def scaled(self, share: float, cost: float = 1.0) -> RadialTable:
        """Returns the table with `share` times the force, and `cost` times the power, at each
        command."""
        force_per_power = share / cost
        table, force_scale, power_scale = self.origin
        return RadialTable(
            price_max=self.price_max / force_per_power,
            force=self.force * share,
            slope=self.slope * share * force_per_power,
            power_at_least=self.power_at_least * cost,
            base=Origin(table, share * force_scale, cost * power_scale),
        )

    def cost(self, force: Array) -> Array:
        """Returns the power (...) [W] of forces (...) [N] within the table, v T - c*(v)."""
        price = np.interp(force, self.force, self.price)
        return np.asarray(price * force - self.conjugate(price))

    def conjugate(self, price: Array) -> Array:
        """Returns the convex conjugate c*(v) (...) [W] at prices v (...) [W/N], at least 0, the
        integral of the force (Eq. 4)."""
        _, conjugate = self.force_and_conjugate(price)
        return conjugate

    def force_and_conjugate(self, price: Array) -> tuple[Array, Array]:
        """Evaluates the table as the core does, at the knots of `numbers`.

        Args:
            price: prices v (...) [W/N], at least 0.

        Returns:
            Forces T(v) (...) [N], and convex conjugates c*(v) (...) [W], the integral of the force
            (Eq. 4).
        """
        force, slope, conjugate = self.numbers[3:].reshape(-1, 3).T
        knots = self.price_max * np.linspace(0.0, 1.0, len(force)) ** 4
        within = np.minimum(price, self.price_max)
        interval = np.searchsorted(knots, within, side="right") - 1
        cell = np.clip(interval, 0, len(knots) - 2)
        width = np.diff(knots)[cell]
        t = (within - knots[cell]) / width
        first = force[cell]
        rise = force[cell + 1] - first
        m0 = slope[cell] * width
        m1 = slope[cell + 1] * width

        # A cubic Hermite polynomial, and its integral from 0 to t.
        b = 3.0 * rise - 2.0 * m0 - m1
        c = m0 + m1 - 2.0 * rise
        force_at_price = first + t * (m0 + t * (b + t * c))
        integral = t * (first + t * (m0 / 2.0 + t * (b / 3.0 + t * c / 4.0)))
        beyond = (price - within) * self.largest
        return force_at_price, conjugate[cell] + width * integral + beyond

    @cached_property
    def numbers(self) -> Array:
        """The table as the core takes it, at as few of the grid's prices as keep its values."""
        step = self._step
        return table_numbers(
            self.price_max, self.force[::step], self.slope[::step], self.power_at_least
        )

    @cached_property
    def _step(self) -> int:
        """Every how many of the grid's prices are enough to keep its values."""
        table, _, _ = self.origin
        if table is not self:
            return table._step  # a scale changes nothing about it
        step = CELLS
        while step > 1 and not self._keeps_values(step):
            step //= 2
        return step

    def _keeps_values(self, step: int) -> bool:
        """Whether the cubics between every `step`-th of the grid's prices pass through all
        forces."""
        price = _GRID[::step]
        force = self.force[::step]
        slope = (self.price_max * self.slope)[::step]
        cell = np.minimum(np.arange(CELLS + 1) // step, CELLS // step - 1)
        width = np.diff(price)[cell]
        t = (_GRID - price[cell]) / width
        m0 = slope[cell] * width
        m1 = slope[cell + 1] * width
        rise = np.diff(force)[cell]
        cubic = m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise))
        error = np.abs(force[cell] + t * cubic - self.force).max()
        return bool(error <= SAME_TABLE * NOTHING * self.largest)

    def with_square(self, weight: float) -> RadialTable:
        """Returns the table of the cost c(T) + `weight` T^2 [W]: at the price v + 2 weight T it
        responds as this one does at v."""
        price = self.price + 2.0 * weight * self.force
        price_max = float(price[-1])
        power_at_least = self.power_at_least + weight * float(self.force[0]) ** 2
        force = np.interp(price_grid(price_max), price, self.force)
        return self.of_forces(price_max, force, power_at_least)


def table_numbers(price_max: float, force: Array, slope: Array, power_at_least: float) -> Array:
    """Returns a table as the core takes it.

    Args:
        price_max: price from which on the force is the largest one [W/N].
        force: forces (k + 1,) [N] at prices price_max (j / k)^4.
        slope: their derivatives by the price (k + 1,) [N^2/W].
        power_at_least: power at the least force [W].

    Returns:
        `price_max`, k, `power_at_least`, then force, its derivative and its conjugate at each price
        (3 k + 6,).
    """
    width = np.diff(price_max * np.linspace(0.0, 1.0, len(force)) ** 4)
    mean = 0.5 * (force[:-1] + force[1:]) + width * (slope[:-1] - slope[1:]) / 12.0
    conjugate = np.concatenate([[0.0], np.cumsum(width * mean)]) - power_at_least
    knots = np.stack([force, slope, conjugate], axis=-1)
    return np.concatenate([[price_max, len(force) - 1, power_at_least], knots.ravel()])


def monotone_slopes(x: Array, y: Array) -> Array:
    """Returns the slopes of a rising cubic spline through points (Fritsch and Carlson, 1980).

    Args:
        x: abscissas (K,), rising.
        y: ordinates (K,), rising.

    Returns:
        Derivatives (K,): those of parabolas through three points, at most three times the smaller
        chord beside them, which keeps the spline monotone.
    """
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
    """Response of an actuator with one direction: a force between two limits, of either sign.

    Args:
        effectiveness: wrench (6,) per newton [1, m], body frame.
        table: response to a positive price.
        reverse: response to a negative price, as sizes; None where the force has one sign.
        dead_band: dead band: forces smaller than this, other than 0, cannot be held [N].
        low: least force, where that is more than the tables give [N].
        high: largest force, where that is less than the tables give [N].
        drag: wrench (6,) per newton of drag that comes with the force [1, m]; None where none does.
        flow_speed: power per newton of drag [m/s].
    """

    effectiveness: Array
    table: RadialTable
    reverse: RadialTable | None = None
    dead_band: float = 0.0
    low: float = -np.inf
    high: float = np.inf
    drag: Array | None = None
    flow_speed: float = 0.0

    @property
    def rows(self) -> Array:
        """Wrench (2, 6) per newton of the force, and of its drag [1, m]."""
        return np.stack([self.effectiveness, np.zeros(6) if self.drag is None else self.drag])

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest force [N]."""
        low = -self.reverse.largest if self.reverse else float(self.table.force[0])
        return max(self.low, low), min(self.high, self.table.largest)


@dataclass(frozen=True, eq=False)
class Plane:
    """Response of an actuator with two directions: forces within an arc, up to a largest size.

    Args:
        effectiveness: wrench (2, 6) per newton along its two directions [1, m], body frame.
        table: response to a price along the force; its first force is the least one.
        sector_center: centre of the arc of force directions, from the first direction towards the
            second [rad].
        sector_half_angle: half angle of that arc; pi for a full circle [rad].
        gauge: share (G,) of the table's force that the same cost gives in each of G directions
            around the circle, from angle 0 on [1]; None for a fin that is alike all round.
        dead_band: dead band: forces smaller than this, other than 0, cannot be held [N].
        reverse: response of forces against the directions of the arc, from rest on; None where it
            pushes one way.
        high: largest force, below 0 in reverse, where that is less than the tables give [N].
        barred: least and greatest angle of each zone within the arc that has no forces [rad].
    """

    effectiveness: Array
    table: RadialTable
    sector_center: float = 0.0
    sector_half_angle: float = np.pi
    gauge: Array | None = None
    dead_band: float = 0.0
    reverse: RadialTable | None = None
    high: float = np.inf
    barred: tuple[tuple[float, float], ...] = ()

    @property
    def rows(self) -> Array:
        """Wrench (2, 6) per newton along its directions [1, m]."""
        return self.effectiveness

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest force [N], below 0 in reverse."""
        low = -self.reverse.largest if self.reverse else float(self.table.force[0])
        return low, min(self.high, self.table.largest)


Response = Line | Plane
"""Response of one actuator to a price."""


def with_square(response: Response, weight: float) -> Response:
    """Returns the response where a force F costs `weight` F^2 [W] more.

    Args:
        response: that of an actuator.
        weight: of the squared force [W/N^2]; of a fin that is not alike all round it counts times
            the mean of the squared gauge over all directions.
    """
    if isinstance(response, Plane) and response.gauge is not None:
        weight *= float(np.mean(response.gauge**2))
    reverse = None if response.reverse is None else response.reverse.with_square(weight)
    return replace(response, table=response.table.with_square(weight), reverse=reverse)


def power_of(response: Response, force: Array) -> Array:
    """Returns the power (...) [W] of forces (...) [N], of planes signed sizes, below 0 in
    reverse."""
    size = np.abs(force)
    ahead = response.table.cost(size)
    astern = (response.reverse or response.table).cost(size)
    return np.where(force < 0.0, astern, ahead)


class Form(NamedTuple):
    """How a force of one actuator becomes a command, and a command a force, as numbers for the
    core, where `finlab/core/src/command_law.c` reads them."""

    kind: Literal["thruster", "pod", "fin", "foil", "steered"]
    """What a command is: a force; an angle and a force; a beat of a fin; an angle of a foil;
    that of a rudder, and the force of the propeller before it."""
    axes: Array | None = None
    """Axes (3, 3) of the law's forces in the actuator's own ones; None where they are the same."""
    law: Array | None = None
    """A grid of the law, see `finlab.actuators.hermite_grid.grid_numbers`."""
    command_table: Array | None = None
    """Of a fin: amplitudes [rad] and frequencies [Hz] (K + 1, 2) at (j / K)^2 of its largest force.
    Of a foil: lift coefficients, rising [1], and angles [rad] (K, 2). Of a propeller with a rudder:
    angles of the force and deflections at both ends of its arc [rad] (2, 2)."""
    command_table_count: int = 0
    """K of `command_table`, which the core reads before its rows: cells of a fin, points of a
    foil."""
    deflection: Array | None = None
    """With a gauge: angles (POINTS,) [rad] from the command's direction to the force's."""
    turning_costs: bool = False
    """Whether a change of the command's angle has a cost in a tick (Eq. 16), as of a pod."""
    command_sign: float = 1.0
    """Of a thruster: sign of its command over its force, -1 where it only pulls."""
    lean_angle: float = 0.0
    """Of a fin: angle from the command's direction to the force's [rad]. Of a foil: direction of
    travel [rad]."""
    unevenness: float = 0.0
    """Of a fin: e of the factor 1 + e cos(phi - phi_e) of its force [1]."""
    unevenness_angle: float = 0.0
    """Of a fin: phi_e of that factor [rad]."""
    pressure_area: float = 1.0
    """Of a foil: dynamic pressure times area [N]. Of a propeller with a rudder: the thrust whose
    slipstream is as fast as the flow [N]."""
    zero_lift_angle: float = 0.0
    """Of a foil: command at which it has no lift [rad]."""
    zero_lift_drag: float = 0.0
    """Of a foil: drag coefficient there [1]. Of a propeller with a rudder -1: p pushes ahead."""


class Group(ABC):
    """Responses to prices of the m actuators of one kind in a robot, and how their forces become
    commands."""

    responses: list[Response]
    """Response of each of the m, by the effectiveness of its own directions."""
    feels_flow: bool = False
    """Whether the responses depend on the water that meets the actuators."""

    def at(self, inflow: Array | None) -> Group:
        """Returns the group in a flow: velocities (m, 3) [m/s] of its points through the water, own
        frames; None at rest."""
        return self

    @property
    def wrench_offset_at_rest(self) -> Array:
        """Wrench offsets (m, 6) [N, N m] at forces of 0, such as the drag of a rudder."""
        return np.zeros((len(self.responses), 6))

    def wrench_offset_of(self, force: Array) -> Array:
        """Returns the wrench offset (N, 6) [N, N m] at forces (N, m, 2) [N] of the responses."""
        return np.zeros((len(force), 6))

    @property
    def conjugate_margins(self) -> list[Array | None]:
        """By how much the conjugate of each actuator's law may be above that of its table, as
        `fl_conjugates` of finlab/core/finlab.h takes it; None where `radial_conjugate_bound` or
        `conjugate_bound` says it, or the law is the table.

        `power_bound` of `finlab/allocation/dual/bound.py` asks, by `Compiled.conjugate_margins`.
        Fins by a formula answer, whose conjugates would take long for each bound, and propellers
        with a power law, whose conjugate the core evaluates.
        """
        return [None] * len(self.responses)

    def radial_conjugate_bound(
        self, price: Array, price_reverse: Array, force_limits: Array
    ) -> Array | None:
        """Returns the conjugate of each actuator's power along its force, by the law itself
        (Eq. 4).

        `power_bound` of `finlab/allocation/dual/bound.py` asks, by `Compiled.conjugates_by_laws`.
        Thrusters, azimuths and tilts answer: what they give has the directions of their responses,
        and their laws tell the power at each size. Those with `conjugate_margins` need no answer
        where all of a robot have them.
        Fins with measured tables and rudders give other directions too, see `conjugate_bound`.

        Args:
            price: prices (N, m) [W/N] of that force, of lines signed.
            price_reverse: the same of a force in reverse, of planes that push either way.
            force_limits: least and largest force (m, 2) [N], of planes below 0 in reverse. What a
                law may give beyond them makes the bound weaker, not wrong.

        Returns:
            (N, m) [W]; NaN, or None, where the conjugate of the tables holds.
        """
        return None

    def conjugate_bound(self, price: Array) -> Array | None:
        """Returns an upper bound of the conjugate of each actuator's power over all that it can
        give, the wrench offset left out (Eq. 4).

        `power_bound` of `finlab/allocation/dual/bound.py` asks, after `radial_conjugate_bound`;
        where both answer this one holds. Fins with measured tables answer, whose forces leave the
        plane of the response, and rudders, whose lift and drag come together on a curve that the
        table meets only at its knots. For all others `radial_conjugate_bound` is enough.

        Args:
            price: multipliers (N, 6) of the wrench [W/N, W/(N m)].

        Returns:
            (N, m) [W]; NaN, or None, where the forces of the responses are all that it can give.
        """
        return None

    @property
    @abstractmethod
    def forms(self) -> list[Form]:
        """How the forces of each of the m become commands."""
