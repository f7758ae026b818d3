"""Swims from files: a log of `finlab simulate`, or a CSV file of time, measurements and commands.

A CSV file has a header and columns in any order: t [s]; of x, y, z [m], roll, pitch, yaw [rad], u, v, w
[m/s], p, q, r [rad/s] what was measured; and FIN.A, FIN.f, FIN.phi for each fin, as commanded. World: z up;
body: x forward, y left, z up; pitch is positive nose down. Degrees stand in the header, `yaw [deg]`. A
sensor's cell may be empty or repeat the last one where there is nothing new; a fin's three cells are empty
where it was lost. Other columns are passed over.
"""

import math
import os
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.archive import check_shapes, json_of, read_arrays
from finlab.files.csv_table import read_table
from finlab.fit.robot.swim import ANGLES, CHANNELS, STEP_S, Swim, only_new, replay
from finlab.layout import Layout
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY

MAX_BYTES = 200_000_000
"""Largest file that is read [bytes]; an hour at 50 Hz has half of it."""
SHORTEST_S = 30.0
"""Least duration [s]."""
LONGEST_GAP_S = 1.0
"""Longest time [s] between two rows; what the fins did meanwhile is not known."""
COMMANDS = ("A", "f", "phi")
DEGREES = ("deg", "deg/s", "degrees")
"""Units in a header that are turned into radians."""


def read_swim(path: str | os.PathLike[str], layout: Layout) -> Swim:
    """Returns the swim in a file.

    Raises:
        DataError: the file is missing, too large or too short, belongs to another robot, lacks a column, or
            holds what cannot be; where it is a row or a column, the sentence names it.
    """
    place = Path(path)
    return _log(place, layout) if place.suffix.lower() == ".npz" else _csv(place, layout)


def _log(path: Path, layout: Layout) -> Swim:
    """A log of `finlab simulate`."""
    names = ("time", "measured", "command")
    arrays = read_arrays(path, ("meta", *names), MAX_BYTES, "a swim log written by finlab simulate")
    meta = json_of(arrays["meta"], f"{path}: meta")
    said = meta.get("fins") if isinstance(meta, dict) else None
    fins = [str(name) for name in said] if isinstance(said, list) else []
    if sorted(fins) != sorted(layout.names):
        raise DataError(
            f"{path}: is of a robot with the fins {', '.join(fins)}, layout {layout.name} has "
            f"{', '.join(layout.names)}"
        )
    n = arrays["time"].size
    check_shapes(arrays, {"time": (n,), "measured": (n, 12), "command": (n, len(fins), 3)}, str(path))
    time, measured, command = (np.asarray(arrays[name], np.float64) for name in names)
    if not np.isfinite(time).all():
        raise DataError(f"{path}: expected finite numbers in time")
    order = [fins.index(name) for name in layout.names]
    if len(time) > 1 and not np.allclose(np.diff(time), STEP_S):
        raise DataError(f"{path}: expected a row every {STEP_S:g} s, as finlab simulate writes them")
    _check_duration(len(time) * STEP_S, path)
    command = command[:, order]
    _check_commands(command, np.arange(1, n + 1), layout, path)
    return Swim(path.name, replay(layout, command), only_new(measured), command)


def _check_duration(seconds: float, path: Path) -> None:
    if seconds < SHORTEST_S:
        raise DataError(
            f"{path}: lasts {seconds:.1f} s, expected at least {SHORTEST_S:g} s; five minutes are a good "
            "length"
        )


def _csv(path: Path, layout: Layout) -> Swim:
    """A CSV file."""
    table = read_table(path, MAX_BYTES, "a CSV file of a swim", gaps=True)
    columns = _columns(table.header, layout, path)
    used = [k for k, column in enumerate(columns) if column.place is not None]
    read, lines = table.numbers([column.place for column in columns if column.place is not None])
    values = np.full((len(lines), len(columns)), np.nan)
    values[:, used] = read * [columns[k].factor for k in used]
    if np.isnan(values[:, 0]).any():
        line = lines[int(np.argmax(np.isnan(values[:, 0])))]
        raise DataError(f"{path}: line {line}, column t, is empty")
    time, measured = values[:, 0], values[:, 1:13]
    command = values[:, 13:].reshape(len(lines), layout.n_fins, 3)
    _check_time(time, lines, path)
    _check_measured(measured, columns, path)
    _check_commands(command, lines, layout, path)
    grid = np.arange(time[0], time[-1], STEP_S)
    held = np.searchsorted(time, grid + 1e-6, side="right") - 1
    command, measured = command[held], _on_grid(time, only_new(measured), grid)
    return Swim(path.name, replay(layout, command), measured, command)


class _Column(NamedTuple):
    """One column that is read."""

    name: str
    """Of `t`, `CHANNELS` or a fin's command."""
    place: int | None
    factor: float


def _columns(header: list[str], layout: Layout, path: Path) -> list[_Column]:
    """All columns that there may be, in order: time, measurements, commands."""
    commands = [f"{fin}.{part}" for fin in layout.names for part in COMMANDS]
    found: dict[str, _Column] = {}
    for i, cell in enumerate(header):
        name, _, unit = re.sub(r"[\])]", " ", cell.replace("(", "[")).partition("[")
        name = name.strip()
        if name in found:
            raise DataError(f"{path}: column {name} appears twice; keep one")
        if name in ("t", *CHANNELS, *commands):
            degrees = unit.strip().lower() in DEGREES
            found[name] = _Column(name, i, math.radians(1.0) if degrees else 1.0)
    for name in ("t", *commands):
        if name not in found:
            raise DataError(
                f"{path}: column {name} is missing, expected t, what was measured, and FIN.A, FIN.f, FIN.phi "
                "for each fin"
            )
    for one, other in (("xyz", "uvw"), (CHANNELS[ANGLES], "pqr")):
        if not set(one) <= set(found) and not set(other) <= set(found):
            raise DataError(f"{path}: expected the columns {', '.join(one)} or {', '.join(other)}")
    return [found.get(name, _Column(name, None, 1.0)) for name in ("t", *CHANNELS, *commands)]


def _check_time(time: Array, lines: NDArray[np.intp], path: Path) -> None:
    """Time must rise, without gaps, for long enough."""
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        k = int(back[0])
        raise DataError(
            f"{path}: line {lines[k + 1]}, column t: time runs backwards or stands still, {time[k + 1]:g} s "
            f"after {time[k]:g} s; sort the rows, or cut the file there"
        )
    gaps = np.flatnonzero(steps > LONGEST_GAP_S)
    if len(gaps):
        k = int(gaps[0])
        raise DataError(
            f"{path}: line {lines[k + 1]}, column t: {steps[k]:.1f} s without a row before it, expected at "
            f"most {LONGEST_GAP_S:g} s; cut the file there and name both parts"
        )
    _check_duration(float(time[-1] - time[0]), path)


def _check_measured(measured: Array, columns: list[_Column], path: Path) -> None:
    """Every column that is there must say something."""
    for k, column in enumerate(columns[1:13]):
        said = measured[np.isfinite(measured[:, k]), k]
        if column.place is not None and (len(said) < 2 or np.ptp(said) == 0.0):
            what = f"{said[0]:g} throughout" if len(said) else "empty"
            raise DataError(
                f"{path}: column {column.name} is {what}; is the sensor connected? leave the column out"
            )


def _check_commands(command: Array, lines: NDArray[np.intp], layout: Layout, path: Path) -> None:
    """A fin is commanded by three numbers that it can do, or by none."""
    known = np.isfinite(command)
    half = np.argwhere(known.any(axis=2) & ~known.all(axis=2))
    if len(half):
        k, i = half[0]
        raise DataError(
            f"{path}: line {lines[k]}: of {layout.names[i]}.A, .f and .phi some are empty; fill all three, "
            "or none for a fin that was lost"
        )
    for part, most, hint in ((0, MAX_AMPLITUDE, "half amplitudes in rad"), (1, MAX_FREQUENCY, "Hz")):
        wrong = np.argwhere((command[..., part] < 0.0) | (command[..., part] > most + 1e-9))
        if len(wrong):
            k, i = wrong[0]
            raise DataError(
                f"{path}: line {lines[k]}, column {layout.names[i]}.{COMMANDS[part]}, holds "
                f"{command[k, i, part]:g}, expected {hint} from 0 to {most:.4g}"
            )


def _on_grid(time: Array, measured: Array, grid: Array) -> Array:
    """New samples (N, 12) at times (N,) as means within half a step of the grid's times (M,), (M, 12)."""
    cell = np.rint((time - grid[0]) / STEP_S).astype(int)
    found = np.full((len(grid), measured.shape[1]), np.nan)
    for k in range(measured.shape[1]):
        fresh = np.isfinite(measured[:, k]) & (cell < len(grid))
        if not fresh.any():
            continue
        values = measured[fresh, k]
        if ANGLES.start <= k < ANGLES.stop:
            values = np.unwrap(values)
        count = np.bincount(cell[fresh], minlength=len(grid))
        total = np.bincount(cell[fresh], weights=values, minlength=len(grid))
        found[:, k] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return found
