"""Reads columns of measurements from CSV files and workbooks: names, units, and numbers in SI.

Fits of fins, thrusters and robots read their files by `read_columns`; a header names a quantity by
one of several words, and its unit.
"""

import csv
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import ParseError

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.csv_table import UNITS, CsvTable, read_table
from finlab.files.guarded import read_file, unpacked
from finlab.layout import Layout

MAX_WORKBOOK_BYTES = 10_000_000
"""Largest workbook [bytes]."""
MAX_UNPACKED_BYTES = 20_000_000
"""Largest content of a workbook, without its pictures [bytes]."""
MAX_ROWS = 20_000
"""Most rows of a sheet."""
MAX_COLUMNS = 60
"""Most columns of a sheet that are read."""
MAX_SHEETS = 50
"""Most sheets of a workbook."""
MAX_TITLE_ROWS = 30
"""Most rows above a header."""
DAMAGE_ERRORS = (
    ParseError,
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    TypeError,
    ValueError,
)
"""Exceptions that openpyxl ends with on files that are no workbooks."""

IsHeader = Callable[[Sequence[str]], bool]
"""Whether the cells of a row are a header."""
MAX_BYTES = 200_000_000
"""Largest file that is read [bytes]; a swim of an hour at 50 Hz has half of it."""
MAX_HEADER_LENGTH = 120
"""Characters of a header that count, blanks merged."""
MAX_RAW_HEADER_LENGTH = 10_000
"""Characters of a header that are looked at, with all its blanks."""
AGREEMENT = 0.01
"""Share of the largest value by which two columns of one quantity may differ."""
SLIPS = 0.05
"""As `AGREEMENT`, of two columns of which one names no unit."""


def read_sheets(path: Path, is_header: IsHeader) -> tuple[dict[str, CsvTable], tuple[str, ...]]:
    """Returns the tables of a workbook.

    Of formulas the values count that were saved with them.

    Args:
        path: the workbook (.xlsx).
        is_header: whether a table begins at a row.

    Returns:
        The tables by the names of their sheets, and the names of the sheets without one.

    Raises:
        DataError: the workbook cannot be read, is too large, or openpyxl is missing.
    """
    content = read_file(path, MAX_WORKBOOK_BYTES, "a workbook (.xlsx)")
    try:
        import openpyxl
    except ImportError:
        raise DataError(
            f"{path}: workbooks are read by openpyxl, which is not installed: pip install "
            "'finlab-marine[bench]', or save the sheet as CSV"
        ) from None

    def max_size_of(name: str) -> int | None:
        return MAX_UNPACKED_BYTES if name.endswith((".xml", ".rels")) else None

    unpacked(content, str(path), max_size_of, MAX_UNPACKED_BYTES)
    tables: dict[str, CsvTable | None] = {}
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        if len(book.worksheets) > MAX_SHEETS:
            raise DataError(
                f"{path}: has {len(book.worksheets)} sheets, expected at most {MAX_SHEETS}"
            )
        for sheet in book.worksheets:
            tables[sheet.title] = _table(sheet, f"{path}, sheet {sheet.title}", is_header)
    except DAMAGE_ERRORS as problem:
        raise DataError(f"{path}: cannot be read as a workbook (.xlsx): {problem!r:.80}") from None
    without_table = tuple(title for title, table in tables.items() if table is None)
    return {title: table for title, table in tables.items() if table is not None}, without_table


def _table(sheet: Any, source: str, is_header: IsHeader) -> CsvTable | None:
    """The table of a sheet from its header on; None where there is none."""
    sheet.reset_dimensions()
    cells = sheet.iter_rows(max_col=MAX_COLUMNS, values_only=True)
    rows = [_words(row) for row in islice(cells, MAX_ROWS + 1)]
    if len(rows) > MAX_ROWS:
        raise DataError(f"{source}: has more than {MAX_ROWS} rows; delete those that hold nothing")
    above = next((k for k, row in enumerate(rows[:MAX_TITLE_ROWS]) if is_header(row)), None)
    if above is None:
        return None
    width = len(rows[above])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    # The rows above keep their places, so that errors name the lines of the sheet.
    writer.writerows([["#"]] * above)
    writer.writerows((*row[:width], *[""] * (width - len(row))) for row in rows[above:])
    return CsvTable(text.getvalue().encode(), source)


def _words(row: Sequence[object]) -> list[str]:
    """Cells as text, without empty ones at the end."""
    cells = ["" if cell is None else " ".join(str(cell).split()) for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    return cells


@dataclass(frozen=True)
class Columns:
    """Columns that a fit reads."""

    values: dict[str, Array]
    """Values in SI by the name of the quantity, (n,) each."""
    headers: dict[str, str]
    """The header cell of each."""
    without_unit: tuple[str, ...]
    """Names of those whose header names no unit."""
    sources: tuple[str, ...]
    """File and line of each of the n rows."""
    left_aside: tuple[str, ...] = ()
    """Headers without a unit of columns beside which another one names the unit."""


class Header(NamedTuple):
    """The meaning of a header cell."""

    name: str
    """The quantity; empty for what no fit reads."""
    scale: float
    """What a value of 1 stands for, in SI."""
    unit: str
    """The unit as it stands there, in lower case; empty where there is none."""


def named_column(
    header: str, names: Mapping[str, str], units: Mapping[str, float] = UNITS
) -> Header:
    """Returns the meaning of a header cell such as `A [deg]`, `amplitude_deg` or `Force (Kg f)`.

    A `stroke` is the angle from end to end, twice the amplitude.

    Args:
        header: the cell.
        names: quantities by the words for them; in lower case, unless `units` are given.
        units: units in SI by name.

    Raises:
        DataError: the unit is not known.
    """
    suffixes = "deg|rad|hz|rpm|us|nm|mN|kgf|lbf|N|W|mW|V|A"
    short = " ".join(header[:MAX_RAW_HEADER_LENGTH].split())[:MAX_HEADER_LENGTH]
    match = re.fullmatch(rf"(.+?) ?(?:[\[(](.*)[\])]|_({suffixes}))?", short, flags=re.IGNORECASE)
    if match is None:
        return Header("", 1.0, "")
    word = match[1]
    name = names.get(word.lower().replace(" ", "_") if units is UNITS else word, "")
    if not name:
        return Header("", 1.0, "")
    unit = re.sub(r"[\s.*·]", "", (match[2] or match[3] or "")).lower()
    if unit and unit not in units:
        raise DataError(
            f"column {short}: unit {unit!r:.20} is not known, expected {', '.join(units)}"
        )
    amplitude_share = 0.5 if word.lower() == "stroke" else 1.0
    return Header(name, amplitude_share * units.get(unit, 1.0), unit)


def read_columns(
    file: Path | CsvTable,
    names: Mapping[str, str],
    needed: Sequence[str],
    expected: str,
    units: Mapping[str, float] = UNITS,
    gaps: bool = False,
) -> Columns:
    """Returns the columns of a CSV file, or of a table, that have a name.

    Of several columns for one quantity that agree, such as a force in kgf and in N, the first is
    taken. Where they are proportional, and one alone names a unit, that one is.

    Args:
        file: the file, or a table of a workbook.
        names: quantities by the words for them, as `named_column` takes them.
        needed: quantities without which the file is refused; of `a|b` one is enough.
        expected: what the sentence of an error says was expected.
        units: units in SI by name.
        gaps: whether cells of a file may be empty, which makes them NaN.

    Raises:
        DataError: the file cannot be read, or lacks a column.
    """
    description = "a CSV file of measurements"
    table = file if isinstance(file, CsvTable) else read_table(file, MAX_BYTES, description, gaps)
    path = table.source
    try:
        headers = [named_column(cell, names, units) for cell in table.header]
    except DataError as error:
        raise DataError(f"{path}: {error}") from None
    used = [i for i, column in enumerate(headers) if column.name]
    for name in needed:
        if not set(name.split("|")) & {headers[i].name for i in used}:
            missing = name.replace("|", " or ")
            header = ", ".join(table.header)
            raise DataError(
                f"{path}: column {missing} is missing, found {header:.200}; expected {expected}"
            )
    numbers, lines = table.numbers(used)
    values, column_of, left_aside = _one_column_each(table, headers, used, numbers)
    header_of = {name: table.header[i] for name, i in column_of.items()}
    without_unit = tuple(name for name, i in column_of.items() if not headers[i].unit)
    sources = tuple(f"{Path(path).name} line {line}" for line in lines)
    return Columns(values, header_of, without_unit, sources, tuple(left_aside))


def _one_column_each(
    table: CsvTable, headers: Sequence[Header], used: Sequence[int], numbers: Array
) -> tuple[dict[str, Array], dict[str, int], list[str]]:
    """One column in SI units for each quantity; which of the table's it is; and the names of those
    that are proportional to one that is taken, but in a unit that is not named.

    Raises:
        DataError: columns for the same quantity differ.
    """
    values: dict[str, Array] = {}
    column_of: dict[str, int] = {}
    left_aside: list[str] = []
    for i, column in zip(used, numbers.T, strict=True):
        scaled = column * headers[i].scale
        name = headers[i].name
        if name not in values:
            values[name] = scaled
            column_of[name] = i
            continue
        if _agree(scaled, values[name]):
            continue
        first = headers[column_of[name]]
        if bool(first.unit) != bool(headers[i].unit) and _are_proportional(scaled, values[name]):
            unnamed = i
            if headers[i].unit:
                unnamed = column_of[name]
                values[name] = scaled
                column_of[name] = i
            left_aside.append(table.header[unnamed])
        else:
            pair = f"{table.header[column_of[name]]:.40} and {table.header[i]:.40}"
            raise DataError(
                f"{table.source}: two columns stand for {name}, {pair}, and differ; keep one"
            )
    return values, column_of, left_aside


def _agree(one: Array, other: Array) -> bool:
    """Whether two columns (n,) are the same, but for rounding."""
    tolerance = AGREEMENT * np.abs(one).max()
    return np.allclose(one, other, rtol=0.0, atol=tolerance, equal_nan=True)


def _are_proportional(one: Array, other: Array) -> bool:
    """Whether two columns (n,) are the same but for their unit, and slips of a few percent."""
    square = float(other @ other)
    if square <= 0.0:
        return False
    ratio = float(one @ other) / square
    return float(np.abs(one - ratio * other).max()) <= SLIPS * float(np.abs(one).max())


def command_columns(layout: Layout) -> list[list[str]]:
    """Returns for each actuator the columns of its command, `NAME.number`, such as `bow.force`."""
    columns = []
    for actuator in layout.actuators:
        columns.append([f"{actuator.name}.{number.name}" for number in actuator.KIND.numbers])
    return columns


def commands_in(values: Mapping[str, Array], layout: Layout) -> Array:
    """Returns the commands in columns that `command_columns` names.

    Args:
        values: columns by name, (N,) each.
        layout: the robot.

    Returns:
        Commands (N, n, 3) in the units of the actuators' numbers: NaN where an actuator has none, 0
        for a number that its kind does not have.
    """
    columns = command_columns(layout)
    command = np.zeros((len(values[columns[0][0]]), layout.n, 3))
    for i, names in enumerate(columns):
        numbers = np.stack([values[name] for name in names], axis=-1)
        command[:, i, : len(names)] = numbers
        command[np.isnan(numbers).all(axis=1), i] = np.nan
    return command


def concatenate(tables: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Returns the columns (n,) that all tables have, one table's rows after the other's, by
    name."""
    shared = [name for name in tables[0] if all(name in table for table in tables)]
    return {name: np.concatenate([table[name] for table in tables]) for name in shared}
