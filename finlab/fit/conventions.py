"""Units and conventions of a load cell's file: given by its header, recognized, or set by the user.

Inside finlab an amplitude is half the stroke in radians, a frequency is in Hz, and forces are in the fin
frame: x' along the shaft, y' the horizontal thrust axis, z' up.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout.angles import FILE_TURN_TOLERANCE, TURN
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY

UNITS = {
    "rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0,
    "hz": 1.0, "rpm": 1.0 / 60.0, "bpm": 1.0 / 60.0, "rev/min": 1.0 / 60.0, "rad/s": 1.0 / TURN,
    "n": 1.0, "mn": 1e-3, "gf": 9.80665e-3, "w": 1.0, "mw": 1e-3,
}  # fmt: skip
"""Units that a header may name, in SI (frequencies in Hz)."""

NAMES = {
    "a": "A", "amplitude": "A", "f": "f", "frequency": "f",
    "phi": "phi", "zero_direction": "phi", "direction": "phi",
    "fx": "Fx", "fy": "Fy", "fz": "Fz", "p": "P", "power": "P",
    "sfx": "sFx", "sfy": "sFy", "sfz": "sFz", "fx_sd": "sFx", "fy_sd": "sFy", "fz_sd": "sFz",
    "fx_std": "sFx", "fy_std": "sFy", "fz_std": "sFz",
}  # fmt: skip


@dataclass(frozen=True)
class Conventions:
    """How a file is to be read where its header does not say. What is None is recognized."""

    angles: Literal["rad", "deg"] | None = None
    """Unit of amplitude and zero direction."""
    amplitude: Literal["half", "peak-to-peak"] | None = None
    """Whether an amplitude is measured from the middle of the stroke or from end to end."""
    frequency: Literal["hz", "rpm"] | None = None
    """Unit of the frequency."""


@dataclass
class Columns:
    """The columns of a file by their names here, as they stand there but for units named in the header."""

    values: dict[str, Array]
    """Column -> its numbers (n,)."""
    told: set[str]
    source: str
    notes: list[str] = field(default_factory=list)
    """What was recognized, a sentence each."""


def named_column(header: str) -> tuple[str, float | None]:
    """Returns what a header cell stands for and its unit in SI, where it has one: `A [deg]`, `amplitude_deg`,
    `f (rpm)`, `Fx`; "" for what no fit reads."""
    parts = re.fullmatch(r"\s*([A-Za-z_]+?)\s*(?:[\[(](.+)[\])]|_(deg|rad|hz|rpm|mN|N|W|mW))?\s*", header)
    if parts is None:
        return "", None
    name = NAMES.get(parts[1].lower(), "")
    unit = (parts[2] or parts[3] or "").strip().lower()
    return name, UNITS.get(unit) if unit else None


def to_fin_frame(columns: Columns, conventions: Conventions) -> None:
    """Bring angles and frequencies to finlab's conventions, in place, with a note on each guess.

    Raises:
        DataError: a value can be in no known unit, or the guess is ambiguous.
    """
    _convert_angles(columns, conventions)
    _convert_frequency(columns, conventions)


def _convert_angles(columns: Columns, conventions: Conventions) -> None:
    """Radians, and half amplitudes."""
    values, source = columns.values, columns.source
    angular = [name for name in ("A", "phi") if name in values and name not in columns.told]
    reach = {name: float(np.ptp(values[name]) if name != "A" else values[name].max()) for name in angular}
    most = {"A": 2 * MAX_AMPLITUDE, "phi": TURN + FILE_TURN_TOLERANCE}
    beyond = [name for name in angular if reach[name] > most[name]]
    if conventions.angles == "deg" or (conventions.angles is None and beyond):
        for name in angular:
            values[name] = np.radians(values[name])
        if conventions.angles is None:
            columns.notes.append(
                f"column {beyond[0]} reaches {reach[beyond[0]]:.4g}: angles are taken for degrees (--angles)"
            )
    largest = float(values["A"].max())
    kind = conventions.amplitude
    if kind is None and MAX_AMPLITUDE + 1e-9 < largest <= 2 * MAX_AMPLITUDE + 1e-9:
        kind = "peak-to-peak"
        columns.notes.append(
            f"amplitudes reach {math.degrees(largest):.4g} deg: taken for peak-to-peak angles (--amplitude)"
        )
    if kind == "peak-to-peak":
        values["A"] = 0.5 * values["A"]
    if values["A"].max() > MAX_AMPLITUDE + 1e-9 or values["A"].min() < 0.0:
        low, high = values["A"].min(), values["A"].max()
        raise DataError(
            f"{source}: half amplitudes from {low:.4g} to {high:.4g} rad, expected 0 to {MAX_AMPLITUDE:.4g}; "
            "name the unit in the header, `A [deg]`, or say how to read them with --angles and --amplitude"
        )


def _convert_frequency(columns: Columns, conventions: Conventions) -> None:
    """Hz."""
    largest = float(columns.values["f"].max())
    rpm = conventions.frequency == "rpm"
    if conventions.frequency is None and "f" not in columns.told and largest > MAX_FREQUENCY:
        rpm = True
        columns.notes.append(f"frequencies reach {largest:.4g}: taken for beats per minute (--frequency)")
    if rpm and "f" not in columns.told:
        columns.values["f"] = columns.values["f"] / 60.0
    low, high = columns.values["f"].min(), columns.values["f"].max()
    if high > MAX_FREQUENCY or low < 0.0:
        raise DataError(
            f"{columns.source}: frequencies from {low:.4g} to {high:.4g} Hz, expected 0 to "
            f"{MAX_FREQUENCY:g}; name the unit in the header, `f [rpm]`, or with --frequency"
        )
