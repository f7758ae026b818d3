"""Upper bounds of what a fin with a measured table is worth at prices of its force.

The interpolation of a table is cubic along each axis of a cell, and linear in the table's values:
what a command is worth, price times force less power, is one such polynomial. The largest of its
Bernstein coefficients bounds it from above. Cells that may hold more than the best corner are
halved along all axes (de Casteljau), until bound and corner are close.
"""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.hermite_grid import ROUNDING, cells_of, closed_axes, with_neighbours
from finlab.arrays import CLOSE, NOTHING, ROUNDS, Array
from finlab.axes import TURN

MOST_KEPT = 4096
"""Cells of a table whose coefficients are kept."""
MOST_CELLS = 30_000
"""Cells in work at once: larger tables are bounded price by price; where halving leads to more, it
ends."""
_HALVES = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8.0
_SPLIT = np.concatenate([_HALVES, _HALVES[::-1, ::-1]])
"""Coefficients (4,) of a polynomial to those of both halves of its interval (2 * 4)."""
_EIGHTHS = np.indices((2, 2, 2)).reshape(3, 8).T
"""Which half of a cell each of its eighths is, along each axis (8, 3)."""


class TableBound:
    """What commands of a fin with a table, within limits, are worth at most."""

    def __init__(self, law: TableLaw, lower: Array, upper: Array) -> None:
        """Takes limits (3,) [rad, Hz, rad]."""
        # Directions come first: of them the blade's power does not depend.
        self._values = np.moveaxis(with_neighbours(law.grid), 2, 0)
        self._blade = None if law.has_power else law.blade
        self._axes: list[list[Any]] = []
        each = []
        for k in (2, 0, 1):
            knots = closed_axes(law.grid)[k]
            limits = (float(lower[k]), float(upper[k]))
            *axis, ends = _axis(knots, law.periodic and k == 2, *limits, k == 2)
            self._axes.append(axis)
            each.append(ends)
        index = np.indices([len(ends) for ends in each])
        self._ends = np.stack([ends[i] for ends, i in zip(each, index, strict=True)], axis=-2)
        small = index[0].size <= MOST_KEPT
        self._kept = self._cells(np.eye(self._values.shape[-1])) if small else None

    def __call__(self, price: Array) -> Array:
        """Returns powers (N,) [W] that no command's worth exceeds at prices (N, 3) [W/N] along own
        axes."""
        # Every bound asks for the price 0, too, at which all commands near rest are worth the same:
        # it takes longer than any other.
        is_priced = price.any(axis=1)
        worth = np.full(len(price), np.nan)
        if not is_priced.all():
            worth[~is_priced] = self._at_no_price
        priced = np.flatnonzero(is_priced)
        step = 1 + MOST_CELLS // self._ends[..., 0, 0].size
        for k in range(0, len(priced), step):
            rows = priced[k : k + step]
            worth[rows] = self._block(price[rows])
        return worth

    @cached_property
    def _at_no_price(self) -> float:
        """What commands are worth at most that are paid nothing [W]: less than nothing."""
        return float(self._block(np.zeros((1, 3)))[0])

    def _block(self, price: Array) -> Array:
        factor = np.zeros((len(price) + 1, self._values.shape[-1]))
        # at last power
        factor[:-1, :3] = price
        factor[-1, 3:] = 1.0
        cells = self._cells(factor) if self._kept is None else np.tensordot(factor, self._kept, 1)
        inner = 1, 2, 3
        bound, corner = self._bounds(cells[:-1], cells[-1:], self._ends)
        best = corner.max(axis=inner)
        slack = NOTHING * np.abs(bound).max(axis=inner)
        least = best + CLOSE * np.abs(best) + slack
        left = bound > least[:, None, None, None]
        most = np.maximum(best, np.where(left, -np.inf, bound).max(axis=inner))
        indices: list[NDArray[np.intp]] = list(np.nonzero(left))
        row, *index = indices
        bound = bound[left]
        ends = self._ends[tuple(index)]
        pair = np.stack([cells[(row, *index)], cells[(-1, *index)]], axis=1)
        for _ in range(ROUNDS):
            if not 0 < 8 * len(row) <= MOST_CELLS:
                break
            pair, ends, row = _split(pair, ends, row)
            bound, corner = self._bounds(pair[:, 0], pair[:, 1], ends)
            np.maximum.at(best, row, corner)
            left = bound > (best + CLOSE * np.abs(best) + slack)[row]
            np.maximum.at(most, row[~left], bound[~left])
            pair = pair[left]
            ends = ends[left]
            row = row[left]
            bound = bound[left]
        np.maximum.at(most, row, bound)
        return np.asarray(np.maximum(most, best) + ROUNDING * slack / NOTHING)

    def _cells(self, factor: Array) -> Array:
        """Coefficients (N, d, a, f, 4, 4, 4) of all cells, of the table's columns by factors (N, 3
        or 4)."""
        part = (factor @ self._values.reshape(-1, factor.shape[1]).T).reshape(
            -1, *self._values.shape[:3]
        )
        for (
            near,
            weight,
        ) in self._axes:  # the first of three axes becomes cells and coefficients, and the last
            around = part[:, near]
            own = weight @ around.reshape(*around.shape[:3], -1)
            part = np.moveaxis(own.reshape(len(part), -1, *part.shape[2:]), 1, 3)
        counts = [size for near, _ in self._axes for size in (len(near), 4)]
        return np.ascontiguousarray(part.reshape(-1, *counts).transpose(0, 1, 3, 5, 2, 4, 6))

    def _bounds(self, paid: Array, power: Array, ends: Array) -> tuple[Array, Array]:
        """Bounds (...) of cells with coefficients (..., 4, 4, 4) and ends (..., 3, 2), and their
        best corners (...)."""
        corner = paid[..., ::3, ::3, ::3]
        if self._blade is None:
            # Power is never below 0, whatever the interpolation says.
            least = np.maximum(power[..., ::3, ::3, ::3], 0.0)
            return np.minimum(_largest(paid - power, 3), _largest(paid, 3)), _largest(
                corner - least, 3
            )
        # The blade's power is f^3 g(A) with g convex, a mean of max(0, a A^2 + b A^3) with b >= 0:
        # above the tangent in the middle.
        amplitude = ends[..., 1, :]
        frequency = ends[..., 2, :]
        exact = self._blade.power(amplitude[..., None], frequency[..., None, :])
        middle = amplitude.mean(axis=-1)
        one = np.ones(())
        across = (amplitude[..., 1] - amplitude[..., 0])[..., None] * (np.arange(4) / 3.0 - 0.5)
        slope = self._blade.power_gradient(middle, one)[0][..., None]
        tangent = self._blade.power(middle, one)[..., None] + slope * across
        cubed = frequency[..., :1] ** np.arange(3, -1, -1) * frequency[..., 1:] ** np.arange(4)
        lowest = tangent[..., None] * cubed[..., None, :]
        return _largest(paid.max(axis=-3) - lowest, 2), _largest(corner.max(axis=-3) - exact, 2)


def _largest(values: Array, axes: int) -> Array:
    """The largest ones over the last axes."""
    return np.asarray(values.reshape(*values.shape[:-axes], -1).max(axis=-1))


def _split(
    pair: Array, ends: Array, row: NDArray[np.intp]
) -> tuple[Array, Array, NDArray[np.intp]]:
    """The eighths of cells, each once."""
    for _ in range(3):
        pair = np.tensordot(pair, _SPLIT, ([2], [1]))
    eighths = (
        pair.reshape(-1, 2, 2, 4, 2, 4, 2, 4)
        .transpose(0, 2, 4, 6, 1, 3, 5, 7)
        .reshape(-1, 2, 4, 4, 4)
    )
    first = ends[..., 0]
    last = ends[..., 1]
    middle = 0.5 * (first + last)
    halves = np.stack([np.stack([first, middle], -1), np.stack([middle, last], -1)], axis=-2)
    once = ~((first == last)[:, None] & (_EIGHTHS == 1)).any(axis=-1).ravel()
    ends = halves[:, np.arange(3), _EIGHTHS].reshape(-1, 3, 2)
    return eighths[once], ends[once], row.repeat(8)[once]


def _axis(
    knots: Array, periodic: bool, low: float, high: float, turns: bool
) -> tuple[Any, Array, Array]:
    """Of the cells of an axis with knots (n,), cut at limits: indices (c, 4) of their neighbours
    in a table with a rim, the Bernstein coefficients by the values there (c, 4, 4), and the ends
    (c, 2), twice the first one outside the knots, where the nearer one counts."""
    middle = 0.5 * (knots[0] + knots[-1])
    cuts = knots
    if turns:
        low = low - ROUNDING
        high = high + ROUNDING
        cuts = np.add.outer(TURN * np.arange(-3, 4), np.append(knots, middle + 0.5 * TURN)).ravel()
    cuts = np.unique([low, *cuts[(cuts > low) & (cuts < high)], high])
    ends = np.stack([cuts[:-1], cuts[1:]], axis=-1) if len(cuts) > 1 else np.array([[low, low]])
    if turns:
        ends = ends - TURN * np.rint((ends.mean(axis=1, keepdims=True) - middle) / TURN)
    within = ends.clip(knots[0], knots[-1])
    cell = np.searchsorted(knots, within.mean(axis=1), side="right") - 1
    cell = cell.clip(0, len(knots) - 2)
    cells = cells_of(knots, periodic)
    starts = cells.starts[cell]
    a, b = ((within - starts[:, :1]) * starts[:, 1:]).T
    one = np.ones_like(a)
    # The symmetric form of each power of the place in a cell, at three ends: its Bernstein
    # coefficients.
    blossom = np.array(
        [
            [one, a, a * a, a * a * a],
            [one, (2.0 * a + b) / 3.0, a * (a + 2.0 * b) / 3.0, a * a * b],
            [one, (a + 2.0 * b) / 3.0, b * (2.0 * a + b) / 3.0, a * b * b],
            [one, b, b * b, b * b * b],
        ]
    )
    still = within[:, :1] == within[:, 1:]
    weight = np.moveaxis(blossom, -1, 0) @ cells.polynomials[cell]
    return cell[:, None] + np.arange(4), weight, np.where(still, ends[:, :1], within)
