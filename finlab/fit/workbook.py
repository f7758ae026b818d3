"""Tables in Excel's workbooks (`.xlsx`), a sheet each, by openpyxl."""

import csv
import io
from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

from finlab.errors import DataError
from finlab.files.archive import unpacked
from finlab.files.csv_table import CsvTable
from finlab.files.guarded import read_file

MAX_BYTES, MOST_UNPACKED = 10_000_000, 20_000_000
"""Largest workbook, and what is in it without its pictures [bytes]."""
MOST_ROWS, MOST_COLUMNS, MOST_SHEETS = 20_000, 60, 50
"""Of a sheet, and of a workbook."""
TITLES = 30
"""Rows that may stand above a header."""
DAMAGED = (ParseError, ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError)
"""What openpyxl ends with on files that are no workbooks."""

IsHeader = Callable[[Sequence[str]], bool]


def sheets(path: Path, is_header: IsHeader) -> tuple[dict[str, CsvTable], tuple[str, ...]]:
    """Returns the sheets of a workbook that hold a table, by name, and the names of those that do not.

    Args:
        path: the workbook; of formulas the values count that were saved with them.
        is_header: whether a row is the header of a table.

    Raises:
        DataError: it cannot be read, is too large, or openpyxl is missing.
    """
    content = read_file(path, MAX_BYTES, "a workbook (.xlsx)")
    try:
        import openpyxl
    except ImportError:
        raise DataError(
            f"{path}: workbooks are read by openpyxl, which is not installed: "
            "pip install 'finlab-marine[bench]', or save the sheet as CSV"
        ) from None
    most = MOST_UNPACKED
    unpacked(content, str(path), lambda name: most if name.endswith((".xml", ".rels")) else None, most)
    found: dict[str, CsvTable | None] = {}
    try:
        book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        if len(book.worksheets) > MOST_SHEETS:
            raise DataError(f"{path}: has {len(book.worksheets)} sheets, expected at most {MOST_SHEETS}")
        for sheet in book.worksheets:
            found[sheet.title] = _table(sheet, f"{path}, sheet {sheet.title}", is_header)
    except DAMAGED as problem:
        raise DataError(f"{path}: cannot be read as a workbook (.xlsx): {problem!r:.80}") from None
    other = tuple(title for title, table in found.items() if table is None)
    return {title: table for title, table in found.items() if table is not None}, other


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
