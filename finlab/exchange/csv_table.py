"""Tables in CSV as plain values: rows of numbers, a row per axis, or a row per thruster."""

import csv
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.labels import axis_of, plain

FACTORS = ("roll", "pitch", "yaw", "throttle", "forward", "lateral")
"""Columns of motor factors of ArduSub, in the order of its calls."""
Row = tuple[int, list[str]]
"""The number of a line, and its cells."""
MEASURED = {"phi", "pwm", "escsignal", "rpm", "current", "power", "voltage", "t", "time"}
"""Columns of measurements."""
MAX_ROWS = 1000
"""Most rows that are read; a robot has up to 64 actuators."""
LEAST, MOST = labels.LEAST.split(), labels.MOST.split()


class Table(NamedTuple):
    """The cells of a CSV file."""

    header: list[str]
    """Names of the columns; empty where the file has none."""
    rows: list[Row]
    comments: list[str]


def table_of(text: str) -> Table:
    """Returns the cells of a text whose cells commas, semicolons, tabs or blanks part; lines that begin
    with # or // are comments.

    Raises:
        LayoutError: it is no table.
    """
    if text.count("\n") > 20 * MAX_ROWS:
        raise LayoutError(f"holds {text.count(chr(10)):,} lines, expected a table of up to {MAX_ROWS} rows")
    lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in lines if line.startswith(("#", "//"))]
    lines = [(i, line) for i, line in lines if not line.startswith(("#", "//"))]
    if not 0 < len(lines) <= MAX_ROWS:
        raise LayoutError(f"holds {len(lines) or 'no'} rows, expected up to {MAX_ROWS}")
    mark = next((mark for mark in ",;\t" if mark in lines[0][1]), " ")
    try:
        cells = [*csv.reader((line for _, line in lines), delimiter=mark, skipinitialspace=True)]
    except csv.Error as error:
        raise LayoutError(f"is no table: {error}") from None
    if len(cells) != len(lines):
        raise LayoutError("has a cell with line ends inside, expected a row per line")
    rows = [(i, _stripped(row)) for (i, _), row in zip(lines, cells, strict=True)]
    rows = [row for row in rows if row[1]]
    head = rows[0][1] if rows else []
    named = bool(head) and not any(map(is_number, head))
    named |= bool(head) and plain(head[0]) in ("", "axis", "axes", "dof", "row") and not is_number(head[0])
    return Table(head, rows[1:], comments) if named else Table([], rows, comments)


def plain_of(table: Table) -> dict[str, Any]:
    """Returns a table as plain values: a matrix, or a mapping for each thruster.

    Raises:
        LayoutError: a row has another length, or a cell that is no number; the row is named.
    """
    header, rows = table.header, table.rows
    measured = MEASURED & {plain(cell).removesuffix("us") for cell in header}
    if measured:
        raise LayoutError(f"holds measurements ({', '.join(sorted(measured))}); `finlab fit` reads them")
    labelled = [row for row in rows if axis_of(row[1][0])]
    if len(labelled) > 1 and not is_number(rows[0][1][0]):
        return _by_axis(header, rows)
    axes = [axis for cell in header if (axis := axis_of(cell))]
    if len(axes) > 1 or {plain(cell) for cell in header} & {
        "px",
        "posx",
        "dx",
        "ax",
        "nx",
        "ux",
        *labels.POSITION.split(),
    }:
        return {"thrusters": [_record(header, row) for row in rows]}
    width = len(header or rows[0][1]) if rows else 0
    named = {"names": header} if header else {}
    return {**named, "matrix": [_numbers(row, row[1], width) for row in rows]}


def is_robot_table(content: bytes) -> bool:
    """Whether a CSV file holds a robot, and no measurements."""
    try:
        text = content.decode("utf-8-sig")
        return is_factor_table(text) or bool(plain_of(table_of(text)))
    except (LayoutError, UnicodeDecodeError):
        return False


def is_factor_table(text: str) -> bool:
    """Whether a text begins with the header of a table of motor factors."""
    stripped = (line.strip() for line in text[:10_000].splitlines())
    lines = (line for line in stripped if line and not line.startswith(("#", "//")))
    return {*FACTORS} <= {plain(cell) for cell in re.split(r"[,;\t ]+", next(lines, ""))}


def _by_axis(header: list[str], rows: Sequence[Row]) -> dict[str, Any]:
    """A row for each axis, and perhaps the least and most commands."""
    width = len(header or rows[0][1]) - 1
    matrix: dict[str, list[float]] = {}
    ends: dict[str, list[float]] = {}
    for row in rows:
        label, cells = row[1][0], _numbers(row, row[1][1:], width)
        key = axis_of(label) or ("least" if plain(label) in LEAST else "most" if plain(label) in MOST else "")
        if not key or key in (matrix | ends):
            raise LayoutError(
                f"row {row[0]} begins with {label!r:.40}, expected Fx to Tz, least, most once each"
            )
        (ends if key in ("least", "most") else matrix)[key] = cells
    return {**ends, **({"names": header[1:]} if header else {}), "matrix": matrix}


def _record(header: list[str], row: Row) -> dict[str, Any]:
    """A thruster's row by the names of its columns; a column without numbers has its name."""
    if len(row[1]) != len(header):
        raise LayoutError(f"row {row[0]} has {len(row[1])} cells, expected {len(header)}")
    cells: dict[str, Any] = {}
    for key, cell in zip(header, row[1], strict=True):
        is_name = plain(key) in labels.NAME.split() or not key
        if not is_name and cell and not is_number(cell) and (axis_of(key) or plain(key) in (*LEAST, *MOST)):
            raise LayoutError(f"row {row[0]}: {key} is {cell!r:.40}, expected a number")
        cells[key or "name"] = float(cell) if is_number(cell) and not is_name else cell
    return cells


def _numbers(row: Row, cells: Sequence[str], width: int) -> list[float]:
    if len(cells) != width:
        raise LayoutError(f"row {row[0]} has {len(cells)} numbers, expected {width}")
    wrong = next((cell for cell in cells if not is_number(cell)), None)
    if wrong is not None:
        raise LayoutError(f"row {row[0]}: {wrong!r:.40} is no number")
    return [float(cell) for cell in cells]


def is_number(cell: str) -> bool:
    """Whether a cell is a finite number."""
    try:
        return "_" not in cell and math.isfinite(float(cell))
    except ValueError:
        return False


def _stripped(row: list[str]) -> list[str]:
    """Cells without blanks around them, and without empty ones at the end."""
    cells = [cell.strip() for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    return cells
