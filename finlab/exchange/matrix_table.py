"""Tables in CSV as plain values: a matrix, a row for each axis, or a row for each thruster.

`convert` reads a table by `table_of`; `plain_robot` then reads its plain values as it reads those
of YAML and JSON, and `motor_factors` its records. The app asks `is_robot_table` of a dropped file.
"""

import csv
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.labels import axis_of, plain
from finlab.files.csv_table import LENGTHS, number_in

FACTORS = ("roll", "pitch", "yaw", "throttle", "forward", "lateral")
"""Columns of motor factors of ArduSub, in the order of its calls."""
_VOLTAGE = re.compile(r"[@ ]?\b\d+(?:\.\d+)? ?v(?:olts?)?\b", re.IGNORECASE)
"""A voltage in a header."""
MEASUREMENT_COLUMNS = {"phi", "pwm", "escsignal", "rpm", "current", "power", "voltage", "t", "time"}
"""Columns by which a table of measurements is recognized, which `finlab fit` reads."""
VECTOR_COLUMNS = {
    "x",
    "px",
    "posx",
    "xpos",
    "xdir",
    "dirx",
    "dx",
    "ax",
    "nx",
    "ux",
    *labels.POSITION.split(),
}
"""Columns by which a table with a row for each thruster is recognized."""
MAX_ROWS = 1000
"""Most rows and columns that are read; a robot has up to 256 actuators."""
_LIMIT_LABELS = {
    **dict.fromkeys(labels.LOWER_LIMIT.split(), "least"),
    **dict.fromkeys(labels.UPPER_LIMIT.split(), "most"),
}
"""Labels of rows with the limits of commands, to the keys that plain values have for them."""


class Row(NamedTuple):
    """A line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: list[str]


class Table(NamedTuple):
    """The cells of a CSV file."""

    header: list[str]
    """Names of the columns; empty where the file has none."""
    rows: list[Row]
    """All lines but the header, comments and empty ones."""
    comments: list[str]
    """Lines that begin with # or //."""

    @property
    def has_motor_factors(self) -> bool:
        """Whether its header names all motor factors of ArduSub."""
        return {*FACTORS} <= {plain(cell) for cell in self.header}


def table_of(text: str) -> Table:
    """Returns the cells of a text, delimited by commas, semicolons, tabs or blanks.

    The first line is a header where none of its cells is a number.

    Raises:
        LayoutError: it is no table.
    """
    if text.count("\n") > 20 * MAX_ROWS:
        raise LayoutError(
            f"holds {text.count(chr(10)):,} lines, expected a table of up to {MAX_ROWS} rows"
        )
    lines = [
        (i, line.strip()) for i, line in enumerate(text.splitlines(), 1) if line.strip(" \t,;")
    ]
    comments = [line for _, line in lines if line.startswith(("#", "//"))]
    lines = [(i, line) for i, line in lines if not line.startswith(("#", "//"))]
    if not 0 < len(lines) <= MAX_ROWS:
        raise LayoutError(f"holds {len(lines) or 'no'} rows, expected up to {MAX_ROWS}")
    mark = next((mark for mark in ",;\t" if mark in lines[0][1]), " ")
    try:
        cells = [*csv.reader((line for _, line in lines), delimiter=mark, skipinitialspace=True)]
    except csv.Error as error:
        raise LayoutError(f"is no table: {error}") from None
    if len(cells) != len(lines) or max(map(len, cells)) > MAX_ROWS:
        raise LayoutError(
            f"has a cell with line ends inside, or a row of more than {MAX_ROWS} cells"
        )
    rows = []
    for (number, _), row_cells in zip(lines, cells, strict=True):
        stripped = [cell.strip() for cell in row_cells]
        while len(stripped) > 1 and not stripped[-1]:
            stripped.pop()
        rows.append(Row(number, stripped))
    first = rows[0].cells
    has_header = (
        not any(map(is_number, first))
        or plain(first[0]) in ("axis", "axes", "dof", "row")
        or not first[0]
    )
    return Table(first, rows[1:], comments) if has_header else Table([], rows, comments)


def plain_of(table: Table) -> dict[str, Any]:
    """Returns a table as plain values: a matrix, or a mapping for each thruster.

    Raises:
        LayoutError: a row has another length, or a cell that is no number; the row is named.
    """
    header = table.header
    rows = table.rows
    columns = {plain(cell) for cell in header}
    # A column may say at which voltage it was measured: `power 12V`.
    bare = {plain(_VOLTAGE.sub("", cell)) for cell in header}
    measured = MEASUREMENT_COLUMNS & {cell.removesuffix("us") for cell in columns | bare}
    if measured:
        raise LayoutError(
            f"holds measurements ({', '.join(sorted(measured))}); `finlab fit` reads them"
        )
    width = len(header or rows[0].cells) if rows else 0
    axes_of_rows = sum(axis_of(row.cells[0]) is not None for row in rows)
    if axes_of_rows > 1:
        return _by_axis(header, rows, width)
    axes_of_columns = sum(axis_of(cell) is not None for cell in header)
    vectors = " ".join(VECTOR_COLUMNS)
    has_vectors = any(labels.is_key_of(cell, vectors, LENGTHS) for cell in header)
    if axes_of_columns > 1 or has_vectors:
        return {"thrusters": records_of(table)}
    names = {"names": header} if header else {}
    return {**names, "matrix": [_numbers(row.line, row.cells, width) for row in rows]}


def records_of(table: Table) -> list[dict[str, Any]]:
    """Returns each row by the names of its columns; a column without one has the thruster's name.

    Raises:
        LayoutError: a row has another length, or no number where one is needed.
    """
    records = []
    for row in table.rows:
        if len(row.cells) != len(table.header):
            raise LayoutError(
                f"row {row.line} has {len(row.cells)} cells, expected {len(table.header)}"
            )
        record: dict[str, Any] = {}
        for key, cell in zip(table.header, row.cells, strict=True):
            is_name = plain(key) in labels.NAME.split() or not key
            needs_number = axis_of(key) or plain(key) in (*_LIMIT_LABELS, *FACTORS)
            if needs_number and cell and not is_name and not is_number(cell):
                raise LayoutError(f"row {row.line}: {key} is {cell!r:.40}, expected a number")
            record[key or "name"] = float(cell) if is_number(cell) and not is_name else cell
        records.append(record)
    return records


def is_robot_table(content: bytes) -> bool:
    """Whether a CSV file holds a robot, and no measurements."""
    try:
        table = table_of(content.decode("utf-8-sig"))
        return table.has_motor_factors or bool(plain_of(table))
    except (LayoutError, UnicodeDecodeError):
        return False


def _by_axis(header: list[str], rows: Sequence[Row], width: int) -> dict[str, Any]:
    """A matrix with a row for each axis, perhaps with the least and most commands; a label stands
    before the numbers (width - 1) of each row."""
    matrix: dict[str, list[float]] = {}
    for row in rows:
        label, *cells = row.cells
        key = axis_of(label) or _LIMIT_LABELS.get(plain(label), "")
        if not key or key in matrix:
            raise LayoutError(
                f"row {row.line} begins with {label!r:.40}, expected Fx to Tz, least, most once "
                "each"
            )
        matrix[key] = _numbers(row.line, cells, width - 1)
    values: dict[str, Any] = {}
    for key in ("least", "most"):
        if key in matrix:
            values[key] = matrix.pop(key)
    if header:
        values["names"] = header[1:]
    return {**values, "matrix": matrix}


def _numbers(line: int, cells: Sequence[str], width: int) -> list[float]:
    """The numbers (width,) in the cells of a line."""
    if len(cells) != width:
        raise LayoutError(f"row {line} has {len(cells)} numbers, expected {width}")
    for cell in cells:
        if not is_number(cell):
            raise LayoutError(f"row {line}: {cell!r:.40} is no number")
    return [float(cell) for cell in cells]


def is_number(cell: str) -> bool:
    """Whether a cell is a finite number."""
    value = number_in(cell)
    return value is not None and math.isfinite(value)
