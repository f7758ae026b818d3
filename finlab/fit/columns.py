"""Columns of measurements, of CSV files and workbooks: names, units, and numbers in SI."""

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

MOST_PACKED, MOST_UNPACKED = 10_000_000, 20_000_000
"""Largest workbook, and what is in it without its pictures [bytes]."""
MOST_ROWS, MOST_COLUMNS, MOST_SHEETS = 20_000, 60, 50
"""Of a sheet, and of a workbook."""
TITLES = 30
"""Rows that may stand above a header."""
DAMAGED = (ParseError, ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError)
"""What openpyxl ends with on files that are no workbooks."""

IsHeader = Callable[[Sequence[str]], bool]
MAX_BYTES = 200_000_000
"""Largest file that is read [bytes]; a swim of an hour at 50 Hz has half of it."""
LONGEST, MOST_BLANKS = 120, 10_000
"""Characters of a header that count, without and with its blanks."""
ALIKE = 0.01
"""Share of the largest value by which two columns of one quantity may differ."""


def sheets(path: Path, is_header: IsHeader) -> tuple[dict[str, CsvTable], tuple[str, ...]]:
    """Returns the sheets of a workbook that hold a table, by name, and the names of those that do
    not.

    A table begins at a row that `is_header`; of formulas the values count that were saved with
    them. Raises DataError: the workbook cannot be read, is too large, or openpyxl is missing."""
    content = read_file(path, MOST_PACKED, "a workbook (.xlsx)")
    try:
        import openpyxl
    except ImportError:
        raise DataError(
            f"{path}: workbooks are read by openpyxl, which is not installed: "
            "pip install 'finlab-marine[bench]', or save the sheet as CSV"
        ) from None
    most = MOST_UNPACKED
    unpacked(
        content, str(path), lambda name: most if name.endswith((".xml", ".rels")) else None, most
    )
    tables: dict[str, CsvTable | None] = {}
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        if len(book.worksheets) > MOST_SHEETS:
            raise DataError(
                f"{path}: has {len(book.worksheets)} sheets, expected at most {MOST_SHEETS}"
            )
        for sheet in book.worksheets:
            tables[sheet.title] = _table(sheet, f"{path}, sheet {sheet.title}", is_header)
    except DAMAGED as problem:
        raise DataError(f"{path}: cannot be read as a workbook (.xlsx): {problem!r:.80}") from None
    other = tuple(title for title, table in tables.items() if table is None)
    return {title: table for title, table in tables.items() if table is not None}, other


def _table(sheet: Any, source: str, is_header: IsHeader) -> CsvTable | None:
    """The table of a sheet from its header on; None where there is none."""
    sheet.reset_dimensions()
    cells = sheet.iter_rows(max_col=MOST_COLUMNS, values_only=True)
    rows = [_words(row) for row in islice(cells, MOST_ROWS + 1)]
    if len(rows) > MOST_ROWS:
        raise DataError(f"{source}: has more than {MOST_ROWS} rows; delete those that hold nothing")
    above = next((k for k, row in enumerate(rows[:TITLES]) if is_header(row)), None)
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
    """Columns that a fit reads, in SI, (n,) each, and headers by name; the names of those whose
    header names no unit; and where each of n rows stands, file and line."""

    values: dict[str, Array]
    headers: dict[str, str]
    bare: tuple[str, ...]
    places: tuple[str, ...]


class Header(NamedTuple):
    """What a header cell stands for, and its unit in SI and as it stands there, in lower case."""

    name: str
    scale: float
    unit: str


def named_column(
    header: str, names: Mapping[str, str], units: Mapping[str, float] = UNITS
) -> Header:
    """Returns what a header cell stands for: `A [deg]`, `amplitude_deg`, `Force (Kg f)`, `Fx`; ""
    for what no fit reads. With units of its own a name counts as it stands, else in lower case. A
    `stroke` is the angle from end to end, twice the amplitude. Raises DataError: the unit is not
    known."""
    behind = "deg|rad|hz|rpm|us|nm|mN|kgf|lbf|N|W|mW|V|A"
    short = " ".join(header[:MOST_BLANKS].split())[:LONGEST]
    parts = re.fullmatch(rf"(.+?) ?(?:[\[(](.*)[\])]|_({behind}))?", short, flags=re.IGNORECASE)
    word = parts[1] if parts else ""
    name = names.get(word.lower().replace(" ", "_") if units is UNITS else word, "")
    if parts is None or not name:
        return Header("", 1.0, "")
    unit = re.sub(r"[\s.*·]", "", (parts[2] or parts[3] or "")).lower()
    if unit and unit not in units:
        raise DataError(
            f"column {short}: unit {unit!r:.20} is not known, expected {', '.join(units)}"
        )
    return Header(name, (0.5 if word.lower() == "stroke" else 1.0) * units.get(unit, 1.0), unit)


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
    taken. Names are what words in the header stand for, as `named_column` takes them, with its
    units; a file without those `needed` is refused, of `a|b` one is enough, with what the error
    says is `expected`. With `gaps` cells of a file may be empty, which makes them NaN. Raises
    DataError: the file cannot be read, or lacks a column."""
    what = "a CSV file of measurements"
    table = file if isinstance(file, CsvTable) else read_table(file, MAX_BYTES, what, gaps)
    path = table.source
    try:
        named = [named_column(cell, names, units) for cell in table.header]
    except DataError as error:
        raise DataError(f"{path}: {error}") from None
    used = [i for i, column in enumerate(named) if column.name]
    for name in needed:
        if not set(name.split("|")) & {named[i].name for i in used}:
            missing = name.replace("|", " or ")
            header = ", ".join(table.header)
            raise DataError(
                f"{path}: column {missing} is missing, found {header:.200}; expected {expected}"
            )
    numbers, lines = table.numbers(used)
    values: dict[str, Array] = {}
    first: dict[str, int] = {}
    for i, column in zip(used, numbers.T, strict=True):
        own = column * named[i].scale
        name = named[i].name
        if name not in values:
            values[name] = own
            first[name] = i
        elif not np.allclose(
            own, values[name], rtol=0.0, atol=ALIKE * np.abs(own).max(), equal_nan=True
        ):
            pair = f"{table.header[first[name]]:.40} and {table.header[i]:.40}"
            raise DataError(f"{path}: two columns stand for {name}, {pair}, and differ; keep one")
    headers = {name: table.header[i] for name, i in first.items()}
    bare = tuple(name for name, i in first.items() if not named[i].unit)
    return Columns(values, headers, bare, tuple(f"{Path(path).name} line {line}" for line in lines))


def command_columns(layout: Layout) -> list[list[str]]:
    """Returns for each actuator the columns of its command, `NAME.number`, such as `bow.force`."""
    columns = []
    for part in layout.actuators:
        columns.append([f"{part.name}.{number.name}" for number in part.KIND.numbers])
    return columns


def commands_in(values: Mapping[str, Array], layout: Layout) -> Array:
    """Returns the commands (N, n, 3) of N rows of such columns, in the units of the actuators'
    numbers: NaN where an actuator has none, 0 for a number that it does not have."""
    columns = command_columns(layout)
    command = np.zeros((len(values[columns[0][0]]), layout.n, 3))
    for i, own in enumerate(columns):
        command[:, i, : len(own)] = np.stack([values[name] for name in own], axis=-1)
        command[np.isnan(command[:, i, : len(own)]).all(axis=1), i] = np.nan
    return command


def together(tables: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Returns the columns (n,) that all tables have, one table's rows after the other's, by
    name."""
    shared = [name for name in tables[0] if all(name in table for table in tables)]
    return {name: np.concatenate([table[name] for table in tables]) for name in shared}
