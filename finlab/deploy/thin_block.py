"""A robot's block of numbers with few knots in its tables, for small boards in single precision.

Forces follow from prices by the tables alone and commands are made exact on the law's grid: only that grid's
error is in the wrench, and it stays below TOLERANCE. Errors of other tables cost power, by their squares.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from finlab.actuators.response import table_numbers
from finlab.arrays import Array
from finlab.core.calls import EACH, HEAD
from finlab.precision import NOTHING

TOLERANCE = 1e-5
"""Largest error of the grid of a law, over its largest value."""
CELLS = 128
"""Cells of a table at most; of a foil's angles and lifts twice as many knots."""
POINTS = 64
"""Directions of a gauge at most."""
PLACES = 1, 2, 5, 58, 59
"""Where an `fl_actuator` of core.h names its tables: ahead, in reverse, gauge, law, beat or curve."""
LIMITS, TURNS, FORM, FIN, LAW, LEAN, ANGLES = slice(48, 54), 57, 47, 2, 58, 61, [48, 51]


def tables_of(block: Array) -> list[dict[int, tuple[int, Array]]]:
    """Returns of each actuator the tables that a block has, by their places: what it is, by its position in
    PLACES, and its numbers."""
    rows = block[HEAD : HEAD + EACH * int(block[3])].reshape(-1, EACH)
    return [
        {
            int(row[at]): (
                kind,
                block[int(row[at]) :][: _length(kind, block[int(row[at]) :], row[FORM] == FIN)],
            )
            for kind, at in enumerate(PLACES)
            if row[at]
        }
        for row in rows
    ]


def _length(kind: int, at: Array, fin: bool) -> int:
    if kind < 2:
        return 3 + 3 * (int(at[1]) + 1)
    if kind == 3:
        return int(7 + at[:3].sum() + at[:3].prod() * at[5])
    return 1 + (4 if kind == 2 else 2) * int(at[0]) + 2 * (kind == 4 and fin)


def thinned(block: Array) -> Array:
    """Returns a block of the same robot with thinned tables, whose limits are numbers of single precision,
    none outside those of before but for angles that turn freely."""
    new: list[Array] = []
    length, places = HEAD + EACH * int(block[3]), {0: 0}
    for place, (kind, numbers) in {p: own for row in tables_of(block) for p, own in row.items()}.items():
        places[place] = length + sum(len(table) for table in new)
        parts = block[HEAD:length].reshape(-1, EACH)
        grid = partial(_grid, parts=parts[parts[:, LAW] == place])
        new.append((_radial, _radial, _gauge, grid, _curve)[kind](numbers))
    block = np.concatenate([block[:length], *new])
    block[2] = len(block)
    for row in block[HEAD:length].reshape(-1, EACH):
        row[list(PLACES)] = [places[int(row[at])] for at in PLACES]
        if not row[TURNS]:
            low, high = np.split(row[LIMITS].astype(np.float32), 2)
            row[LIMITS][:3] = np.where(low < row[LIMITS][:3], np.nextafter(low, np.float32(np.inf)), low)
            row[LIMITS][3:] = np.where(high > row[LIMITS][3:], np.nextafter(high, np.float32(-np.inf)), high)
    return block


def _radial(table: Array) -> Array:
    step = max(int(table[1]) // CELLS, 1)
    force, slope, _ = table[3:].reshape(-1, 3)[::step].T
    price = table[0] * np.linspace(0.0, 1.0, len(force)) ** 4
    chord = np.diff(force) / np.diff(price)
    most = 3.0 * np.minimum(np.append(chord, chord[-1]), np.insert(chord, 0, chord[0]))
    return table_numbers(float(table[0]), force, np.minimum(slope, most), float(table[2]))


def _gauge(table: Array) -> Array:
    rows = table[1:].reshape(-1, 4)
    rows = rows[:: max(len(rows) // POINTS, 1)]
    return np.concatenate([[len(rows)], rows.ravel()])


def _cubic(knot: Array, value: Array) -> CubicHermiteSpline:
    """The cubic of the core between all knots but the first and last one, which give the slopes there."""
    rise = (value[2:] - value[:-2]).T / (knot[2:] - knot[:-2])
    return CubicHermiteSpline(knot[1:-1], value[1:-1], rise.T)


def _grid(grid: Array, parts: Array) -> Array:
    """Fewer angles of foils, of those that the commands of these parts (m, EACH) reach, or sizes of a fin; a
    measured fin keeps its grid."""
    count = grid[:3].astype(int)
    axes = np.split(grid[7 : 7 + count.sum()], np.cumsum(count)[:-1])
    values, period = grid[7 + count.sum() :].reshape(*count, -1), grid[3]
    if count[0] == count[1] == 1 < count[2]:
        axes[2], value, period = _reached(axes[2], values[0, 0], period, parts)
        kept = _angles(axes[2], value, period)
        axes[2], values = axes[2][kept], value[None, None, kept]
    elif values.shape[2:] == (1, 1):
        axes[0], values = _sizes(axes[0], values, 2 if grid[6] else 1)
    return np.concatenate([[*map(len, axes)], [period], grid[4:7], *axes, values.ravel()])


def _reached(knot: Array, value: Array, period: float, foils: Array) -> tuple[Array, Array, float]:
    """Knots (K,) and values (K, c) of a period between the angles that foils (m, EACH) reach, and three
    beyond, without a period; all of them where that is no less."""
    angles = foils[:, ANGLES] - foils[:, [LEAN]]
    around = np.concatenate([knot + turn * period for turn in (-1, 0, 1)])
    first, last = np.searchsorted(around, angles.min()) - 3, np.searchsorted(around, angles.max()) + 3
    if not period or foils[0, FORM] == FIN or first < 0 or last > len(around) or last - first >= len(knot):
        return knot, value, period
    rows = np.arange(first, last)
    return around[rows], value[rows % len(knot)], 0.0


def _angles(knot: Array, value: Array, period: float) -> NDArray[np.intp]:
    """Which knots (K,) of a period, or of an axis where it is 0, say all values (K, c) nearly: more and more,
    where most is missing."""
    kept, ends = np.arange(0, len(knot), max(len(knot) // 16, 1)), [0, 1, len(knot) - 2, len(knot) - 1]
    kept = kept if period else np.union1d(kept, ends)
    while len(kept) < min(2 * CELLS, len(knot)):
        rows, around = kept, knot[kept]
        if period:
            rows = np.concatenate([kept[-2:], kept, kept[:2]])
            around = np.concatenate([knot[kept[-2:]] - period, around, knot[kept[:2]] + period])
        miss = np.abs(_cubic(around, value[rows])(knot) - value) / np.abs(value).max(axis=0)
        if not period:
            miss[[0, -1]] = 0.0
        if miss.max() <= TOLERANCE:
            break
        kept = np.sort(np.append(kept, miss.max(axis=1).argmax()))
    return kept


def _sizes(knot: Array, value: Array, power: int) -> tuple[Array, Array]:
    """As few of the knots (K,) of sizes (K, f, 1, 1) as do, and one beyond each end for the slope there."""
    ends, slope = np.array([1, -2]), (value[[2, -1]] - value[[0, -3]]).T / (knot[[2, -1]] - knot[[0, -3]])
    wanted, best, step = value[1:-1] ** power, (knot, value), 2
    while (len(knot) - 3) % step == 0:
        x, v = knot[1:-1][::step], value[1:-1][::step]
        width = x[ends] - x[[0, -1]]
        low, high = np.split(v[ends] - 2.0 * (slope * width).T, 2)
        x = np.concatenate([x[:1] - width[:1], x, x[-1:] - width[1:]])
        v = np.concatenate([low, v, high])
        miss = np.abs(_cubic(x, v)(knot[1:-1]) ** power - wanted).max()
        if miss > TOLERANCE * max(np.abs(wanted).max(), NOTHING):
            break
        best, step = (x, v), 2 * step
    return best


def _curve(table: Array) -> Array:
    """Every so many rows of a beat; of pairs those that say all nearly."""
    rows = table[1:].reshape(-1, 2)
    if len(rows) == table[0] + 1:
        rows = rows[:: max((len(rows) - 1) // CELLS, 1)]
        return np.concatenate([[len(rows) - 1], rows.ravel()])
    kept = np.array([0, len(rows) - 1])
    while len(kept) < min(2 * CELLS, len(rows)):
        miss = np.abs(np.interp(rows[:, 0], *rows[kept].T) - rows[:, 1])
        if miss.max() <= TOLERANCE * np.abs(rows[:, 1]).max():
            break
        kept = np.sort(np.append(kept, miss.argmax()))
    return np.concatenate([[len(kept)], rows[kept].ravel()])
