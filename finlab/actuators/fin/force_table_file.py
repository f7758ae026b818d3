"""The CSV file of a force table: reading it, with a plain sentence for whatever is wrong, and
writing one.

Its columns are A [rad], f [Hz], phi [rad], Fx, Fy, Fz [N] under a header line, and P [W] where the
power is known; A is the half amplitude, phi the zero direction, forces and power are cycle means,
forces in the fin frame (x' shaft, y' horizontal thrust axis, z' up). A fin without P takes the
power of a plate like U-CAT's fin. Standard deviations of the forces (sFx, sFy, sFz) say how far
they may be from the truth. Rows come in any order but must fill a grid: every amplitude with every
frequency with every zero direction. Spacing is free. Lines that begin with # say what to know of
the table; other columns are passed over.
"""

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_model import MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.arrays import Array
from finlab.axes import FILE_TURN_TOLERANCE, TURN
from finlab.bundle_files import read_named_file
from finlab.errors import DataError
from finlab.files.csv_table import CsvTable

COLUMNS = ("A", "f", "phi", "Fx", "Fy", "Fz")
"""Columns of a force table, by name; their order in the file is free."""
POWER_COLUMN = "P"
"""Column of the mean power [W], which may be left out."""
DEVIATIONS = ("sFx", "sFy", "sFz")
"""Columns of the forces' standard deviations [N], which may be left out."""
LEAST, MOST = 1e-6, 1e6
"""Least size of the largest thrust [N], and largest of any force [N] and power [W]."""
LEAST_STEP = 1e-6
"""Least spacing of amplitudes [rad], frequencies [Hz] and zero directions [rad]."""
MAX_BYTES = 25_000_000
"""Largest table that is read [bytes]."""


class ForceTable(NamedTuple):
    """A grid of forces as a file holds it, in the fin's own frame."""

    axes: list[Array]
    """The grid's amplitudes [rad], frequencies [Hz] and zero directions [rad], rising."""
    values: Array
    """Forces [N] and, where it is known, power [W] (a, f, d, 3 or 4)."""
    periodic: bool
    """Whether the zero directions cover the circle; the first one is not there again at the end."""
    notes: tuple[str, ...]
    """What to know of the table, a sentence each."""
    deviation: Array
    """Standard deviations of the forces (a, f, d, 3) [N]; (a, f, d, 0) where they are not known."""


def read_force_table(path: str | os.PathLike[str]) -> ForceTable:
    """Returns the table in a CSV file. Raises DataError: the file is missing, lacks a column, holds
    something that is not a finite number or whose unit cannot be right, its rows do not fill a grid
    with at least two points per axis, or it has no thrust or no power to tell of."""
    source = str(path)
    rows, deviation, lines, notes = _read_rows(table_bytes(path), source)
    _check_units(rows, source)
    axes, values = _grid(np.hstack([rows, deviation]), lines, source)
    periodic, axes[2], values = _close_circle(axes[2], values, source)
    for name, axis in zip(COLUMNS, axes, strict=False):
        if len(axis) < 2:
            raise DataError(
                f"{source}: column {name} has one value, expected at least 2 to interpolate"
            )
        if np.diff(axis).min() < LEAST_STEP:
            raise DataError(
                f"{source}: two values of column {name} are {np.diff(axis).min():.2g} apart, "
                f"expected {LEAST_STEP:g} or more; write equal values with equal digits"
            )
    known = rows.shape[1] - 3
    return ForceTable(axes, values[..., :known], periodic, notes, values[..., known:])


def write_table(
    path: str | os.PathLike[str],
    law: Any,
    amplitude: Array,
    frequency: Array,
    zero_direction: Array,
) -> None:
    """Writes the forces of a law on a grid of amplitude [rad], frequency [Hz] and zero direction
    [rad]."""
    axes = [np.asarray(axis, dtype=np.float64) for axis in (amplitude, frequency, zero_direction)]
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force = law.force(command)
    text = table_text((), COLUMNS, np.hstack([command, force]), digits=10)
    Path(path).write_text(text, encoding="utf-8")


def table_text(
    notes: Iterable[str], header: Sequence[str], rows: Iterable[Any], digits: int
) -> str:
    """Returns the text of a CSV file: notes behind #, a header, rows of numbers with so many
    digits."""
    lines = (",".join(f"{value + 0.0:.{digits}g}" for value in row) for row in rows)
    return "\n".join([*(f"# {note}" for note in notes), ",".join(header), *lines, ""])


def table_bytes(path: str | os.PathLike[str]) -> bytes:
    """Returns the contents of a table's file, which may lie in the zip archive of a bundle. Raises
    DataError: there is no such file, or it is too large."""
    return read_named_file(path, MAX_BYTES, "a CSV table of fin forces")


def _read_rows(
    content: bytes, source: str
) -> tuple[Array, Array, NDArray[np.intp], tuple[str, ...]]:
    """Returns the table (rows, 6 or 7) in the order of `COLUMNS`, with the power behind, the
    standard deviations (rows, 3 or 0), the line (rows,) of the file that each row stands in, and
    the notes above the header."""
    table = CsvTable(content, source)
    header = table.header
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise DataError(
            f"{source}: column {missing[0]} is missing, expected a header with {', '.join(COLUMNS)}"
        )
    if len(set(header)) < len(header):
        raise DataError(f"{source}: a column name appears twice in the header")
    columns = [*COLUMNS, POWER_COLUMN] if POWER_COLUMN in header else [*COLUMNS]
    known = len(columns)
    if set(DEVIATIONS) <= set(header):
        columns += DEVIATIONS
    rows, lines = table.numbers([header.index(name) for name in columns])
    if (rows[:, known:] < 0.0).any():
        raise DataError(
            f"{source}: a column of {', '.join(DEVIATIONS)} has {rows[:, known:].min():.4g}, "
            "expected standard deviations in N from 0"
        )
    return rows[:, :known], rows[:, known:], lines, table.notes


def _check_units(rows: Array, source: str) -> None:
    """Refuse what no fin can do."""
    limits = {
        "A": (MAX_AMPLITUDE + 1e-9, "half amplitudes in rad (not peak to peak)"),
        "f": (MAX_FREQUENCY, "frequencies in Hz (not beats per minute)"),
    }
    if rows.shape[1] > len(COLUMNS):
        limits[POWER_COLUMN] = (MOST, "the mean power in W that drives it")
    for name, (most, unit) in limits.items():
        values = rows[:, (*COLUMNS, POWER_COLUMN).index(name)]
        for end in (values.max(), values.min()):
            if not 0.0 <= end <= most:
                raise DataError(
                    f"{source}: column {name} has {end:.4g}, expected {unit}, 0 to {most:.4g}"
                )
    if rows.shape[1] > len(COLUMNS) and not rows[:, len(COLUMNS)].any():
        raise DataError(
            f"{source}: column P is 0 everywhere; leave it out where the power is not known"
        )
    span = np.ptp(rows[:, 2])
    if span > TURN + FILE_TURN_TOLERANCE:
        raise DataError(
            f"{source}: the zero directions phi span {span:.4g} rad, expected at most one turn "
            "(6.283)"
        )
    largest = np.abs(rows[:, 3:6]).max()
    thrust = np.abs(rows[:, 4:6]).max()
    if largest > MOST or thrust < LEAST:
        raise DataError(
            f"{source}: thrust goes up to {thrust:.3g}, the largest force is {largest:.3g}, "
            f"expected {LEAST:g} to {MOST:g} N"
        )


def _grid(rows: Array, lines: NDArray[np.intp], source: str) -> tuple[list[Array], Array]:
    """Returns the three axes and the values (n_A, n_f, n_phi, columns behind them) of rows that
    fill a grid."""
    uniques = [np.unique(rows[:, i], return_inverse=True) for i in range(3)]
    axes = [values for values, _ in uniques]
    shape = tuple(len(axis) for axis in axes)
    flat_index = np.ravel_multi_index(tuple(inverse.ravel() for _, inverse in uniques), shape)
    order = flat_index.argsort(kind="stable")
    repeated = np.flatnonzero(np.diff(flat_index[order]) == 0)
    if len(repeated):
        first = order[repeated[0]]
        second = order[repeated[0] + 1]
        raise DataError(
            f"{source}: the same A, f, phi appears in two rows, lines {lines[first]} and "
            f"{lines[second]}; keep one"
        )
    if len(flat_index) != math.prod(shape):
        hole = np.flatnonzero(~np.isin(np.arange(math.prod(shape)), flat_index))[0]
        at = ", ".join(
            f"{name} = {axis[i]:.6g}"
            for name, axis, i in zip(COLUMNS, axes, np.unravel_index(hole, shape), strict=False)
        )
        raise DataError(
            f"{source}: {len(rows)} rows do not fill the grid of {shape[0]} amplitudes, {shape[1]} "
            f"frequencies and {shape[2]} zero directions, expected {math.prod(shape)}; the row "
            f"{at} is missing (write equal values with equal digits)"
        )
    values = np.empty((math.prod(shape), rows.shape[1] - 3))
    values[flat_index] = rows[:, 3:]
    return axes, values.reshape(*shape, -1)


def _close_circle(angle: Array, values: Array, source: str) -> tuple[bool, Array, Array]:
    """Returns whether the zero directions cover the circle, and the grid without a repeated end
    point."""
    span = angle[-1] - angle[0]
    if abs(span - TURN) <= FILE_TURN_TOLERANCE:
        forces = values[..., :3]
        scale = np.abs(forces).max()
        if not np.allclose(forces[:, :, 0], forces[:, :, -1], rtol=0.0, atol=0.05 * scale + 1e-12):
            raise DataError(
                f"{source}: forces at phi = {angle[0]:.4g} and one turn later differ; they are "
                "the same"
            )
        return True, angle[:-1], values[:, :, :-1]
    # A full circle given without its end point leaves a last gap like the others.
    closes = len(angle) > 2 and TURN - span <= 1.5 * np.diff(angle).max()
    return bool(closes), angle, values
