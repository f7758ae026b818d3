"""Samples of one fin on a load cell, cycle means, read from CSV files."""

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
from finlab.fit.columns import Columns, read_columns, together

NEEDED = ("A", "f", "Fy", "Fz")
"""Columns without which no fin can be fitted."""
NAMES = {
    "a": "A", "amplitude": "A", "stroke": "A", "f": "f", "frequency": "f",
    "phi": "phi", "zero_direction": "phi", "direction": "phi",
    "fx": "Fx", "fy": "Fy", "fz": "Fz", "p": "P", "power": "P",
}  # fmt: skip
MIN_SAMPLES = 20
SAME = 1e-3
"""Amplitudes [rad] or frequencies [Hz] all closer than this are one and the same."""
SAME_DIRECTION = 0.05
"""The same of zero directions [rad]."""


@dataclass(frozen=True)
class Measurements:
    """Samples of one fin in its own frame (x' shaft, y' horizontal thrust axis, z' up), cycle
    means."""

    command: Array
    """Half amplitude [rad], frequency [Hz], zero direction [rad], (n, 3)."""
    force: Array
    """Mean force [N], (n, 3)."""
    power: Array | None
    """Mean mechanical power [W], (n,), where the file tells it."""
    places: tuple[str, ...]
    """Where each sample stands, file and line."""
    notes: tuple[str, ...]
    """What was filled in or left out, a sentence each."""
    turned: bool = True
    """Whether several zero directions were measured; if not, the fin counts as the same all
    round."""

    def __len__(self) -> int:
        return len(self.command)

    @property
    def reach(self) -> tuple[float, float]:
        """Largest amplitude [rad] and frequency [Hz] that were measured."""
        return float(self.command[:, 0].max()), float(self.command[:, 1].max())

    def scaled(self, command: Array) -> Array:
        """Returns commands (..., 3) as inputs (m, 3) of a fit: over the reach, and all in one
        direction where only one was measured."""
        inputs = command.reshape(-1, 3).copy()
        inputs[:, :2] /= self.reach
        if not self.turned:
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

    def without(self, places: NDArray[np.bool_]) -> "Measurements":
        """The samples but those (n,) that are marked."""
        keep = ~places
        power = None if self.power is None else self.power[keep]
        named = tuple(np.array(self.places)[keep].tolist())
        return replace(
            self, command=self.command[keep], force=self.force[keep], power=power, places=named
        )


def read_measurements(paths: Sequence[str | os.PathLike[str]]) -> Measurements:
    """Returns the samples of all files together.

    Each file has a header; columns come in any order, units may stand behind names (`A [deg]`),
    else they are SI. They are cycle means: A (or stroke), f, Fy, Fz and perhaps phi, Fx, P. Raises
    DataError: a file is missing, too large, lacks a column or holds what no fin can do; or there
    are too few samples, or only one amplitude or frequency."""
    read = [
        read_columns(Path(path), NAMES, NEEDED, "A, f, phi, Fx, Fy, Fz in any order")
        for path in paths
    ]
    if not read:
        raise DataError("expected at least one CSV file of measurements, got none")
    for file, path in zip(read, paths, strict=True):
        _check_units(file.values, str(path))
    return _checked(read, ", ".join(str(path) for path in paths))


def _check_units(values: dict[str, Array], source: str) -> None:
    """Refuses amplitudes [rad] and frequencies [Hz] that no fin has, as in a file in other
    units."""
    for name, what, most, unit, hint in (
        (
            "A",
            "half amplitudes",
            MAX_AMPLITUDE,
            "rad",
            "`A [deg]`, and call whole strokes `stroke`",
        ),
        ("f", "frequencies", MAX_FREQUENCY, "Hz", "`f [rpm]`"),
    ):
        low = float(values[name].min())
        high = float(values[name].max())
        if high > most + 1e-9 or low < 0.0:
            raise DataError(
                f"{source}: {what} from {low:.4g} to {high:.4g} {unit}, expected 0 to {most:.4g}; "
                "name "
                f"another unit in the header, {hint}"
            )


def _checked(read: list[Columns], source: str) -> Measurements:
    """The samples of all files, with what is wrong with all together said in a sentence."""
    places = tuple(place for file in read for place in file.places)
    notes = list[str]()
    if (n := len(places)) < MIN_SAMPLES:
        raise DataError(
            f"{source}: {n} samples, expected at least {MIN_SAMPLES}; 300 are a good number"
        )
    columns = together([file.values for file in read])
    for name, unit in (("A", "rad"), ("f", "Hz")):
        if np.ptp(columns[name]) < SAME:
            raise DataError(
                f"{source}: column {name} has the one value {columns[name][0]:.4g} {unit}, "
                "expected several; "
                "a fin's force cannot be determined from one amplitude or one frequency"
            )
    phi, turned = _directions(columns, source, notes)
    if "Fx" not in columns:
        columns["Fx"] = np.zeros(len(places))
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
        least = f"{power.min():.4g} W, expected the mean power that drives the fin"
        raise DataError(f"{source}: column P has {least}")
    return Measurements(command, force, power, places, tuple(notes), turned)


def _directions(columns: dict[str, Array], source: str, notes: list[str]) -> tuple[Array, bool]:
    """Zero directions (n,) [rad], and whether there are several; a note where there are not."""
    phi = columns.get("phi")
    if phi is not None and np.ptp(phi) > TURN + FILE_TURN_TOLERANCE:
        span = f"{np.ptp(phi):.4g} rad; name their unit in the header, `phi [deg]`"
        raise DataError(f"{source}: the zero directions span {span}")
    if phi is not None and np.ptp(phi) >= SAME_DIRECTION:
        return phi, True
    said = "there is no column phi" if phi is None else f"phi is {phi[0]:.3f} rad throughout"
    notes.append(
        f"{said}: the other directions are filled by symmetry, as a fin that is the same all round"
    )
    return np.zeros(len(columns["A"])) if phi is None else phi, False
