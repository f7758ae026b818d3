"""Reads measurements of one fin on a load cell: cycle means of forces by command, from CSV files.

`fin_fit` fits a fin to them.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_model import MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.arrays import Array
from finlab.axes import FILE_TURN_TOLERANCE, TURN
from finlab.errors import DataError
from finlab.fit.columns import Columns, concatenate, read_columns

NEEDED_COLUMNS = ("A", "f", "Fy", "Fz")
"""Columns without which no fin can be fitted."""
NAMES = {
    "a": "A", "amplitude": "A", "stroke": "A", "f": "f", "frequency": "f",
    "phi": "phi", "zero_direction": "phi", "direction": "phi",
    "fx": "Fx", "fy": "Fy", "fz": "Fz", "p": "P", "power": "P",
}  # fmt: skip
"""Quantities by the words for them, in lower case."""
MIN_SAMPLES = 20
"""Fewest samples of a fit."""
MIN_RANGE = 1e-3
"""Amplitudes [rad] or frequencies [Hz] whose range is less than this count as one value."""
MIN_DIRECTION_RANGE = 0.05
"""The same of zero directions [rad]."""


@dataclass(frozen=True)
class Measurements:
    """Cycle means of one fin in its own frame (x' shaft, y' horizontal thrust axis, z' up)."""

    command: Array
    """Half amplitude [rad], frequency [Hz], zero direction [rad], (n, 3)."""
    force: Array
    """Mean force [N], (n, 3)."""
    power: Array | None
    """Mean mechanical power [W], (n,); None where a file has none."""
    sources: tuple[str, ...]
    """File and line of each sample."""
    notes: tuple[str, ...]
    """What was filled in or left out, a sentence each."""
    has_directions: bool = True
    """Whether several zero directions were measured; if not, the fin counts as the same all
    round."""

    def __len__(self) -> int:
        return len(self.command)

    @property
    def reach(self) -> tuple[float, float]:
        """Largest amplitude [rad] and frequency [Hz] that were measured."""
        return float(self.command[:, 0].max()), float(self.command[:, 1].max())

    def scaled(self, command: Array) -> Array:
        """Returns commands (..., 3) as inputs (m, 3) of a fit: amplitude and frequency over the
        largest ones, and one zero direction for all where only one was measured."""
        inputs = command.reshape(-1, 3).copy()
        inputs[:, :2] /= self.reach
        if not self.has_directions:
            inputs[:, 2] = 0.0
        return inputs

    def thrust(self) -> tuple[Array, float]:
        """Returns the forces along the thrust's mean direction, across it and along the shaft (n,
        3) [N], and the angle [rad] from the zero direction to that direction."""
        force = self.force
        phi = self.command[:, 2]
        planar = (force[:, 1] + 1j * force[:, 2]) * np.exp(-1j * phi)
        deflection = float(np.angle(planar.sum()))
        planar *= np.exp(-1j * deflection)
        return np.stack([planar.real, planar.imag, force[:, 0]], axis=-1), deflection

    def without(self, excluded: NDArray[np.bool_]) -> "Measurements":
        """Returns the samples without those that are marked, (n,)."""
        keep = ~excluded
        power = None if self.power is None else self.power[keep]
        sources = tuple(np.array(self.sources)[keep].tolist())
        return replace(
            self, command=self.command[keep], force=self.force[keep], power=power, sources=sources
        )


def read_measurements(paths: Sequence[str | os.PathLike[str]]) -> Measurements:
    """Returns the samples of all files together.

    Each file has a header; columns come in any order, units may follow names (`A [deg]`), else they
    are SI. They are cycle means: A (or stroke), f, Fy, Fz and perhaps phi, Fx, P.

    Args:
        paths: the CSV files.

    Raises:
        DataError: a file is missing, too large, lacks a column or holds what no fin can do; or
            there are too few samples, or only one amplitude or frequency.
    """
    if not paths:
        raise DataError("expected at least one CSV file of measurements, got none")
    files = [
        read_columns(Path(path), NAMES, NEEDED_COLUMNS, "A, f, phi, Fx, Fy, Fz in any order")
        for path in paths
    ]
    for file, path in zip(files, paths, strict=True):
        _check_units(file.values, str(path))
    return _checked(files, ", ".join(str(path) for path in paths))


def _check_units(values: dict[str, Array], source: str) -> None:
    """Refuses amplitudes [rad] and frequencies [Hz] that no fin has, as in a file in other
    units."""
    hint = "`A [deg]`, and call whole strokes `stroke`"
    _check_range(values["A"], MAX_AMPLITUDE, f"{source}: half amplitudes", "rad", hint)
    _check_range(values["f"], MAX_FREQUENCY, f"{source}: frequencies", "Hz", "`f [rpm]`")


def _check_range(values: Array, limit: float, what: str, unit: str, hint: str) -> None:
    """Refuses values that do not lie between 0 and a limit."""
    low = float(values.min())
    high = float(values.max())
    if high > limit + 1e-9 or low < 0.0:
        raise DataError(
            f"{what} from {low:.4g} to {high:.4g} {unit}, expected 0 to {limit:.4g}; name another "
            f"unit in the header, {hint}"
        )


def _checked(files: list[Columns], source: str) -> Measurements:
    """The samples of all files; an error where no fin can be fitted to them."""
    sources: list[str] = []
    for file in files:
        sources += file.sources
    notes: list[str] = []
    n = len(sources)
    if n < MIN_SAMPLES:
        raise DataError(
            f"{source}: {n} samples, expected at least {MIN_SAMPLES}; 300 are a good number"
        )
    columns = concatenate([file.values for file in files])
    for name, unit in (("A", "rad"), ("f", "Hz")):
        if np.ptp(columns[name]) < MIN_RANGE:
            raise DataError(
                f"{source}: column {name} has the one value {columns[name][0]:.4g} {unit}, "
                "expected several; a fin's force cannot be determined from one amplitude or one "
                "frequency"
            )
    phi, has_directions = _directions(columns, source, notes)
    if "Fx" not in columns:
        columns["Fx"] = np.zeros(n)
        notes.append("there is no column Fx: no force along the shaft is assumed")
    command = np.stack([columns["A"], columns["f"], phi], axis=-1)
    force = np.stack([columns[name] for name in ("Fx", "Fy", "Fz")], axis=-1)
    if not force[:, 1:].any():
        raise DataError(f"{source}: Fy and Fz are 0 throughout; such a fin drives nothing")
    power = columns.get("P")
    for name in ("Fx", "Fy", "Fz", "P"):
        if name in columns and columns[name][0] and np.ptp(columns[name]) == 0.0:
            value = f"{columns[name][0]:.4g}"
            raise DataError(
                f"{source}: column {name} is {value} throughout; is the sensor connected?"
            )
    if power is not None and power.min() < -0.02 * np.abs(power).max():
        raise DataError(
            f"{source}: column P has {power.min():.4g} W, expected the mean power that drives the "
            "fin"
        )
    return Measurements(command, force, power, tuple(sources), tuple(notes), has_directions)


def _directions(columns: dict[str, Array], source: str, notes: list[str]) -> tuple[Array, bool]:
    """Zero directions (n,) [rad], and whether there are several; a note where there are not."""
    phi = columns.get("phi")
    if phi is not None and np.ptp(phi) > TURN + FILE_TURN_TOLERANCE:
        span = f"{np.ptp(phi):.4g} rad; name their unit in the header, `phi [deg]`"
        raise DataError(f"{source}: the zero directions span {span}")
    if phi is not None and np.ptp(phi) >= MIN_DIRECTION_RANGE:
        return phi, True
    reason = "there is no column phi" if phi is None else f"phi is {phi[0]:.3f} rad throughout"
    notes.append(
        f"{reason}: the other directions are filled by symmetry, as a fin that is the same all "
        "round"
    )
    return np.zeros(len(columns["A"])) if phi is None else phi, False
