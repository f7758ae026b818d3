"""Columns of a file of measurements: what their headers name, in which units, and their numbers in SI."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.csv_table import read_table
from finlab.layout.angles import TURN

MAX_BYTES = 200_000_000
"""Largest file that is read [bytes]; a swim of an hour at 50 Hz has half of it."""
UNITS = {
    "rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0,
    "hz": 1.0, "rpm": 1.0 / 60.0, "bpm": 1.0 / 60.0, "rev/min": 1.0 / 60.0, "rad/s": 1.0 / TURN,
    "n": 1.0, "mn": 1e-3, "kn": 1e3, "w": 1.0, "mw": 1e-3, "kw": 1e3, "v": 1.0, "a": 1.0, "ma": 1e-3,
    "gf": 9.80665e-3, "g": 9.80665e-3, "kgf": 9.80665, "kg": 9.80665, "lbf": 4.44822, "lb": 4.44822,
    "nm": 1.0, "mnm": 1e-3, "us": 1.0, "µs": 1.0, "μs": 1.0, "ms": 1e3, "%": 0.01, "-": 1.0,
}  # fmt: skip
"""Units that a header may name, in SI (frequencies in Hz, pulses in us)."""


@dataclass(frozen=True)
class Columns:
    """Columns that a fit reads, one number for each of n rows."""

    values: dict[str, Array]
    """In SI, by name, (n,) each."""
    places: tuple[str, ...]
    """Where each row stands, file and line."""


def named_column(
    header: str, names: Mapping[str, str], units: Mapping[str, float] = UNITS
) -> tuple[str, float]:
    """Returns what a header cell stands for and its unit in SI: `A [deg]`, `amplitude_deg`, `Force (Kg f)`,
    `Fx`; "" for what no fit reads. With units of its own a name counts as it stands, else in lower case. A
    `stroke` is the angle from end to end, twice the amplitude.

    Raises:
        DataError: the unit is not known.
    """
    behind = "deg|rad|hz|rpm|us|nm|mN|kgf|lbf|N|W|mW|V|A"
    parts = re.fullmatch(rf"\s*(.+?)\s*(?:[\[(](.*)[\])]|_({behind}))?\s*", header, flags=re.IGNORECASE)
    told = parts[1] if parts else ""
    name = names.get(told.lower().replace(" ", "_") if units is UNITS else told, "")
    if parts is None or not name:
        return "", 1.0
    unit = re.sub(r"[\s.*·]", "", (parts[2] or parts[3] or "")).lower()
    if unit and unit not in units:
        raise DataError(f"column {header}: unit {unit!r:.20} is not known, expected {', '.join(units)}")
    return name, (0.5 if told.lower() == "stroke" else 1.0) * units.get(unit, 1.0)


def read_columns(
    path: Path,
    names: Mapping[str, str],
    needed: Sequence[str],
    expected: str,
    units: Mapping[str, float] = UNITS,
    gaps: bool = False,
) -> Columns:
    """Returns the columns of a file that have a name.

    Args:
        path: a CSV file with a header; lines that begin with # are passed over.
        names: what words in the header stand for, as `named_column` takes them.
        needed: names of columns without which the file is refused; of `a|b` one is enough.
        expected: what the error then says of the columns.
        units: that the header may name.
        gaps: whether cells may be empty, which makes them NaN.

    Raises:
        DataError: the file cannot be read, or lacks a column.
    """
    table = read_table(path, MAX_BYTES, "a CSV file of measurements", gaps)
    try:
        named = [named_column(cell, names, units) for cell in table.header]
    except DataError as error:
        raise DataError(f"{path}: {error}") from None
    used = [i for i, (name, _) in enumerate(named) if name]
    found = [named[i][0] for i in used]
    for name in found:
        if found.count(name) > 1:
            raise DataError(f"{path}: two columns stand for {name}; keep one")
    for name in needed:
        if not set(name.split("|")) & set(found):
            told = ", ".join(table.header)
            raise DataError(
                f"{path}: column {name.replace('|', ' or ')} is missing, found {told:.200}; "
                f"expected {expected}"
            )
    numbers, lines = table.numbers(used)
    scale = np.array([named[i][1] for i in used])
    values = dict(zip(found, (numbers * scale).T, strict=True))
    return Columns(values, tuple(f"{path.name} line {line}" for line in lines))


def together(files: Sequence[Columns]) -> dict[str, Array]:
    """Returns the columns that all files have, one file's rows after the other's, by name."""
    shared = [name for name in files[0].values if all(name in file.values for file in files)]
    return {name: np.concatenate([file.values[name] for file in files]) for name in shared}
