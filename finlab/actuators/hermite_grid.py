"""Cubic Hermite interpolation on grids over amplitude, frequency and zero direction: the laws of
fins with tables, and the grids of laws that the core in C takes as rows of numbers.

One grid answers for commands of any shape; n grids side by side answer for those of n fins, each by
its own.

The same interpolation is written in C in `finlab/core/src/command_law.c`, for the grids that
`grid_numbers` makes; `tests/core/test_command_law.py` holds the two together.
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
"""Most by which a value that is meant to be at the edge of a grid may lie outside it [rad, Hz,
rad]."""
SAMPLES = 300
"""Random commands at which a grid of a law is compared with the law."""

_CELL_COUNTS = ((16, 1), (64, 1), (256, 1), (1024, 1), (16, 16), (64, 64))
"""Numbers of cells of amplitude and of frequency that are tried for the law of a fin, in order."""


class Grid(NamedTuple):
    """Values on a grid of commands, of one fin."""

    axes: list[Array]
    """Amplitudes [rad], frequencies [Hz] and zero directions [rad], rising, two points or more
    each."""
    values: Array
    """Values (a, f, d, columns) at the grid's points."""
    periodic: bool
    """Whether the zero directions cover the circle, the first one not repeated at the end."""


class Cells(NamedTuple):
    """The cells between the knots of one axis; one more at the end stands for no cell."""

    polynomials: Array
    """Coefficients (c, 4 powers, 4 neighbours) of the cubics by which the values at four knots
    count."""
    starts: Array
    """First end of each cell, and one over its width (c, 2)."""


class HermiteGrids:
    """Interpolates on one grid, or on n grids with as many columns each.

    Along each axis a cubic polynomial is used between two points, with the slopes of central
    differences at both (Catmull and Rom, 1974, for uneven spacing). Outside a grid its edge counts.
    """

    def __init__(self, grids: list[Grid]) -> None:
        """Prepares the grids."""
        self.grids = grids
        knots = [axis for grid in grids for axis in closed_axes(grid)]
        counts = np.array([len(axis) for axis in knots])
        first = np.array([axis[0] for axis in knots])
        last = np.array([axis[-1] for axis in knots])
        scale = 1.0 / (last - first)

        # All axes are searched together: on one line, on which axis k lies between 2 k and 2 k + 1.
        shift = 2.0 * np.arange(len(knots))
        lines = []
        cells = []
        for k, axis in enumerate(knots):
            lines.append((axis - axis[0]) * scale[k] + shift[k])
            is_direction = k % 3 == 2
            cells.append(cells_of(axis, grids[k // 3].periodic and is_direction))
        self._line = np.concatenate(lines)
        self._polynomials = np.concatenate([each.polynomials for each in cells])
        self._cell_starts = np.concatenate([each.starts for each in cells])

        # The values of all grids below each other, each with a rim of neighbours; a view of four in
        # a row.
        self.columns: int = grids[0].values.shape[-1]
        """How many values each point has."""
        padded = [with_neighbours(grid) for grid in grids]
        flat = np.concatenate([values.reshape(-1, self.columns) for values in padded])
        self._rows = sliding_window_view(flat.ravel(), 4 * self.columns)[:: self.columns]
        stride = np.array(
            [(values.shape[1] * values.shape[2], values.shape[2], 1) for values in padded]
        )
        start = np.cumsum([0, *(values[..., 0].size for values in padded[:-1])])
        four = np.arange(4)
        around = four[:, None] * stride[:, :1, None] + four * stride[:, 1:2, None]

        cells_before = np.cumsum(counts) - counts
        self._first = self._by_grid(first)
        self._last = self._by_grid(last)
        self._scale = self._by_grid(scale)
        self._shift = self._by_grid(shift)
        self._last_cell = self._by_grid(cells_before + counts - 2)
        self._middle = 0.5 * (self._first[..., 2] + self._last[..., 2])
        self._stride = self._by_grid(stride)
        self._start = self._by_grid(start - (cells_before.reshape(-1, 3) * stride).sum(1), count=1)[
            ..., 0
        ]
        self._around = self._by_grid(around.reshape(-1, 16), count=16)

    @staticmethod
    def _by_grid(values: AnyArray, count: int = 3) -> AnyArray:
        """`count` values of each grid (n, count), or (count,) of a single grid, which then
        broadcasts to commands of any shape."""
        rows = values.reshape(-1, count)
        return rows[0] if len(rows) == 1 else rows

    def __call__(self, command: Array, orders: int) -> Array:
        """Interpolates all columns.

        Args:
            command: commands (..., 3), or (..., n, 3) of n grids [rad, Hz, rad].
            orders: 1 for values alone, 2 for derivatives as well.

        Returns:
            (..., orders, orders, orders, columns): by amplitude, frequency and zero direction, in
            each value and, with two orders, derivative.
        """
        cell, weight = self._weights(command, orders)
        corner = (cell * self._stride).sum(-1) + self._start
        grid = self._rows[corner[..., None] + self._around]
        batch = command.shape[:-1]
        in_plane = weight[..., 0, :, None, :, None] * weight[..., 1, None, :, None, :]
        along = in_plane.reshape(*batch, orders**2, 16) @ grid
        along = weight[..., 2, None, :, :] @ along.reshape(*batch, orders**2, 4, self.columns)
        return np.asarray(along.reshape(*batch, orders, orders, orders, self.columns))

    def _weights(self, command: Array, orders: int) -> tuple[NDArray[np.intp], Array]:
        """Cells (..., 3) of commands (..., 3), counted through all axes, and on each axis the
        weights of four neighbours in the value and, with two orders, in the derivative (..., 3,
        orders, 4)."""
        value = np.array(command, np.float64)
        direction = value[..., 2]
        direction -= TURN * np.rint((direction - self._middle) / TURN)
        clipped = np.minimum(np.maximum(value, self._first), self._last)
        on_line = (clipped - self._first) * self._scale + self._shift
        cell = np.minimum(self._line.searchsorted(on_line, side="right") - 1, self._last_cell)
        start = self._cell_starts.take(cell, axis=0)
        dt_dvalue = start[..., 1]
        t = (clipped - start[..., 0]) * dt_dvalue
        t_squared = t * t
        powers = np.zeros((*t.shape, orders, 4))
        powers[..., 0, 0] = 1.0
        powers[..., 0, 1] = t
        powers[..., 0, 2] = t_squared
        np.multiply(t_squared, t, out=powers[..., 0, 3])
        if orders == 2:
            # Beyond the grid the value is constant.
            dt_dvalue = dt_dvalue * (np.abs(clipped - value) <= ROUNDING)
            powers[..., 1, 1] = dt_dvalue
            np.multiply(2.0 * t, dt_dvalue, out=powers[..., 1, 2])
            np.multiply(3.0 * t_squared, dt_dvalue, out=powers[..., 1, 3])
        return cell, powers @ self._polynomials.take(cell, axis=0)


def closed_axes(grid: Grid) -> list[Array]:
    """Returns the axes [rad, Hz, rad], that of a circle with its first direction again one turn
    later."""
    amplitude, frequency, direction = grid.axes
    if grid.periodic:
        direction = np.append(direction, direction[0] + TURN)
    return [amplitude, frequency, direction]


def with_neighbours(grid: Grid) -> Array:
    """Returns the values with a rim of neighbours (a + 2, f + 2, d + 2 or 3, columns), at an edge
    the edge itself: slopes are one-sided there."""
    values = np.pad(grid.values, ((1, 1), (1, 1), (0, 0), (0, 0)), "edge")
    if grid.periodic:
        return np.pad(values, ((0, 0), (0, 0), (1, 2), (0, 0)), "wrap")
    return np.pad(values, ((0, 0), (0, 0), (1, 1), (0, 0)), "edge")


def cells_of(knots: Array, periodic: bool) -> Cells:
    """Returns the cells between knots (n,), rising; `periodic` where the last knot is the first
    one, a turn later."""
    width = np.diff(knots)
    before, after = (width[-1], width[0]) if periodic else (0.0, 0.0)
    # Distance of the neighbours of each knot, over which its slope is taken.
    span = np.concatenate([[before], width]) + np.concatenate([width, [after]])
    m0 = width / span[:-1]
    m1 = width / span[1:]
    zero = np.zeros_like(width)
    one = np.ones_like(width)
    constant = [zero, one, zero, zero]
    linear = [-m0, zero, m0, zero]
    quadratic = [2.0 * m0, m1 - 3.0, 3.0 - 2.0 * m0, -m1]
    cubic = [-m0, 2.0 - m1, m0 - 2.0, m1]
    polynomials = np.moveaxis(np.array([constant, linear, quadratic, cubic]), -1, 0)
    starts = np.stack([knots[:-1], 1.0 / width], axis=-1)
    return Cells(
        np.concatenate([polynomials, polynomials[-1:]]), np.concatenate([starts, starts[-1:]])
    )


def grid_numbers(
    axes: Sequence[Array],
    values: Array,
    period: float = 0.0,
    product: bool = False,
    root: bool = False,
) -> Array:
    """Returns a grid as the core takes it.

    Args:
        axes: three axes (a,), (f,) and (d,) [rad, Hz, rad], rising.
        values: values (a, f, d, columns).
        period: period of the third axis [rad]; 0 where it has none.
        product: whether the first axis is amplitude times frequency [rad Hz].
        root: whether the values are square roots of what is meant.

    Returns:
        Three lengths, period, product, columns and root, then the axes and the values (7 + a + f +
        d + a f d columns,).
    """
    head = [*map(len, axes), period, product, values.shape[-1], root]
    return np.concatenate([np.array(head, np.float64), *axes, values.ravel()])


def size_numbers(size: Callable[[Array, Array], Array], lower: Array, upper: Array) -> Array:
    """Returns the size of a fin's force within its limits as a grid for the core, with as few knots
    as keep it: of the size or its root, over the amplitude or its product with the frequency.

    Args:
        size: the size of the force (...) [N] at amplitudes (...) [rad] and frequencies (...) [Hz].
        lower: least command (3,) [rad, Hz, rad].
        upper: greatest command (3,).
    """
    share = np.random.default_rng(0).uniform(size=(SAMPLES, 3))
    command = lower + share * (upper - lower)
    wanted = size(command[:, 0], command[:, 1])
    best = np.empty(0)
    least_error = np.inf
    for counts, by_product, by_root in product(_CELL_COUNTS, (False, True), (True, False)):
        axes, values = _size_grid(size, lower, upper, counts, by_product, by_root)
        first = command[:, 0] * command[:, 1] if by_product else command[:, 0]
        on_grid = np.stack([first, command[:, 1], share[:, 2]], axis=-1)
        # An axis with a single knot says the same everywhere: here it gets a second one.
        closed = []
        for axis in (*axes, np.zeros(1)):
            closed.append(np.append(axis, axis + 1.0) if len(axis) == 1 else axis)
        shape = (len(closed[0]), len(closed[1]), 2, 1)
        grid = Grid(closed, np.broadcast_to(values, shape), False)
        interpolated = HermiteGrids([grid])(on_grid, 1)[:, 0, 0, 0, 0]
        error = float(np.abs(interpolated ** (2 if by_root else 1) - wanted).max())
        if error < least_error:
            least_error = error
            best = grid_numbers([*axes, np.zeros(1)], values, 0.0, by_product, by_root)
        if error <= NOTHING * wanted.max():
            break
    return best


def _size_grid(
    size: Callable[[Array, Array], Array],
    lower: Array,
    upper: Array,
    counts: tuple[int, int],
    by_product: bool,
    by_root: bool,
) -> tuple[list[Array], Array]:
    """Two axes with `counts` cells, and the size of a fin's force (a, f, 1, 1) at their knots; see
    `size_numbers`. Roots are odd beyond 0, as the size is even, so that slopes at 0 are right."""
    if by_product:
        # Powers of the product bend most near 0. With one cell the frequency does not matter.
        first_axis = _knots(lower[0] * lower[1], upper[0] * upper[1], counts[0], 2.0)
    else:
        first_axis = _knots(lower[0], upper[0], counts[0], 1.0)
    second_axis = _knots(lower[1], upper[1], counts[1], 1.0)
    if by_product and counts[1] == 1:
        second_axis = np.array([0.5 * (lower[1] + upper[1])])
    first, frequency = np.meshgrid(first_axis, second_axis, indexing="ij")
    amplitude = np.abs(first)
    if by_product:
        amplitude = amplitude / np.maximum(np.abs(frequency), NOTHING)
    value = np.maximum(size(amplitude, np.abs(frequency)), 0.0)
    if by_root:
        sign = 1.0 if by_product else np.sign(frequency)
        value = np.sqrt(value) * np.sign(first) * sign
    return [first_axis, second_axis], value[..., None, None]


def _knots(low: float, high: float, cells: int, power: float) -> Array:
    """Knots (cells + 3,) from `low` to `high`, at `power` of equal steps, and one more on either
    side, so that slopes at the ends are central ones."""
    width = max(high - low, NOTHING)
    share = (np.arange(cells + 2.0) / cells) ** power
    return low + width * np.concatenate([[-share[1]], share])
