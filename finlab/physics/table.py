"""A fin model that is a table of forces, measured in a tank or computed by CFD; `table_file` reads it.

Between the grid's points a cubic Hermite polynomial is used along each axis, so forces, power and their
derivatives are continuous. When the zero directions cover the circle the table is periodic. Amplitudes and
frequencies beyond the table count as its edge.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from finlab.arrays import Array, Values, library_of
from finlab.layout.angles import TURN
from finlab.physics.fin_law import FinLaw


class TableLaw(FinLaw):
    """Interpolates forces and power on a grid of amplitude, frequency and zero direction; see `FinLaw`."""

    uniform = False

    def __init__(self, axes: list[Array], values: Array, periodic: bool, notes: tuple[str, ...] = ()) -> None:
        """Takes the grid's axes [rad, Hz, rad], rising, two points or more each, and what was measured
        (a, f, d, 3 or 4): forces [N], and power [W] where it is known.

        A periodic grid's zero directions cover the circle, without the first one again at the end.
        """
        self.periodic = periodic
        self.notes = notes
        """What to know of the table, a sentence each."""
        turn = np.append(axes[2], axes[2][0] + TURN) if periodic else axes[2]
        self.covers = tuple((float(axis[0]), float(axis[-1])) for axis in axes)
        """First and last amplitude [rad], frequency [Hz] and zero direction [rad] of the grid."""
        self._cells = _Cells([axes[0], axes[1], turn], periodic)
        # A view in which each cell holds its own 64 neighbours. At an edge the missing one is the edge
        # itself, which makes its slope one-sided.
        values = np.pad(values, ((1, 1), (1, 1), (0, 0), (0, 0)), "edge")
        around, how = ((1, 2), "wrap") if periodic else ((1, 1), "edge")
        values = np.pad(values, ((0, 0), (0, 0), around, (0, 0)), how)  # type: ignore[call-overload]
        self._neighbours = np.moveaxis(sliding_window_view(values, (4, 4, 4), (0, 1, 2)), 3, -1)

    @property
    def has_power(self) -> bool:
        """Whether the table says what power the fin takes."""
        return bool(self._neighbours.shape[-1] > 3)

    def force(self, command: Values) -> Values:
        """See `FinLaw`. Tensors are answered, too, but nothing is differentiated through the table."""
        xp = library_of(command)
        if xp is not np:
            values = self.force(command.detach().cpu().numpy())
            return xp.from_numpy(np.ascontiguousarray(values)).to(command)
        return self._interpolated(command, 1)[..., 0, 0, 0, :3].astype(command.dtype, copy=False)

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        """See `FinLaw`; exact derivatives of the interpolation."""
        found = self._interpolated(command, 2)[..., :3]
        return found[..., 0, 0, 0, :], _slopes(found)

    def power(self, command: Values, copper_loss: float = 0.0) -> Values:
        """See `FinLaw`. Measured power is told as it is, whatever the loss."""
        if not self.has_power:
            return super().power(command, copper_loss)
        # A polynomial through points near zero may dip below.
        return np.maximum(self._interpolated(command, 1)[..., 0, 0, 0, 3], 0.0)

    def power_slopes(self, command: Array, copper_loss: float = 0.0) -> Array:
        """See `FinLaw`."""
        if not self.has_power:
            return super().power_slopes(command, copper_loss)
        found = self._interpolated(command, 2)[..., 3:]
        return _slopes(found)[..., 0] * (found[..., 0, 0, 0, :] > 0.0)

    def _interpolated(self, command: Array, orders: int) -> Array:
        """All columns of the table at commands (..., 3): values, and with two orders derivatives too.

        Returns:
            (..., orders, orders, orders, 3 or 4): by amplitude, by frequency, by zero direction.
        """
        cell, weight = self._cells.weights(command, orders)
        grid = self._neighbours[cell[..., 0], cell[..., 1], cell[..., 2]]
        rows, columns = command.shape[:-1], grid.shape[-1]
        both = weight[..., 0, :, None, :, None] * weight[..., 1, None, :, None, :]
        along = both.reshape(*rows, orders**2, 16) @ grid.reshape(*rows, 16, 4 * columns)
        along = weight[..., 2, None, :, :] @ along.reshape(*rows, orders**2, 4, columns)
        found: Array = along.reshape(*rows, orders, orders, orders, columns)
        return found


def _slopes(found: Array) -> Array:
    """First derivatives (..., 3 commands, c) of values and mixed derivatives (..., 2, 2, 2, c)."""
    by = found[..., 1, 0, 0, :], found[..., 0, 1, 0, :], found[..., 0, 0, 1, :]
    return np.stack(by, axis=-2)


class _Cells:
    """The cells between the points of three axes, and the cubic Hermite weights of each one's neighbours.

    Values on all three axes are looked up together: on one line where axis k lies between 2 k and 2 k + 1.
    """

    def __init__(self, axes: list[Array], periodic: bool) -> None:
        self._periodic = periodic
        self._first = np.array([axis[0] for axis in axes])
        self._last = np.array([axis[-1] for axis in axes])
        self._scale, self._shift = 1.0 / (self._last - self._first), 2.0 * np.arange(3)
        places = [(axis - axis[0]) * scale for axis, scale in zip(axes, self._scale, strict=True)]
        self._line = np.concatenate([place + shift for place, shift in zip(places, self._shift, strict=True)])
        counts = np.array([len(axis) for axis in axes])
        self._before = np.cumsum(counts) - counts
        self._last_cell = self._before + counts - 2
        shapes = [_shapes(axis, periodic and k == 2) for k, axis in enumerate(axes)]
        self._shapes = np.concatenate([shape for shape, _ in shapes])
        self._places = np.concatenate([place for _, place in shapes])

    def weights(self, command: Array, orders: int) -> tuple[NDArray[np.intp], Array]:
        """Returns the cells (..., 3) of commands (..., 3), and on each axis the weights of four neighbours in
        the value and, with two orders, in the derivative (..., 3, orders, 4)."""
        value = np.array(command, np.float64)
        direction = value[..., 2]
        if self._periodic:
            direction -= self._first[2]
            np.mod(direction, TURN, out=direction)
            direction += self._first[2]
        else:  # whole turns: an end stays the end
            direction -= TURN * np.rint((direction - 0.5 * (self._first[2] + self._last[2])) / TURN)
        held = np.minimum(np.maximum(value, self._first), self._last)
        place = (held - self._first) * self._scale + self._shift
        cell = np.minimum(self._line.searchsorted(place, side="right") - 1, self._last_cell)
        start = self._places.take(cell, axis=0)
        pace = start[..., 1]
        t = (held - start[..., 0]) * pace
        squared = t * t
        powers = np.zeros((*t.shape, orders, 4))
        powers[..., 0, 0], powers[..., 0, 1], powers[..., 0, 2] = 1.0, t, squared
        np.multiply(squared, t, out=powers[..., 0, 3])
        if orders == 2:
            pace = pace * (held == value)  # beyond the table nothing changes any more
            powers[..., 1, 1] = pace
            np.multiply(2.0 * t, pace, out=powers[..., 1, 2])
            np.multiply(3.0 * squared, pace, out=powers[..., 1, 3])
        return cell - self._before, powers @ self._shapes.take(cell, axis=0)


def _shapes(knots: Array, periodic: bool) -> tuple[Array, Array]:
    """Of each cell between knots (n,): the polynomials (n, 4 powers, 4 neighbours) that weigh its neighbours,
    where it starts, and one over its width (n, 2). The last row stands for no cell.

    The slope at a knot is that of the line through its neighbours.
    """
    gaps = np.diff(knots)
    before, after = (gaps[-1], gaps[0]) if periodic else (0.0, 0.0)
    pair = np.concatenate([[before], gaps]) + np.concatenate([gaps, [after]])
    early, late = gaps / pair[:-1], gaps / pair[1:]
    none, one = np.zeros_like(gaps), np.ones_like(gaps)
    shapes = np.array(
        [
            [none, one, none, none],
            [-early, none, early, none],
            [2.0 * early, late - 3.0, 3.0 - 2.0 * early, -late],
            [-early, 2.0 - late, early - 2.0, late],
        ]
    )
    shapes = np.moveaxis(shapes, -1, 0)
    places = np.stack([knots[:-1], 1.0 / gaps], axis=-1)
    return np.concatenate([shapes, shapes[-1:]]), np.concatenate([places, places[-1:]])
