"""CSV files of numbers under a header: read quickly, and with line and column where one is wrong."""

import csv
import math
import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.guarded import Name, decoded, read_file

CHUNK = 4_000_000
"""About so much is parsed at a time [bytes]."""
_GAP = re.compile(r"(?<=[,;\t])[ \t]*(?=[,;\t]|$)|^[ ]*(?=[,;\t])", re.MULTILINE)


class CsvTable:
    """A CSV file whose header has been read."""

    def __init__(self, content: bytes, source: str, gaps: bool = False) -> None:
        """Takes a file's content, what errors call it, and whether cells may be empty.

        Raises:
            DataError: it is no text.
        """
        self.source, self._gaps = source, gaps
        notes, start = [], 3 if content.startswith(b"\xef\xbb\xbf") else 0
        while content[start : start + 1] == b"#":
            end = content.find(b"\n", start) + 1 or len(content)
            notes.append(decoded(content[start:end], source, "CSV text").lstrip("# ").rstrip())
            start = end
        self.notes = tuple(notes)
        """Lines above the header that begin with #, without it."""
        end = content.find(b"\n", start) + 1 or len(content)
        first = decoded(content[start:end], source, "CSV text").rstrip("\r\n")
        self._delimiter = max(",;\t", key=first.count)
        self.header = [cell.strip() for cell in self._cells(first, f"{source}: line {len(notes) + 1}")]
        """Names of the columns."""
        self._content, self._start = content, end

    def numbers(self, places: Sequence[int]) -> tuple[Array, NDArray[np.intp]]:
        """Returns the columns at some places (rows, len(places)), and the line of each row (rows,).

        Empty lines, and those that begin with #, are passed over. A cell that may be empty is NaN.

        Raises:
            DataError: there is no row, or a row or a cell is wrong; the sentence names line and column.
        """
        values, lines, line = [], [], len(self.notes) + 2
        for text in self._chunks():
            rows = text.splitlines()
            kept = [i for i, row in enumerate(rows) if row.strip(" ,;\t") and not row.startswith("#")]
            if kept:
                lines.append(np.array(kept) + line)
                values.append(self._parsed([rows[i] for i in kept], places, lines[-1]))
            line += len(rows)
        if not values:
            raise DataError(f"{self.source}: has no rows below its header")
        return np.concatenate(values), np.concatenate(lines)

    def _chunks(self) -> Iterator[str]:
        start = self._start
        while start < len(self._content):
            end = self._content.find(b"\n", start + CHUNK) + 1 or len(self._content)
            yield decoded(self._content[start:end], self.source, "CSV text")
            start = end

    def _parsed(self, rows: list[str], places: Sequence[int], lines: NDArray[np.intp]) -> Array:
        width = len(self.header) - 1
        if places and all(row.count(self._delimiter) == width and '"' not in row for row in rows):
            text = [_GAP.sub("nan", row) for row in rows] if self._gaps else rows
            try:
                found = np.loadtxt(text, delimiter=self._delimiter, usecols=places, comments=None, ndmin=2)
            except ValueError:
                found = np.empty(0)
            known = np.isfinite(found) | (np.isnan(found) & self._gaps)
            if len(found) == len(rows) and known.all():
                return np.asarray(found, np.float64)
        return np.array([self._row(row, places, int(at)) for row, at in zip(rows, lines, strict=True)])

    def _row(self, row: str, places: Sequence[int], line: int) -> list[float]:
        """One row, or a sentence on what is wrong in it."""
        where = f"{self.source}: line {line}"
        cells = self._cells(row, where)
        if len(cells) != len(self.header):
            raise DataError(f"{where} has {len(cells)} values, the header has {len(self.header)}")
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
        try:
            value = float(cell) if "_" not in cell else None
        except ValueError:
            value = None
        if value is None:
            raise DataError(f"{where} holds {cell!r:.40}, which is not a number")
        if not math.isfinite(value):
            raise DataError(f"{where} holds {cell!r:.40}, which is not finite")
        return value


def read_table(path: Name, most: int, what: str, gaps: bool = False) -> CsvTable:
    """Returns the table in a file; arguments and errors as in `read_file` and `CsvTable`."""
    return CsvTable(read_file(path, most, what), str(path), gaps)
