"""A robot's block of numbers with few knots in its tables, for small boards in single precision.

Forces follow from prices by the tables alone and commands are made exact on the law's grid: only that grid's
error is in the wrench, and it stays below TOLERANCE. Errors of other tables cost power, by their squares.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from finlab.arrays import Array
from finlab.axes import TURN

TOLERANCE = 1e-5
"""Largest error of a law's grid, over its largest value; of other tables where CELLS allow."""
CELLS = 128
"""Cells of a table at most."""
HEAD, EACH = 59, 67
"""Numbers of `fl_head` and of an `fl_actuator` of finlab/core/core.h."""
PLACES = 1, 2, 5, 58, 59
"""Where an actuator names the tables: ahead, in reverse, gauge, law, beat or curve."""
FORM, FIN = 47, 2


def places_of(block: Array) -> Array:
    """Returns where a block names the tables of its n actuators (n, 5), see PLACES."""
    return HEAD + EACH * np.arange(int(block[3]))[:, None] + np.array(PLACES)


def tables_of(block: Array) -> dict[int, tuple[int, Array]]:
    """Returns by its place each table of a block: what it is, by its position in PLACES, and its numbers."""
    found: dict[int, tuple[int, Array]] = {}
    for row in places_of(block):
        fin = block[row[0] - PLACES[0] + FORM] == FIN
        for kind, place in enumerate(block[row].astype(int)):
            if place:
                found[int(place)] = kind, block[place : place + _length(kind, block[place:], bool(fin))]
    return found


def _length(kind: int, at: Array, fin: bool) -> int:
    if kind < 2:
        return 3 + 3 * (int(at[1]) + 1)
    if kind == 3:
        return int(7 + at[:3].sum() + at[:3].prod() * at[5])
    return 1 + (4 if kind == 2 else 2) * int(at[0]) + 2 * (kind == 4 and fin)


def thinned(block: Array) -> Array:
    """Returns a block of the same robot with thinned tables."""
    block, length = block.copy(), HEAD + EACH * int(block[3])
    tables, places, new = tables_of(block), {0: 0}, []
    for place, (kind, numbers) in tables.items():
        places[place] = length + sum(map(len, new))
        new.append((_radial, _radial, _gauge, _grid, _curve)[kind](numbers))
    rows = places_of(block)
    block[rows] = np.vectorize(places.__getitem__)(block[rows].astype(int))
    block = np.concatenate([block[:length], *new])
    block[2] = len(block)
    return block


def _fewest(cells: int, near: Callable[[int], bool]) -> int:
    """The largest step through so many cells that divides them and is near enough, or leaves CELLS of them."""
    step = 1
    while cells % (2 * step) == 0 and (cells // step > CELLS or near(2 * step)):
        step *= 2
    return step


def _near(values: Array, wanted: Array) -> bool:
    return bool((np.abs(values - wanted) <= TOLERANCE * np.abs(wanted).max(axis=0)).all())


def _radial(table: Array) -> Array:
    cells, (force, slope, _) = int(table[1]), table[3:].reshape(-1, 3).T
    price = table[0] * np.linspace(0.0, 1.0, cells + 1) ** 4

    def spline(step: int) -> CubicHermiteSpline:
        chord = np.diff(force[::step]) / np.diff(price[::step])
        most = 3.0 * np.minimum(np.append(chord, chord[-1]), np.insert(chord, 0, chord[0]))
        return CubicHermiteSpline(price[::step], force[::step], np.minimum(slope[::step], most))

    step = _fewest(cells, lambda step: _near(spline(step)(price), force))
    own, at = spline(step), price[::step]
    knots = np.stack([own(at), own(at, 1), own.antiderivative()(at) - table[2]], axis=-1)
    return np.concatenate([[table[0], cells // step, table[2]], knots.ravel()])


def _gauge(table: Array) -> Array:
    points, own = int(table[0]), table[1:].reshape(-1, 4)
    angle, own = np.linspace(0.0, TURN, points + 1), np.append(own, own[:1], axis=0)

    def near(step: int) -> bool:
        support = CubicHermiteSpline(angle[::step], *own[::step, :2].T)(angle)
        lean = np.interp(angle, angle[::step], np.unwrap(own[::step, 3]))
        return _near(support, own[:, 0]) and _near(lean, np.unwrap(own[:, 3]))

    step = _fewest(points, near)
    return np.concatenate([[points // step], own[:-1:step].ravel()])


def _cubic(knot: Array, value: Array) -> CubicHermiteSpline:
    """The cubic of the core between all knots but the first and last one, which give the slopes at the ends."""
    rise = (value[2:] - value[:-2]).T / (knot[2:] - knot[:-2])
    return CubicHermiteSpline(knot[1:-1], value[1:-1], rise.T)


def _grid(grid: Array) -> Array:
    """Fewer angles of a foil, or sizes of a fin; a measured fin keeps its grid."""
    count, columns = grid[:3].astype(int), int(grid[5])
    axes = np.split(grid[7 : 7 + count.sum()], np.cumsum(count)[:-1])
    values = grid[7 + count.sum() :].reshape(*count, columns)
    if count[0] == count[1] == 1 and grid[3] > 0.0:
        kept = _angles(axes[2], values[0, 0], grid[3])
        axes[2], values = axes[2][kept], values[:, :, kept]
    elif columns == 1 and count[2] == 1:
        axes[0], values = _sizes(axes[0], values, 2 if grid[6] else 1)
    return np.concatenate([[*map(len, axes)], grid[3:7], *axes, values.ravel()])


def _angles(knot: Array, value: Array, period: float) -> Array:
    """Of knots (K,) of a period those that say all values (K, c) nearly, as many as CELLS at most: one after the
    other where most is missing."""
    kept = np.arange(0, len(knot), max(len(knot) // 16, 1))
    while len(kept) < min(2 * CELLS, len(knot)):
        before, after = kept[-2:], kept[:2]
        around = np.concatenate([knot[before] - period, knot[kept], knot[after] + period])
        spline = _cubic(around, value[np.concatenate([before, kept, after])])
        miss = (np.abs(spline(knot) - value) / np.abs(value).max(axis=0)).max(axis=1)
        if miss.max() <= TOLERANCE:
            break
        kept = np.sort(np.append(kept, miss.argmax()))
    return kept


def _sizes(knot: Array, value: Array, power: int) -> tuple[Array, Array]:
    """Every so many of the knots (K,) of sizes (K, f, 1, 1), and one beyond each end for the slope there."""
    ends, before = np.array([1, -2]), np.array([2, -1])
    slope = ((value[before] - value[[0, -3]]).T / (knot[before] - knot[[0, -3]])).T

    def thin(step: int) -> tuple[Array, Array]:
        x, v = knot[1:-1][::step], value[1:-1][::step]
        width = x[ends] - x[[0, -1]]
        beyond = v[ends] - 2.0 * (slope.T * width).T
        out = x[[0, -1]] - width
        return np.concatenate([out[:1], x, out[1:]]), np.concatenate([beyond[:1], v, beyond[1:]])

    wanted = value[1:-1] ** power
    return thin(_fewest(len(knot) - 3, lambda step: _near(_cubic(*thin(step))(knot[1:-1]) ** power, wanted)))


def _curve(table: Array) -> Array:
    """Every so many rows of a beat; of pairs in a line the first and the last."""
    rows = table[1:].reshape(-1, 2)
    if len(rows) == table[0] + 1:
        at = np.arange(len(rows))
        lines = lambda step: np.stack([np.interp(at, at[::step], one[::step]) for one in rows.T], axis=-1)
        step = _fewest(len(rows) - 1, lambda step: _near(lines(step), rows))
        return np.concatenate([[(len(rows) - 1) // step], rows[::step].ravel()])
    kept = np.array([0, len(rows) - 1])
    while len(kept) < min(CELLS, len(rows)):
        miss = np.abs(np.interp(rows[:, 0], *rows[kept].T) - rows[:, 1])
        if miss.max() <= TOLERANCE * np.abs(rows[:, 1]).max():
            break
        kept = np.sort(np.append(kept, miss.argmax()))
    return np.concatenate([[len(kept)], rows[kept].ravel()])
