"""Layouts as tables: one row for each fin, as spreadsheets and scripts write them (CSV)."""

import csv
import io
import math
import os
from pathlib import Path

from finlab.errors import LayoutError
from finlab.files.guarded import read_text
from finlab.layout import MAX_ACTUATORS, Fin, Layout, Limits
from finlab.layout.file_form import under
from finlab.layout.load import MAX_BYTES
from finlab.whole_file import write_whole

POSITION = ("x_m", "y_m", "z_m")
ANGLE = "mounting_angle_deg"
LIMITS = {
    "amplitude": ("amplitude_min_rad", "amplitude_max_rad"),
    "frequency": ("frequency_min_hz", "frequency_max_hz"),
    "zero_direction": ("zero_direction_min_rad", "zero_direction_max_rad"),
}
COLUMNS = ("name", *POSITION, ANGLE, *(column for pair in LIMITS.values() for column in pair))
"""All columns there are; only the three of the position are needed."""


def read_csv(path: str | os.PathLike[str]) -> Layout:
    """The layout in a CSV file with a header of names from `COLUMNS`.

    Fins without a name are called fin_1, fin_2, ...; without an angle, their shafts point away from the z
    axis; without limits, they have the nominal ones. The layout has the file's name.

    Raises:
        LayoutError: it cannot be read, or a column or a number is wrong; the message names row and column.
    """
    source = str(path)
    text = read_text(path, MAX_BYTES, "a CSV file of fins", LayoutError)
    rows = csv.DictReader(io.StringIO(text), restkey="", strict=True)
    with under(source=source):
        try:
            header = [column.strip() for column in rows.fieldnames or []]
            rows.fieldnames = header
            if unknown := [column for column in header if column not in COLUMNS]:
                raise LayoutError(f"unknown column {unknown[0]!r:.60}, expected {', '.join(COLUMNS)}")
            if missing := [column for column in POSITION if column not in header]:
                raise LayoutError(f"column {missing[0]!r} is missing; a fin needs {', '.join(POSITION)}")
            if len(set(header)) < len(header):
                raise LayoutError("a column is given twice")
            fins = []
            for i, row in enumerate(rows, start=1):
                if i > MAX_ACTUATORS:
                    raise LayoutError(f"expected 1 to {MAX_ACTUATORS} fins, got more")
                with under(f"row {i}"):
                    fins.append(_fin(row, i))
            return Layout(Path(path).stem, tuple(fins), f"From {Path(path).name}.")
        except csv.Error as error:
            raise LayoutError(f"is not valid CSV: {error}") from None


def write_csv(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Write every column of every fin; fin models and servos are not part of it.

    Raises:
        LayoutError: the file cannot be written.
    """
    layout.only_fins("a CSV file of fins", horizontal=True)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for fin in layout.fins:
        limits = [value for name in LIMITS for value in getattr(fin.limits, name)]
        writer.writerow([fin.name, *fin.position, math.degrees(fin.shaft_azimuth), *limits])
    write_whole(path, text.getvalue())


def _fin(row: dict[str, str | None], i: int) -> Fin:
    if "" in row:
        raise LayoutError("has more values than the header has columns")
    x, y, z = (_number(row, column) for column in POSITION)
    angle = math.degrees(math.atan2(y, x)) if not row.get(ANGLE) else _number(row, ANGLE)
    nominal = Limits()
    limits: dict[str, tuple[float, float]] = {}
    for name, columns in LIMITS.items():
        pairs = zip(columns, getattr(nominal, name), strict=True)
        low, high = (_number(row, column) if row.get(column) else end for column, end in pairs)
        limits[name] = low, high
    return Fin((row.get("name") or f"fin_{i}").strip(), (x, y, z), math.radians(angle), Limits(**limits))


def _number(row: dict[str, str | None], column: str) -> float:
    try:
        return float(row[column] or "")
    except ValueError:
        raise LayoutError(f"expected a number, got {row[column]!r:.40}", column) from None
