"""Reads CSV files of numbers below a header, and has the units that a header may name.

An error names the line and the column. Force tables, measurements of `finlab fit` and tables of
`finlab.exchange` are read by this module or use its units.
"""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import pi

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.guarded import Name, decoded, read_file

LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 1e-3}
"""Units of length in meters."""
TURNS = {"rad": 1.0, "deg": pi / 180.0, "degrees": pi / 180.0, "°": pi / 180.0}
"""Units of angle in radians."""
FORCES = {"n": 1.0, "kn": 1e3, "kgf": 9.80665, "lbf": 4.4482216}
"""Units of force in newtons."""
_UNITS_OF_BENCHES = {
    "newton newtons": 1.0, "gf g grams gram-force": 9.80665e-3,
    "kg kgs kg-f kilograms": FORCES["kgf"],
    "lb lbs lbsf lb-f pounds": FORCES["lbf"], "ozf oz": 0.278014, "watts volts amps": 1.0,
    "us µs μs usec microseconds": 1.0, "ms msec milliseconds": 1e3, "nm n-m": 1.0, "ncm": 0.01,
    "kgfm kgm": 9.80665, "kgcm kgfcm": 0.0980665, "gcm gfcm": 9.80665e-5, "ozin ozfin": 7.06155e-3,
    "inlb inlbf lbin lbfin": 0.112985, "ftlb ftlbf lbft lbfft": 1.35582,
}  # fmt: skip
"""More units of test benches, several names for one with blanks between."""
UNITS = {
    "rad": 1.0, "deg": TURNS["deg"], "°": TURNS["deg"],
    "hz": 1.0, "rpm": 1.0 / 60.0, "bpm": 1.0 / 60.0, "rev/min": 1.0 / 60.0, "rad/s": 0.5 / pi,
    **FORCES, "mn": 1e-3, "w": 1.0, "mw": 1e-3, "kw": 1e3, "v": 1.0, "mv": 1e-3,
    "a": 1.0, "ma": 1e-3, "mnm": 1e-3, "%": 0.01, "-": 1.0,
    **{unit: scale for units, scale in _UNITS_OF_BENCHES.items() for unit in units.split()},
}  # fmt: skip
"""Units that the header of a bench may name (frequencies in Hz, pulses in us)."""


class CsvTable:
    """A CSV file whose header has been read."""

    def __init__(self, content: bytes, source: str, gaps: bool = False) -> None:
        """Reads the header of a file.

        Args:
            content: the file's content.
            source: its name in the sentence of an error.
            gaps: whether cells may be empty.

        Raises:
            DataError: it is no text.
        """
        self.source = source
        self._gaps = gaps
        lines = decoded(content, source, "CSV text").splitlines()
        n_notes = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
        self.notes = tuple(line.lstrip("# ").rstrip() for line in lines[:n_notes])
        """Lines above the header that begin with #, without it."""
        header = lines[n_notes] if n_notes < len(lines) else ""
        self._delimiter = max(",;\t", key=header.count)
        self.header = [
            cell.strip() for cell in self._cells(header, f"{source}: line {n_notes + 1}")
        ]
        """Names of the columns."""
        self._rows = lines[n_notes + 1 :]
        self._first_line = n_notes + 2

    def columns(self, names: Mapping[int, str]) -> "CsvTable":
        """Returns the table of some columns under other names, without rows in which all of them
        are empty; lines keep their numbers.

        Args:
            names: the new names by the indices of the columns.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerows([["#"]] * (self._first_line - 2))
        writer.writerow(names.values())
        for line, row in enumerate(self._rows, self._first_line):
            cells = [] if row.startswith("#") else self._cells(row, f"{self.source}: line {line}")
            chosen = [cells[i].strip() if i < len(cells) else "" for i in names]
            writer.writerow(chosen if any(chosen) else ["#"])
        return CsvTable(text.getvalue().encode(), self.source, self._gaps)

    def numbers(self, indices: Sequence[int]) -> tuple[Array, NDArray[np.intp]]:
        """Returns columns of numbers.

        Empty lines, and those that begin with #, are passed over. An empty cell is NaN, where cells
        may be empty.

        Args:
            indices: indices of the columns.

        Returns:
            The numbers (rows, len(indices)), and the line of each row in the file, (rows,).

        Raises:
            DataError: there is no row, or a row or a cell is wrong; the sentence names line and
                column.
        """
        rows = []
        for line, row in enumerate(self._rows, self._first_line):
            if row.strip(" ,;\t") and not row.startswith("#"):
                rows.append((line, row))
        if not rows:
            raise DataError(f"{self.source}: has no rows below its header")
        numbers = self._load([row for _, row in rows], indices)
        if numbers is None:
            numbers = np.array([self._row(row, indices, line) for line, row in rows])
        return numbers, np.array([line for line, _ in rows])

    def _load(self, rows: Sequence[str], indices: Sequence[int]) -> Array | None:
        """The numbers of rows without quotes, gaps and faults, several times as fast; else None."""
        separators = len(self.header) - 1
        if any(
            '"' in row or "_" in row or row.count(self._delimiter) != separators for row in rows
        ):
            return None
        with suppress(ValueError):
            numbers = np.loadtxt(
                rows, delimiter=self._delimiter, usecols=indices, comments=None, ndmin=2
            )
            return numbers if np.isfinite(numbers).all() else None
        return None

    def _row(self, row: str, indices: Sequence[int], line: int) -> list[float]:
        """The numbers of one row, or the error that names what is wrong in it."""
        where = f"{self.source}: line {line}"
        cells = self._cells(row, where)
        if len(cells) != len(self.header):
            raise DataError(f"{where} has {len(cells)} values, the header has {len(self.header)}")
        return [
            self._number(cells[i].strip(), f"{where}, column {self.header[i]},") for i in indices
        ]

    def _cells(self, row: str, where: str) -> list[str]:
        """The cells of one row, without their quotes."""
        try:
            return next(csv.reader([row], delimiter=self._delimiter, strict=True), [])
        except csv.Error as problem:
            raise DataError(f"{where}: cannot be read as CSV: {problem}") from None

    def _number(self, cell: str, where: str) -> float:
        """The number in a cell; NaN in an empty one where cells may be empty."""
        if self._gaps and cell.lower() in ("", "nan"):
            return math.nan
        if not cell:
            raise DataError(f"{where} is empty; leave no gaps")
        value = number_in(cell)
        if value is None or not math.isfinite(value):
            lacks = "a number" if value is None else "finite"
            raise DataError(f"{where} holds {cell!r:.40}, which is not {lacks}")
        return value


def number_in(cell: str) -> float | None:
    """Returns the number in a cell, which may not be finite; None where it holds none."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None


def read_table(path: Name, max_bytes: int, expected: str, gaps: bool = False) -> CsvTable:
    """Returns the table in a file; arguments and errors as in `read_file` and `CsvTable`."""
    return CsvTable(read_file(path, max_bytes, expected), str(path), gaps)
