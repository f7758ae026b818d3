"""A robot's block of numbers with few knots in its tables, for small boards in single precision.

Forces follow from prices by the tables alone and commands are made exact on the law's grid: only
that grid's error is in the wrench, and it stays below TOLERANCE. Errors of other tables cost power,
by their squares.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from finlab.actuators.response import table_numbers
from finlab.arrays import NOTHING, Array
from finlab.core.fields import Record, actuators_of, constant, head_of, tables_begin

TOLERANCE = 1e-5
"""Largest error of the grid of a law, over its largest value."""
CELLS = 128
"""Most cells of a table; of a foil's angles and lifts twice as many knots."""
POINTS = 64
"""Most directions of a gauge."""
ANGLES = 1024
"""Angles over its period from which those of a grid of foils are chosen; more say nothing in single
precision."""
TABLES = ("force_table", "force_table_reverse", "gauge_table", "law_grid", "command_table")
"""Fields of an actuator that name a table: force over price, the same in reverse, gauge, law, and a
fin's beat or a foil's curve."""


class Table(NamedTuple):
    """A table of a block."""

    field: str
    """Which of TABLES names it."""
    numbers: Array


def tables_of(block: Array) -> list[dict[int, Table]]:
    """Returns the tables that a block has of each actuator, by their offsets."""
    tables = []
    for actuator in actuators_of(block):
        by_offset = {}
        for field in TABLES:
            offset = int(actuator[field])
            if offset > 0:
                is_fin = actuator["command_kind"] == constant("FL_FIN")
                length = _length(field, block[offset:], is_fin)
                by_offset[offset] = Table(field, block[offset : offset + length])
        tables.append(by_offset)
    return tables


def _length(field: str, table: Array, is_fin: bool) -> int:
    """Returns how many numbers a table has, by its first ones (see fl_work.h)."""
    if field in ("force_table", "force_table_reverse"):
        cells = int(table[1])
        return 3 + 3 * (cells + 1)
    if field == "gauge_table":
        points = int(table[0])
        return 1 + 4 * points
    if field == "law_grid":
        knots = table[:3]
        columns = table[5]
        return int(7 + knots.sum() + knots.prod() * columns)
    rows = int(table[0])
    if is_fin:
        rows += 1  # a beat counts its cells
    return 1 + 2 * rows


def thinned(block: Array) -> Array:
    """Returns a block of the same robot for single precision.

    Its tables have fewer knots. Its limits are numbers of single precision, none outside those of
    before but for angles that turn freely.
    """
    actuators = actuators_of(block)
    tables: dict[int, Table] = {}
    for by_offset in tables_of(block):
        tables.update(by_offset)

    begin = tables_begin(len(actuators))
    thin_tables = []
    new_offset = {0: 0}
    offset_new = begin
    for offset, table in tables.items():
        thin = _thinned_table(table, actuators[actuators[table.field] == offset])
        thin_tables.append(thin)
        new_offset[offset] = offset_new
        offset_new += len(thin)

    block = np.concatenate([block[:begin], *thin_tables])
    head_of(block)["length"] = len(block)
    for actuator in actuators_of(block):
        for field in TABLES:
            actuator[field] = new_offset[int(actuator[field])]
        if not actuator["is_free_angle"]:
            actuator["command_min"] = _rounded(actuator["command_min"], up=True)
            actuator["command_max"] = _rounded(actuator["command_max"], up=False)
    return block


def _rounded(limits: Array, up: bool) -> NDArray[np.float32]:
    """Returns limits (3,) in single precision, none outside of what they were."""
    rounded = limits.astype(np.float32)
    outside = rounded < limits if up else rounded > limits
    inward = np.float32(np.inf if up else -np.inf)
    return np.where(outside, np.nextafter(rounded, inward), rounded)


def _thinned_table(table: Table, users: Record) -> Array:
    """Returns a table with fewer knots; `users` are the actuators (m,) that have it."""
    if table.field in ("force_table", "force_table_reverse"):
        return _radial(table.numbers)
    if table.field == "gauge_table":
        return _gauge(table.numbers)
    if table.field == "law_grid":
        return _grid(table.numbers, users)
    return _curve(table.numbers)


def _radial(table: Array) -> Array:
    """A table of force over price with every so many of its knots; slopes are limited so that the
    cubic between two knots stays monotonic."""
    step = max(int(table[1]) // CELLS, 1)
    force, slope, _ = table[3:].reshape(-1, 3)[::step].T
    price = table[0] * np.linspace(0.0, 1.0, len(force)) ** 4
    chord = np.diff(force) / np.diff(price)
    slope_max = 3.0 * np.minimum(np.append(chord, chord[-1]), np.insert(chord, 0, chord[0]))
    return table_numbers(float(table[0]), force, np.minimum(slope, slope_max), float(table[2]))


def _gauge(table: Array) -> Array:
    """A gauge with every so many of its directions."""
    rows = table[1:].reshape(-1, 4)
    rows = rows[:: max(len(rows) // POINTS, 1)]
    return np.concatenate([[len(rows)], rows.ravel()])


def _cubic(knot: Array, value: Array) -> CubicHermiteSpline:
    """The cubic of the core between all knots but the first and last one, which give the slopes
    there."""
    rise = (value[2:] - value[:-2]).T / (knot[2:] - knot[:-2])
    return CubicHermiteSpline(knot[1:-1], value[1:-1], rise.T)


def _grid(grid: Array, users: Record) -> Array:
    """Fewer angles of foils, of those that the commands of the grid's users (m,) reach, or sizes of
    a fin; a measured fin keeps its grid."""
    count = grid[:3].astype(int)
    axes = np.split(grid[7 : 7 + count.sum()], np.cumsum(count)[:-1])
    values = grid[7 + count.sum() :].reshape(*count, -1)
    period = grid[3]
    if count[0] == count[1] == 1 < count[2]:
        step = max(count[2] // ANGLES, 1)
        axes[2], value, period = _reached(axes[2][::step], values[0, 0, ::step], period, users)
        chosen = _angles(axes[2], value, period)
        axes[2] = axes[2][chosen]
        values = value[None, None, chosen]
    elif values.shape[2:] == (1, 1):
        axes[0], values = _sizes(axes[0], values, 2 if grid[6] else 1)
    return np.concatenate([[*map(len, axes)], [period], grid[4:7], *axes, values.ravel()])


def _reached(knot: Array, value: Array, period: float, users: Record) -> tuple[Array, Array, float]:
    """Returns the knots that rudders reach, and three beyond; all of them where that is no less,
    and of a grid of fins.

    Args:
        knot: angles (K,) of one period [rad].
        value: coefficients (K, c) there.
        period: of the angles [rad]; 0 for none.
        users: actuators (m,) whose law it is, all of one kind.

    Returns:
        Knots, values, and their period: 0 where only a part of it is left.
    """
    # The first user speaks for all: a law's columns are coefficients of foils, forces of fins or
    # those behind propellers, so that users of one grid share a kind. A fin's angle is number 2 of
    # its command and may go all round, so that a fin reaches each knot; the angle of a rudder is
    # number 0, within limits.
    is_of_fins = users["command_kind"][0] == constant("FL_FIN")
    if is_of_fins:
        return knot, value, period
    angle_min = (users["command_min"][:, 0] - users["lean_angle"]).min()
    angle_max = (users["command_max"][:, 0] - users["lean_angle"]).max()
    around = knot
    if period:
        around = np.concatenate([knot - period, knot, knot + period])
    begin = np.searchsorted(around, angle_min) - 3
    stop = np.searchsorted(around, angle_max) + 3
    has_room = begin >= 0 and stop <= len(around) and stop - begin < len(knot)
    if not has_room:
        return knot, value, period
    rows = np.arange(begin, stop)
    return around[rows], value[rows % len(knot)], 0.0


def _angles(knot: Array, value: Array, period: float) -> NDArray[np.intp]:
    """Indices of few knots whose cubic is within TOLERANCE of all values; knots are added where the
    error is largest.

    Args:
        knot: angles (K,) [rad].
        value: coefficients (K, c) there.
        period: of the angles [rad]; 0 for none.
    """
    chosen = np.arange(0, len(knot), max(len(knot) // 16, 1))
    edges = [0, 1, len(knot) - 2, len(knot) - 1]
    chosen = chosen if period else np.union1d(chosen, edges)
    while len(chosen) < min(2 * CELLS, len(knot)):
        rows = chosen
        neighbours = knot[chosen]
        if period:
            rows = np.concatenate([chosen[-2:], chosen, chosen[:2]])
            neighbours = np.concatenate(
                [knot[chosen[-2:]] - period, neighbours, knot[chosen[:2]] + period]
            )
        error = np.abs(_cubic(neighbours, value[rows])(knot) - value) / np.abs(value).max(axis=0)
        if not period:
            error[[0, -1]] = 0.0
        if error.max() <= TOLERANCE:
            break
        chosen = np.sort(np.append(chosen, error.max(axis=1).argmax()))
    return chosen


def _sizes(knot: Array, value: Array, power: int) -> tuple[Array, Array]:
    """Knots and values of a fin's law with as few of its sizes as are within TOLERANCE, and one
    knot beyond each end for the slope there.

    Args:
        knot: sizes of the beat (K,).
        value: forces (K, f, 1, 1) there.
        power: the power of the values by which the error is measured.
    """
    edges = np.array([1, -2])
    slope = (value[[2, -1]] - value[[0, -3]]).T / (knot[[2, -1]] - knot[[0, -3]])
    target = value[1:-1] ** power
    best = (knot, value)
    step = 2
    while (len(knot) - 3) % step == 0:
        x = knot[1:-1][::step]
        v = value[1:-1][::step]
        width = x[edges] - x[[0, -1]]
        low, high = np.split(v[edges] - 2.0 * (slope * width).T, 2)
        x = np.concatenate([x[:1] - width[:1], x, x[-1:] - width[1:]])
        v = np.concatenate([low, v, high])
        error = np.abs(_cubic(x, v)(knot[1:-1]) ** power - target).max()
        if error > TOLERANCE * max(np.abs(target).max(), NOTHING):
            break
        best = (x, v)
        step = 2 * step
    return best


def _curve(table: Array) -> Array:
    """A beat with every so many of its rows; or a curve with the rows between which the others are
    within TOLERANCE of straight lines."""
    rows = table[1:].reshape(-1, 2)
    if len(rows) == table[0] + 1:
        rows = rows[:: max((len(rows) - 1) // CELLS, 1)]
        return np.concatenate([[len(rows) - 1], rows.ravel()])
    chosen = np.array([0, len(rows) - 1])
    while len(chosen) < min(2 * CELLS, len(rows)):
        error = np.abs(np.interp(rows[:, 0], *rows[chosen].T) - rows[:, 1])
        if error.max() <= TOLERANCE * np.abs(rows[:, 1]).max():
            break
        chosen = np.sort(np.append(chosen, error.argmax()))
    return np.concatenate([[len(chosen)], rows[chosen].ravel()])
