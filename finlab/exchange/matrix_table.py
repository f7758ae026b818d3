"""Tables in CSV as plain values: rows of numbers, a row per axis, or a row per thruster."""

import csv
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.labels import axis_of, plain
from finlab.files.csv_table import number_in

FACTORS = ("roll", "pitch", "yaw", "throttle", "forward", "lateral")
"""Columns of motor factors of ArduSub, in the order of its calls."""
Row = tuple[int, list[str]]
"""The number of a line, and its cells."""
MEASURED = {"phi", "pwm", "escsignal", "rpm", "current", "power", "voltage", "t", "time"}
"""Columns of measurements."""
PLACES = {"px", "posx", "dx", "ax", "nx", "ux", *labels.POSITION.split()}
"""Columns by which a table of places is known."""
MAX_ROWS = 1000
"""Most rows and columns that are read; a robot has up to 64 actuators."""
ENDS = {word: "least" for word in labels.LEAST.split()} | {
    word: "most" for word in labels.MOST.split()
}


class Table(NamedTuple):
    """The cells of a CSV file."""

    header: list[str]
    """Names of the columns; empty where the file has none."""
    rows: list[Row]
    comments: list[str]

    @property
    def of_factors(self) -> bool:
        """Whether it holds motor factors."""
        return {*FACTORS} <= {plain(cell) for cell in self.header}


def table_of(text: str) -> Table:
    """Returns the cells of a text whose cells commas, semicolons, tabs or blanks part; lines that
    begin with # or // are comments. Raises LayoutError: it is no table."""
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
    rows = [(i, [cell.strip() for cell in row]) for (i, _), row in zip(lines, cells, strict=True)]
    for _, row in rows:
        while len(row) > 1 and not row[-1]:
            row.pop()
    head = rows[0][1]
    named = (
        not any(map(is_number, head))
        or plain(head[0]) in ("axis", "axes", "dof", "row")
        or not head[0]
    )
    return Table(head, rows[1:], comments) if named else Table([], rows, comments)


def plain_of(table: Table) -> dict[str, Any]:
    """Returns a table as plain values: a matrix, or a mapping for each thruster. Raises
    LayoutError: a row has another length, or a cell that is no number; the row is named."""
    header = table.header
    rows = table.rows
    columns = {plain(cell) for cell in header}
    if measured := MEASURED & {cell.removesuffix("us") for cell in columns}:
        raise LayoutError(
            f"holds measurements ({', '.join(sorted(measured))}); `finlab fit` reads them"
        )
    width = len(header or rows[0][1]) if rows else 0
    named = {"names": header} if header else {}
    if sum(axis_of(row[1][0]) is not None for row in rows) > 1:
        return _by_axis(header, rows, width)
    if sum(axis_of(cell) is not None for cell in header) > 1 or columns & PLACES:
        return {"thrusters": records_of(table)}
    return {**named, "matrix": [_numbers(row, row[1], width) for row in rows]}


def records_of(table: Table) -> list[dict[str, Any]]:
    """Returns each row by the names of its columns; the first that has none is the thruster's name.
    Raises LayoutError: a row has another length, or no number where one is needed."""
    records = []
    for line, row in table.rows:
        if len(row) != len(table.header):
            raise LayoutError(f"row {line} has {len(row)} cells, expected {len(table.header)}")
        cells: dict[str, Any] = {}
        for key, cell in zip(table.header, row, strict=True):
            is_name = plain(key) in labels.NAME.split() or not key
            needed = axis_of(key) or plain(key) in (*ENDS, *FACTORS)
            if needed and cell and not is_name and not is_number(cell):
                raise LayoutError(f"row {line}: {key} is {cell!r:.40}, expected a number")
            cells[key or "name"] = float(cell) if is_number(cell) and not is_name else cell
        records.append(cells)
    return records


def is_robot_table(content: bytes) -> bool:
    """Whether a CSV file holds a robot, and no measurements."""
    try:
        table = table_of(content.decode("utf-8-sig"))
        return table.of_factors or bool(plain_of(table))
    except (LayoutError, UnicodeDecodeError):
        return False


def _by_axis(header: list[str], rows: Sequence[Row], width: int) -> dict[str, Any]:
    """A row for each axis, and perhaps the least and most commands."""
    held: dict[str, list[float]] = {}
    for row in rows:
        label = row[1][0]
        key = axis_of(label) or ENDS.get(plain(label), "")
        if not key or key in held:
            raise LayoutError(
                f"row {row[0]} begins with {label!r:.40}, expected Fx to Tz, least, most once each"
            )
        held[key] = _numbers(row, row[1][1:], width - 1)
    ends: dict[str, Any] = {key: held.pop(key) for key in ("least", "most") if key in held}
    return {**ends, **({"names": header[1:]} if header else {}), "matrix": held}


def _numbers(row: Row, cells: Sequence[str], width: int) -> list[float]:
    if len(cells) != width:
        raise LayoutError(f"row {row[0]} has {len(cells)} numbers, expected {width}")
    for cell in cells:
        if not is_number(cell):
            raise LayoutError(f"row {row[0]}: {cell!r:.40} is no number")
    return [float(cell) for cell in cells]


def is_number(cell: str) -> bool:
    """Whether a cell is a finite number."""
    value = number_in(cell)
    return value is not None and math.isfinite(value)
