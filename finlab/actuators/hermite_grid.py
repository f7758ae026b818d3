"""Cubic Hermite interpolation on grids over amplitude, frequency and zero direction.

One grid answers for commands of any shape, n grids side by side for those of n fins, each by its
own. The core in C takes grids as rows of numbers.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from finlab.arrays import NOTHING, AnyArray, Array
from finlab.axes import TURN

ROUNDING = 1e-12
"""How far [rad, Hz, rad] outside a grid a value may lie that is meant to be at its edge."""
_CELLS = (16, 1), (64, 1), (256, 1), (1024, 1), (16, 16), (64, 64)
"""Cells of amplitude and frequency that are tried for the law of a fin."""


class Grid(NamedTuple):
    """Values on a grid of commands, of one fin."""

    axes: list[Array]
    """Amplitudes [rad], frequencies [Hz] and zero directions [rad], rising, two points or more
    each."""
    values: Array
    """At the grid's points (a, f, d, columns)."""
    periodic: bool
    """Whether the zero directions cover the circle, the first one not repeated at the end."""


class HermiteGrids:
    """Interpolates on one grid, or on n grids with as many columns each.

    Between the points a cubic polynomial is used along each axis, whose slope at a point is that of
    the line through its neighbours. Outside a grid its edge counts.
    """

    def __init__(self, grids: list[Grid]) -> None:
        """Prepares the grids."""
        self.grids = grids
        knots = [axis for grid in grids for axis in closed_axes(grid)]
        counts = np.array([len(axis) for axis in knots])
        first = np.array([axis[0] for axis in knots])
        last = np.array([axis[-1] for axis in knots])
        scale = 1.0 / (last - first)
        shift = 2.0 * np.arange(len(knots))
        # All axes are looked up together: on one line where axis k lies between 2 k and 2 k + 1.
        line = [(axis - axis[0]) * s + k for axis, s, k in zip(knots, scale, shift, strict=True)]
        self._line = np.concatenate(line)
        cells = [
            shapes(axis, grids[k // 3].periodic and k % 3 == 2) for k, axis in enumerate(knots)
        ]
        self._shapes = np.concatenate([shape for shape, _ in cells])
        self._places = np.concatenate([place for _, place in cells])
        before = np.cumsum(counts) - counts
        # The values of all grids below each other, each with a rim of neighbours; a view of four in
        # a row.
        padded = [with_neighbours(grid) for grid in grids]
        self.columns: int = grids[0].values.shape[-1]
        """How many values each point has."""
        flat = np.concatenate([values.reshape(-1, self.columns) for values in padded])
        self._rows = sliding_window_view(flat.ravel(), 4 * self.columns)[:: self.columns]
        stride = np.array([(p.shape[1] * p.shape[2], p.shape[2], 1) for p in padded])
        start = np.cumsum([0, *(p[..., 0].size for p in padded[:-1])])
        four = np.arange(4)
        around = four[:, None] * stride[:, :1, None] + four * stride[:, 1:2, None]
        self._first, self._last = self._each(first), self._each(last)
        self._scale, self._shift = self._each(scale), self._each(shift)
        self._last_cell = self._each(before + counts - 2)
        self._middle = 0.5 * (self._first[..., 2] + self._last[..., 2])
        self._stride = self._each(stride)
        self._start = self._each(start - (before.reshape(-1, 3) * stride).sum(1), 1)[..., 0]
        self._around = self._each(around.reshape(-1, 16), 16)

    @staticmethod
    def _each(values: AnyArray, count: int = 3) -> AnyArray:
        """Values of the grids (n, count), or (count,) of a single one, for commands of any
        shape."""
        rows = values.reshape(-1, count)
        return rows[0] if len(rows) == 1 else rows

    def __call__(self, command: Array, orders: int) -> Array:
        """All columns (..., orders, orders, orders, columns) at commands (..., 3), or (..., n, 3):
        by amplitude, by frequency, by zero direction; with two orders values and derivatives."""
        cell, weight = self._weights(command, orders)
        corner = (cell * self._stride).sum(-1) + self._start
        grid = self._rows[corner[..., None] + self._around]
        rows = command.shape[:-1]
        both = weight[..., 0, :, None, :, None] * weight[..., 1, None, :, None, :]
        along = both.reshape(*rows, orders**2, 16) @ grid
        along = weight[..., 2, None, :, :] @ along.reshape(*rows, orders**2, 4, self.columns)
        return np.asarray(along.reshape(*rows, orders, orders, orders, self.columns))

    def _weights(self, command: Array, orders: int) -> tuple[NDArray[np.intp], Array]:
        """Cells (..., 3) of commands (..., 3), counted through all axes, and on each axis the
        weights of four neighbours in the value and, with two orders, in the derivative (..., 3,
        orders, 4)."""
        value = np.array(command, np.float64)
        direction = value[..., 2]
        direction -= TURN * np.rint((direction - self._middle) / TURN)
        held = np.minimum(np.maximum(value, self._first), self._last)
        place = (held - self._first) * self._scale + self._shift
        cell = np.minimum(self._line.searchsorted(place, side="right") - 1, self._last_cell)
        start = self._places.take(cell, axis=0)
        pace = start[..., 1]
        t = (held - start[..., 0]) * pace
        squared = t * t
        powers = np.zeros((*t.shape, orders, 4))
        powers[..., 0, 0] = 1.0
        powers[..., 0, 1] = t
        powers[..., 0, 2] = squared
        np.multiply(squared, t, out=powers[..., 0, 3])
        if orders == 2:
            pace = pace * (
                np.abs(held - value) <= ROUNDING
            )  # beyond the grid nothing changes any more
            powers[..., 1, 1] = pace
            np.multiply(2.0 * t, pace, out=powers[..., 1, 2])
            np.multiply(3.0 * squared, pace, out=powers[..., 1, 3])
        return cell, powers @ self._shapes.take(cell, axis=0)


def closed_axes(grid: Grid) -> list[Array]:
    """Returns the axes [rad, Hz, rad], that of a circle with its first direction again one turn
    later."""
    amplitude, frequency, direction = grid.axes
    return [
        amplitude,
        frequency,
        np.append(direction, direction[0] + TURN) if grid.periodic else direction,
    ]


def with_neighbours(grid: Grid) -> Array:
    """Returns the values with a rim of neighbours, at an edge the edge itself: slopes are one-sided
    there."""
    values = np.pad(grid.values, ((1, 1), (1, 1), (0, 0), (0, 0)), "edge")
    around, how = ((1, 2), "wrap") if grid.periodic else ((1, 1), "edge")
    return np.pad(values, ((0, 0), (0, 0), around, (0, 0)), how)  # type: ignore[call-overload, no-any-return]


def shapes(knots: Array, periodic: bool) -> tuple[Array, Array]:
    """Returns of each cell between knots (n,) the polynomials (n, 4 powers, 4 neighbours) that
    weigh its neighbours, its start, and one over its width (n, 2). The last row stands for no
    cell."""
    gaps = np.diff(knots)
    before, after = (gaps[-1], gaps[0]) if periodic else (0.0, 0.0)
    pair = np.concatenate([[before], gaps]) + np.concatenate([gaps, [after]])
    early = gaps / pair[:-1]
    late = gaps / pair[1:]
    none = np.zeros_like(gaps)
    one = np.ones_like(gaps)
    linear = [-early, none, early, none]
    square = [2.0 * early, late - 3.0, 3.0 - 2.0 * early, -late]
    cubic = [-early, 2.0 - late, early - 2.0, late]
    shapes = np.moveaxis(np.array([[none, one, none, none], linear, square, cubic]), -1, 0)
    places = np.stack([knots[:-1], 1.0 / gaps], axis=-1)
    return np.concatenate([shapes, shapes[-1:]]), np.concatenate([places, places[-1:]])


def grid_numbers(
    axes: Sequence[Array],
    values: Array,
    period: float = 0.0,
    product: bool = False,
    root: bool = False,
) -> Array:
    """Returns a grid of values (a, f, d, c) on three axes as the core takes it: `product` says that
    the first one is amplitude times frequency, `root` that the values are square roots."""
    head = [*map(len, axes), period, product, values.shape[-1], root]
    return np.concatenate([np.array(head, np.float64), *axes, values.ravel()])


def size_numbers(size: Callable[[Array, Array], Array], lower: Array, upper: Array) -> Array:
    """Returns the size of a fin's force over amplitude and frequency within limits (3,) as a grid
    for the core, on as few knots as say it: the size or its root, over amplitude or its product
    with frequency."""
    share = np.random.default_rng(0).uniform(size=(300, 3))
    command = lower + share * (upper - lower)
    wanted = size(command[:, 0], command[:, 1])
    best = np.empty(0)
    least = np.inf
    for (cells, more), beat, root in product(_CELLS, (False, True), (True, False)):
        ends = (lower[0] * lower[1], upper[0] * upper[1]) if beat else (lower[0], upper[0])
        # Of the product alone, the frequency does not matter; powers of it bend most near 0.
        axes = [_knots(*ends, cells, 2.0 if beat else 1.0), _knots(lower[1], upper[1], more, 1.0)]
        if beat and more == 1:
            axes[1] = np.array([0.5 * (lower[1] + upper[1])])
        first, second = np.meshgrid(*axes, indexing="ij")
        amplitude = np.abs(first) / np.maximum(np.abs(second), NOTHING) if beat else np.abs(first)
        value = np.maximum(size(amplitude, np.abs(second)), 0.0)
        if root:
            value = np.sqrt(value) * np.sign(first) * (1.0 if beat else np.sign(second))
        at = np.stack(
            [command[:, 0] * command[:, 1] if beat else command[:, 0], command[:, 1], share[:, 2]],
            axis=-1,
        )
        known = [
            np.append(axis, axis + 1.0) if len(axis) == 1 else axis for axis in (*axes, np.zeros(1))
        ]
        values = np.broadcast_to(value[..., None, None], (len(known[0]), len(known[1]), 2, 1))
        got = HermiteGrids([Grid(known, values, False)])(at, 1)[:, 0, 0, 0, 0] ** (2 if root else 1)
        error = float(np.abs(got - wanted).max())
        if error < least:
            least = error
            best = grid_numbers([*axes, np.zeros(1)], value[..., None, None], 0.0, beat, root)
        if error <= NOTHING * wanted.max():
            break
    return best


def _knots(low: float, high: float, cells: int, power: float) -> Array:
    """Knots between two ends, as dense towards the lower one as a power of equal steps, and one
    more on either side: slopes at the ends are as good."""
    width = max(high - low, NOTHING)
    share = (np.arange(cells + 2.0) / cells) ** power
    return low + width * np.concatenate([[-share[1]], share])
