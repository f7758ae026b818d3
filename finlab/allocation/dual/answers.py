"""The answers of all actuators of one robot to prices, for many targets at once.

Targets come last in all arrays: prices (k, N) [W/N] of the actuators' own directions, in the order lines,
first directions of planes, second directions of planes, what lines drag along. Each answer is the gradient
of a conjugate: a line's `T(|s|) sign(s)`, a plane's `T(v) g` with `v = s . g` and `g` the direction of the
force, its size the gauge.

A line that drags, such as a foil, gives the force T and with it the drag that its power says, U times the
drag. Where drag is paid `a` [W/N], a force is as dear as r = 1 - a/U times its power: it answers a price v as
another one answers v/r. Where r < 0, drag is welcome, and is what the dearer end gives: r is softened to a
positive number s(r), and the conjugate s c*(v/s) has (s - r) times the largest power on top, which is convex.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import CELLS, Line, Plane, RadialTable, price_grid
from finlab.allocation.dual.planar import Fan, Gauges, Planar, blend, end_of, share_of
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.precision import CLOSE, FINE, ROUNDING, ROUNDS

SOFT = 0.2
"""Price of drag, as a share of the speed, below which drag turns from dear to welcome."""
_EDGES = price_grid(1.0)
"""Ends of the tables' intervals, as shares of the largest price."""


class Answer(NamedTuple):
    """What a robot's actuators answer to N prices."""

    force: Array
    """Forces (k, N) [N]."""
    derivative: Array
    """Derivatives by the prices (l + 3 p + 2 f, N) [N^2/W]: of lines, then of planes first-first,
    first-second and second-second, then of lines that drag force-drag and drag-drag."""
    conjugate: Array
    """Sum of the conjugates (N,) [W]."""


class Answers:
    """A robot's actuators, ready to answer."""

    def __init__(self, lines: list[Line], planes: list[Plane]) -> None:
        """Makes the tables of the actuators, lines before planes."""
        self.lines, self.planes = len(lines), len(planes)
        sides = [(line.forward, line.reverse or line.forward) for line in lines]
        sides += [(plane.table, plane.reverse or plane.table) for plane in planes]
        tables = [table for both in sides for table in both]
        self._coefficients = np.concatenate([table.polynomials for table in tables]).T.copy()
        self._top = np.array([table.top for table in tables])
        self._ends = np.array([table.force for table in tables])
        self.prices = np.array([_usual_price(table) for table in tables]).reshape(-1, 2).max(axis=1)
        """Price (n,) [W/N] of the largest force of each, were it as dear as that of half the force says."""
        shares = self._ends / np.maximum(self._ends[:, -1:], 1e-300)
        self._shares = (shares + 2.0 * np.arange(len(tables))[:, None]).ravel()
        """The tables' forces as shares of the largest, one table after the other."""
        self._row = 2 * np.arange(len(sides))[:, None]
        self.dragging = np.array([i for i, line in enumerate(lines) if line.drag is not None], np.intp)
        """Places of the f lines that drag."""
        self._speed = np.array([[lines[i].speed] for i in self.dragging]).reshape(-1, 1)
        self._rest = np.array([[lines[i].forward.rest] for i in self.dragging]).reshape(-1, 1)
        self.gauges = Gauges([plane.gauge for plane in planes])

    def pair(self, force: Array) -> tuple[Array, Array]:
        """First and second entries (p, N) of the planes of forces or prices (k, N)."""
        n = self.lines + self.planes
        return force[self.lines : n], force[n : n + self.planes]

    def sizes(self, force: Array) -> Array:
        """Sizes (p, N) [N] of the planes' forces, of forces (k, N) along all directions."""
        return np.asarray(np.hypot(*self.pair(force)))

    def drag(self, force: Array) -> Array:
        """What the lines that drag drag along (f, N) [N] more than at rest with forces (l, N) [N]."""
        if not len(self.dragging):
            return np.zeros((0, force.shape[1]))
        own = np.zeros((self.lines + self.planes, force.shape[1]))
        own[self.dragging] = force[self.dragging]
        return np.asarray((self.marginal(own)[1][self.dragging] - self._rest) / self._speed)

    def radial(self, price: Array, row: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Force [N], derivative and conjugate [W] (m, N) at prices (m, N) from 0 on in rows (m, 1 or N)."""
        top = self._top[row]
        share = price / top
        cell = np.minimum((np.sqrt(np.sqrt(share)) * CELLS).astype(np.intp), CELLS)
        a0, a1, a2, a3, start = self._coefficients[:, row * (CELLS + 1) + cell]
        x = share - _EDGES[cell]
        linear, cubic = x * a1, x * a3
        square = a2 + cubic
        bend = x * x * square
        force = a0 + linear + bend
        slope = (a1 + x * (square + square + cubic)) / top
        # Of the mean force along the interval, the last part is exact to x^4.
        mean = a0 + 0.5 * linear + x * x * (a2 / 3.0 + 0.25 * cubic)
        return force, slope, start + top * x * mean

    def marginal(self, force: Array) -> tuple[Array, Array]:
        """Prices (n, N) [W/N] at which forces (n, N) within the tables are given, without a sign, and their
        power [W]; of planes at their sizes, below 0 in reverse."""
        row = self._row + (force < 0.0)
        size, largest = np.abs(force), np.maximum(self._ends[row, -1], 1e-300)
        place = np.searchsorted(self._shares, (size / largest + 2.0 * row).ravel()).reshape(size.shape)
        cell = np.clip(place - row * (CELLS + 1) - 1, 0, CELLS - 1)
        a0, a1, a2, a3, start = self._coefficients[:, row * (CELLS + 1) + cell]
        width = _EDGES[cell + 1] - _EDGES[cell]
        rise = self._ends[row, cell + 1] - a0
        x = width * np.divide(size - a0, rise, out=np.zeros_like(size), where=rise > 0.0)
        # An error of the price counts squared in the power.
        for _ in range(ROUNDS):
            slope = a1 + x * (2.0 * a2 + 3.0 * x * a3)
            excess = a0 + x * (a1 + x * (a2 + x * a3)) - size
            change = np.divide(excess, slope, out=np.zeros_like(x), where=slope > 0.0)
            last, x = x, np.minimum(np.maximum(x - change, 0.0), width)
            if (np.abs(x - last) <= ROUNDING * width).all():
                break
        top = self._top[row]
        conjugate = start + top * x * (a0 + x * (a1 / 2.0 + x * (a2 / 3.0 + x * (a3 / 4.0))))
        price = top * (_EDGES[cell] + x)
        return price, price * size - conjugate

    def __call__(self, price: Array, sets: Sets) -> Answer:
        """Answers to prices (k, N)."""
        lines, n, drags = self.lines, self.lines + self.planes, len(self.dragging) > 0
        if drags:
            price, *without = self._without_drag(price)
        if not self.planes:
            force, slope, conjugate = self._limited(price[:n], lines, self._row, sets)
            if drags:
                rise, steep = self._dragged(price, without, force, slope, conjugate, sets)
                force, slope = np.concatenate([force, rise]), np.concatenate([slope, *steep])
            return Answer(force, slope, conjugate.sum(axis=0))
        first, second = self.pair(price)
        fan = self._fan(first, second, sets, sets.squared_gap, self.gauges)
        value = np.concatenate([price[:lines], fan.along]) if lines else fan.along
        forked = fan.beyond is not None and len(sets.forked) > 0
        row = self._rows(sets)
        size, slope, conjugate = self._limited(value, lines, row, sets)
        planar = Planar.of(fan, size[lines:], slope[lines:])
        if forked:
            self._fork(planar, conjugate[lines:], fan, (first, second), sets, row[lines:], self.gauges)
        if len(sets.reversing):
            places, width = sets.reversing, FINE * sets.ways[1].high_cost + 1e-12
            other, others = self._one_way(price, sets, 1)
            blend(planar, conjugate[lines:], places, other, others, width, sets.reverse[places] > 0.0)
        parts = [planar.first, planar.second], [planar.xx, planar.xy, planar.yy]
        if drags:
            rise, steep = self._dragged(price, without, size, slope, conjugate, sets)
            parts = [*parts[0], rise], [*parts[1], *steep]
        if lines:
            parts = [size[:lines], *parts[0]], [slope[:lines], *parts[1]]
        return Answer(np.concatenate(parts[0]), np.concatenate(parts[1]), conjugate.sum(axis=0))

    def _without_drag(self, price: Array) -> tuple[Array, ...]:
        """Prices (k, N) that lines without drag answer as those that drag do, r (f, N), and `_softened`."""
        ratio = 1.0 - price[len(price) - len(self.dragging) :] / self._speed
        softened = _softened(ratio)
        price = price.copy()
        price[self.dragging] /= softened[0]
        return price, ratio, *softened

    def _dragged(
        self, price: Array, without: list[Array], force: Array, slope: Array, conjugate: Array, sets: Sets
    ) -> tuple[Array, tuple[Array, Array]]:
        """Drag (f, N) [N] that comes with the forces, and its derivatives; the derivatives and conjugates of
        forces (n, N) are changed, in place, into what they are with the drag, by `_without_drag`."""
        at, rest, speed = self.dragging, self._rest, self._speed
        own, (ratio, soft, rate, bend) = price[at], without
        cost = own * force[at] - conjugate[at] - rest
        most = np.maximum(sets.low_cost[at], sets.high_cost[at]) - rest
        conjugate[at] = soft * (conjugate[at] + rest) + (soft - ratio) * most - rest
        slope[at] /= soft
        along = own * rate / speed
        square = slope[at] * along * along + (most - cost) * bend / speed**2
        return (rate * cost + (1.0 - rate) * most) / speed, (slope[at] * along, square)

    def _rows(self, sets: Sets) -> NDArray[np.intp]:
        """Rows (n, 1) or (n, N) of the actuators' tables."""
        if not sets.flipped.any():
            return self._row
        flipped = np.pad(sets.flipped, ((self.lines, 0), (0, 0))).astype(np.intp)
        return self._row + flipped

    def _one_way(self, price: Array, sets: Sets, way: int) -> tuple[Planar, Array]:
        """Answers (q, N) of planes that push either way to prices (k, N), with conjugates, by one of
        `ways`."""
        places, sets = sets.reversing, sets.ways[way]
        first, second = (values[places] for values in self.pair(price))
        row = self._row[self.lines + places] + sets.flipped.astype(np.intp)
        fan = self._fan(first, second, sets, sets.squared_gap)
        size, slope, conjugate = self._limited(fan.along, 0, row, sets)
        planar = Planar.of(fan, size, slope)
        if len(sets.forked):
            self._fork(planar, conjugate, fan, (first, second), sets, row)
        return planar, conjugate

    def undecided(self, price: Array, sets: Sets) -> tuple[Array, NDArray[np.bool_]]:
        """How far [N] the answers (q, N) to prices (k, N) of planes that push either way are from what they
        can give one way, and whether they are more forward than in reverse."""
        places = sets.reversing
        (ahead, own), (back, others) = (self._one_way(price, sets, way) for way in (0, 1))
        share = share_of(own - others, FINE * sets.ways[1].high_cost + 1e-12)
        share = np.where(sets.reverse[places] > 0.0, share, 1.0)
        off = np.hypot(ahead.first - back.first, ahead.second - back.second)
        return np.minimum(share, 1.0 - share) * off, share >= 0.5

    def farthest(self, price: Array, sets: Sets) -> Array:
        """Forces (k, N) [N] that are worth most at prices (k, N), whatever their power."""
        lines = self.lines
        line = np.where(price[:lines] > 0.0, sets.high[:lines], sets.low[:lines])
        drag = [self._farthest_dragged(price, line, sets)] if len(self.dragging) else []
        if not self.planes:
            return np.concatenate([line, *drag])
        first, second = self.pair(price)
        fan = self._fan(first, second, sets, 1e-300, self.gauges)
        size = np.where(fan.along > 0.0, sets.high[lines:], sets.low[lines:])
        x, y = size * fan.first, size * fan.second
        if len(places := sets.reversing):
            back = self._fan(first[places], second[places], sets.ways[1], 1e-300)
            other = np.where(back.along > 0.0, sets.reverse[places], 0.0)
            better = other * back.along > size[places] * fan.along[places]
            x[places] = np.where(better, other * back.first, x[places])
            y[places] = np.where(better, other * back.second, y[places])
        return np.concatenate([line, x, y, *drag])

    def _farthest_dragged(self, price: Array, line: Array, sets: Sets) -> Array:
        """Drag (f, N) [N] of the lines that drag, whose forces (l, N) become what is worth most with it."""
        at, cost = self.dragging, -price[len(price) - len(self.dragging) :]
        own = np.zeros((self.lines + self.planes, price.shape[1]))
        own[at] = price[at] * self._speed / np.where(cost > 0.0, cost, 1.0)
        inner = self._limited(own[: self.lines], self.lines, self._row[: self.lines], sets, slice(self.lines))
        ends = [end[: self.lines] + np.zeros_like(line) for end in (sets.low, sets.high)]
        worth = [price[at] * end[at] - cost * self.drag(end) for end in ends]
        outer = np.where(worth[1] > worth[0], ends[1][at], ends[0][at])
        line[at] = np.where(cost > 0.0, inner[0][at], outer)
        return self.drag(line)

    def worth(self, price: Array, sets: Sets) -> tuple[Array, Array, Array]:
        """Prices (n, N) [W/N] along the forces that answer prices (k, N), of lines with their sign, and of
        planes in reverse; and what these forces are worth, less their power [W], by the tables."""
        lines, n = self.lines, self.lines + self.planes
        (first, second), along = self.pair(price), price[:n].copy()
        back = np.zeros_like(along)
        if self.planes:
            along[lines:] = self._fan(first, second, sets, 1e-300, self.gauges).along
        conjugate = self._limited(along, lines, self._rows(sets), sets)[2]
        if len(places := sets.reversing):
            way = sets.ways[1]
            back[lines + places] = self._fan(first[places], second[places], way, 1e-300).along
            both = [self._one_way(price, sets, way)[1] for way in (0, 1)]
            conjugate[lines + places] = np.where(sets.reverse[places] > 0.0, np.maximum(*both), both[0])
        return along, back, conjugate

    def _limited(
        self, price: Array, lines: int, row: NDArray[np.intp], sets: Sets, of: Any = slice(None)
    ) -> tuple[Array, Array, Array]:
        """Forces, derivatives and conjugates (m, N) for prices (m, N) within the limits of some actuators;
        only the prices of the first, the lines, have a sign."""
        along, flips = price, lines > 0
        if flips:
            sign = np.where(price < 0.0, -1.0, 1.0)
            sign[lines:] = 1.0
            along, row = price * sign, row + (sign < 0.0)
        if sets.arcs:  # a price away from the arc's end moves nothing
            along = np.maximum(along, 0.0)
        force, slope, conjugate = self.radial(along, row)
        if flips:
            force = force * sign
        if sets.arcs:
            slope = np.where(along > 0.0, slope, 0.0)
        low, high = sets.low[of], sets.high[of]
        below, above = force <= low, force >= high
        conjugate = np.where(below, price * low - sets.low_cost[of], conjugate)
        conjugate = np.where(above & ~below, price * high - sets.high_cost[of], conjugate)
        return np.minimum(np.maximum(force, low), high), np.where(below | above, 0.0, slope), conjugate

    def _fan(
        self,
        first: Array,
        second: Array,
        sets: Sets,
        squared_gap: Array | float,
        gauges: Gauges | None = None,
    ) -> Fan:
        """Directions in which planes answer prices (p, N), those of a smooth size of the prices."""
        size = along = np.sqrt(first * first + second * second + squared_gap)
        x, y = first / size, second / size
        tangent = 1.0 / size
        fan_x, fan_y = x, y
        if gauges:
            fan_x, fan_y, tangent, along = self._uneven(x, y, tangent, size)
        xx, xy, yy = tangent * (1.0 - x * x), -tangent * x * y, tangent * (1.0 - y * y)
        if not sets.arcs:
            return Fan(along, fan_x, fan_y, xx, xy, yy, None, None)
        cos, sin = np.cos(sets.middle), np.sin(sets.middle)
        ahead, aside = fan_x * cos + fan_y * sin, fan_y * cos - fan_x * sin
        beyond = np.abs(aside) * np.cos(sets.half) > ahead * np.sin(sets.half)
        beyond &= sets.half < np.pi
        # The nearer end by the price itself: by the force, both are alike where the arc has no width.
        nearer = np.where(second * cos - first * sin < 0.0, -1.0, 1.0)
        angle = sets.middle + nearer * sets.half
        end_x, end_y = end_of(angle, gauges)
        keep, other = np.where(beyond, 0.0, 1.0), sets.middle - nearer * sets.half
        along = np.where(beyond, first * end_x + second * end_y, along)
        fan_x, fan_y = np.where(beyond, end_x, fan_x), np.where(beyond, end_y, fan_y)
        return Fan(along, fan_x, fan_y, xx * keep, xy * keep, yy * keep, beyond, other)

    def _uneven(self, x: Array, y: Array, tangent: Array, size: Array) -> tuple[Array, Array, Array, Array]:
        """Directions of the force times the gauges, weights of their change, and prices along them."""
        places = self.gauges.places
        value, slope, bend = self.gauges.support(np.arctan2(y[places], x[places]))
        fan_x, fan_y, tangent, along = x.copy(), y.copy(), tangent.copy(), size.copy()
        own_x, own_y = x[places], y[places]
        fan_x[places], fan_y[places] = value * own_x - slope * own_y, value * own_y + slope * own_x
        tangent[places] *= np.maximum(value + bend, 0.0)
        along[places] *= value
        return fan_x, fan_y, tangent, along

    def _fork(
        self,
        planar: Planar,
        conjugate: Array,
        fan: Fan,
        price: tuple[Array, Array],
        sets: Sets,
        row: NDArray[np.intp],
        gauges: Gauges | None = None,
    ) -> None:
        """Blends, in place, answers and conjugates (p, N) of planes beyond arcs with those of the other
        ends."""
        assert fan.beyond is not None and fan.other is not None
        places, of = sets.forked, len(sets.low) - len(sets.half) + sets.forked
        first, second = price
        x, y = (values[places] for values in end_of(fan.other + np.zeros_like(first), gauges))
        along = first[places] * x + second[places] * y
        size, slope, worth = self._limited(along, 0, row[places], sets, of)
        other = Planar(size * x, size * y, slope * x * x, slope * x * y, slope * y * y)
        width = FINE * sets.high_cost[of] + 1e-12
        blend(planar, conjugate, places, other, worth, width, fan.beyond[places])


def _softened(ratio: Array) -> tuple[Array, Array, Array]:
    """Positive numbers, smooth and convex, that are the same from `SOFT` on, and their derivatives."""
    below = np.minimum(ratio / SOFT - 1.0, 0.0)
    rate = np.exp(below)
    slope = np.where(rate > CLOSE, rate, 0.0)
    soft = np.where(below < 0.0, SOFT * np.maximum(rate, CLOSE), ratio)
    return soft, slope, np.where(below < 0.0, slope / SOFT, 0.0)


def _usual_price(table: RadialTable) -> float:
    """Price [W/N] of the largest force where power grows as its power of 1.5 from half of it on: at the peak
    of a soft fin the price itself says nothing of the forces below."""
    middle = 0.5 * (table.force[0] + table.force[-1])
    price = float(np.sqrt(2.0) * np.interp(middle, table.force, price_grid(table.top)))
    return min(max(price, CLOSE * table.top), table.top)
