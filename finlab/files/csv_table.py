"""CSV files of numbers under a header, with line and column where one is wrong."""

import csv
import math
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.guarded import Name, decoded, read_file


class CsvTable:
    """A CSV file whose header has been read."""

    def __init__(self, content: bytes, source: str, gaps: bool = False) -> None:
        """Takes a file's content, what errors call it, and whether cells may be empty. Raises DataError: it
        is no text."""
        self.source, self._gaps = source, gaps
        lines = decoded(content, source, "CSV text").splitlines()
        above = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
        self.notes = tuple(line.lstrip("# ").rstrip() for line in lines[:above])
        """Lines above the header that begin with #, without it."""
        first = lines[above] if above < len(lines) else ""
        self._delimiter = max(",;\t", key=first.count)
        self.header = [cell.strip() for cell in self._cells(first, f"{source}: line {above + 1}")]
        """Names of the columns."""
        self._rows, self._first = lines[above + 1 :], above + 2

    def numbers(self, places: Sequence[int]) -> tuple[Array, NDArray[np.intp]]:
        """Returns the columns at some places (rows, len(places)), and the line of each row (rows,).

        Empty lines, and those that begin with #, are passed over. A cell that may be empty is NaN. Raises
        DataError: there is no row, or a row or a cell is wrong; the sentence names line and column."""
        rows = [
            (line, row)
            for line, row in enumerate(self._rows, self._first)
            if row.strip(" ,;\t") and not row.startswith("#")
        ]
        if not rows:
            raise DataError(f"{self.source}: has no rows below its header")
        return np.array([self._row(row, places, line) for line, row in rows]), np.array([n for n, _ in rows])

    def _row(self, row: str, places: Sequence[int], line: int) -> list[float]:
        """One row, or a sentence on what is wrong in it."""
        where = f"{self.source}: line {line}"
        cells = self._cells(row, where)
        if len(cells) != len(self.header):
            raise DataError(f"{where} has {len(cells)} values, the header has {len(self.header)}")
        with suppress(ValueError):
            values = [float(cells[i]) for i in places]
            if "_" not in row and all(map(math.isfinite, values)):
                return values
        return [self._number(cells[i].strip(), f"{where}, column {self.header[i]},") for i in places]

    def _cells(self, row: str, where: str) -> list[str]:
        try:
            return next(csv.reader([row], delimiter=self._delimiter, strict=True), [])
        except csv.Error as problem:
            raise DataError(f"{where}: cannot be read as CSV: {problem}") from None

    def _number(self, cell: str, where: str) -> float:
        if self._gaps and cell.lower() in ("", "nan"):
            return math.nan
        if not cell:
            raise DataError(f"{where} is empty; leave no gaps")
        value = number_in(cell)
        if value is None or not math.isfinite(value):
            raise DataError(
                f"{where} holds {cell!r:.40}, which is not {'a number' if value is None else 'finite'}"
            )
        return value


def number_in(cell: str) -> float | None:
    """Returns the number in a cell, which may not be finite; None where it holds none."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None


def read_table(path: Name, most: int, what: str, gaps: bool = False) -> CsvTable:
    """Returns the table in a file; arguments and errors as in `read_file` and `CsvTable`."""
    return CsvTable(read_file(path, most, what), str(path), gaps)
