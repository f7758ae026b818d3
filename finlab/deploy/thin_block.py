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
from finlab.core.fields import Record, actuators_of, head_of, tables_begin

TOLERANCE = 1e-5
"""Largest error of the grid of a law, over its largest value."""
CELLS = 128
"""Cells of a table at most; of a foil's angles and lifts twice as many knots."""
POINTS = 64
"""Directions of a gauge at most."""
TABLES = ("force_table", "force_table_reverse", "gauge_table", "law_grid", "command_table")
"""Fields of an actuator that name a table: force over price, the same in reverse, gauge, law, and a
fin's beat or a foil's curve."""
FIN = 2
"""`command_kind` of a fin, FL_FIN."""


class Table(NamedTuple):
    """A table of a block."""

    field: str
    """Which of TABLES names it."""
    numbers: Array


def tables_of(block: Array) -> list[dict[int, Table]]:
    """Returns of each actuator the tables that a block has, by their places."""
    tables = []
    for actuator in actuators_of(block):
        by_place = {}
        for field in TABLES:
            place = int(actuator[field])
            if place > 0:
                length = _length(field, block[place:], is_fin=actuator["command_kind"] == FIN)
                by_place[place] = Table(field, block[place : place + length])
        tables.append(by_place)
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
    for by_place in tables_of(block):
        tables.update(by_place)

    begin = tables_begin(len(actuators))
    thin_tables = []
    moved_to = {0: 0}
    place_new = begin
    for place, table in tables.items():
        thin = _thinned_table(table, actuators[actuators["law_grid"] == place])
        thin_tables.append(thin)
        moved_to[place] = place_new
        place_new += len(thin)

    block = np.concatenate([block[:begin], *thin_tables])
    head_of(block)["length"] = len(block)
    for actuator in actuators_of(block):
        for field in TABLES:
            actuator[field] = moved_to[int(actuator[field])]
        if not actuator["is_free_angle"]:
            actuator["command_min"] = _rounded(actuator["command_min"], up=True)
            actuator["command_max"] = _rounded(actuator["command_max"], up=False)
    return block


def _rounded(limits: Array, up: bool) -> NDArray[np.float32]:
    """Returns limits (3,) in single precision, none outside of what they were."""
    near = limits.astype(np.float32)
    outside = near < limits if up else near > limits
    inward = np.float32(np.inf if up else -np.inf)
    return np.where(outside, np.nextafter(near, inward), near)


def _thinned_table(table: Table, users: Record) -> Array:
    """Returns a table with fewer knots; `users` are the actuators (m,) whose law it is."""
    if table.field in ("force_table", "force_table_reverse"):
        return _radial(table.numbers)
    if table.field == "gauge_table":
        return _gauge(table.numbers)
    if table.field == "law_grid":
        return _grid(table.numbers, users)
    return _curve(table.numbers)


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
        axes[2], value, period = _reached(axes[2], values[0, 0], period, users)
        kept = _angles(axes[2], value, period)
        axes[2] = axes[2][kept]
        values = value[None, None, kept]
    elif values.shape[2:] == (1, 1):
        axes[0], values = _sizes(axes[0], values, 2 if grid[6] else 1)
    return np.concatenate([[*map(len, axes)], [period], grid[4:7], *axes, values.ravel()])


def _reached(knot: Array, value: Array, period: float, foils: Record) -> tuple[Array, Array, float]:
    """Returns the knots that foils reach, and three beyond; all of them where that is no less.

    Args:
        knot: angles (K,) of one period [rad].
        value: coefficients (K, c) there.
        period: of the angles [rad]; 0 for none.
        foils: actuators (m,) whose law it is.

    Returns:
        Knots, values, and their period: 0 where only a part of it is left.
    """
    angle_min = (foils["command_min"][:, 0] - foils["lean_angle"]).min()
    angle_max = (foils["command_max"][:, 0] - foils["lean_angle"]).max()
    around = np.concatenate([knot - period, knot, knot + period])
    begin = np.searchsorted(around, angle_min) - 3
    stop = np.searchsorted(around, angle_max) + 3
    has_room = begin >= 0 and stop <= len(around) and stop - begin < len(knot)
    if not period or foils["command_kind"][0] == FIN or not has_room:
        return knot, value, period
    rows = np.arange(begin, stop)
    return around[rows], value[rows % len(knot)], 0.0


def _angles(knot: Array, value: Array, period: float) -> NDArray[np.intp]:
    """Which knots (K,) of a period, or of an axis where it is 0, say all values (K, c) nearly: more
    and more, where most is missing."""
    kept = np.arange(0, len(knot), max(len(knot) // 16, 1))
    ends = [0, 1, len(knot) - 2, len(knot) - 1]
    kept = kept if period else np.union1d(kept, ends)
    while len(kept) < min(2 * CELLS, len(knot)):
        rows = kept
        around = knot[kept]
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
    """As few of the knots (K,) of sizes (K, f, 1, 1) as do, and one beyond each end for the slope
    there."""
    ends = np.array([1, -2])
    slope = (value[[2, -1]] - value[[0, -3]]).T / (knot[[2, -1]] - knot[[0, -3]])
    wanted = value[1:-1] ** power
    best = (knot, value)
    step = 2
    while (len(knot) - 3) % step == 0:
        x = knot[1:-1][::step]
        v = value[1:-1][::step]
        width = x[ends] - x[[0, -1]]
        low, high = np.split(v[ends] - 2.0 * (slope * width).T, 2)
        x = np.concatenate([x[:1] - width[:1], x, x[-1:] - width[1:]])
        v = np.concatenate([low, v, high])
        miss = np.abs(_cubic(x, v)(knot[1:-1]) ** power - wanted).max()
        if miss > TOLERANCE * max(np.abs(wanted).max(), NOTHING):
            break
        best = (x, v)
        step = 2 * step
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
