"""Swims on an even grid of time, from a log of `finlab simulate`, or a CSV file of measurements and
commands.

A CSV file has a header and columns in any order: t [s]; of x, y, z [m], roll, pitch, yaw [rad], u,
v, w [m/s], p, q, r [rad/s] what was measured; and NAME.PART for each actuator, as commanded, with
the parts of `PARTS`. World: z up; body: x forward, y left, z up; pitch is positive nose down.
Degrees stand in the header, `yaw [deg]`. A sensor's cell may be empty or repeat the last one where
there is nothing new; an actuator's cells are empty where it was lost. Other columns are passed
over.
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binned_statistic

from finlab.actuators.fin.fin_model import MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.csv_table import TURNS
from finlab.files.guarded import check_shapes, json_of, read_arrays
from finlab.fit.columns import MAX_BYTES, command_columns, commands_in, read_columns
from finlab.layout import Fin, Layout
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.fin_motion import FinMotion
from finlab.swim.vehicle.many_bodies import body_rates, body_velocity

STEP_S = 0.1
"""Spacing of the grid [s]."""
SUBSTEPS = 2
"""Moments within a step at which the actuators' forces are taken."""
CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")
"""What sensors may say: position in the world [m], attitude [rad], velocity [m/s] and angular rates
[rad/s] in the body frame."""
ANGLES = slice(3, 6)
SMOOTHED = (11, 2)
"""Samples and order of the filter by Savitzky and Golay."""
SHORTEST_S = 30.0
"""Least duration [s]."""
LONGEST_GAP_S = 1.0
"""Longest time [s] between two rows; what the actuators did meanwhile is not known."""
UNITS = dict.fromkeys(("s", "m", "m/s", "rad/s", "hz", "n"), 1.0)
UNITS |= {**TURNS, "deg/s": TURNS["deg"], "°/s": TURNS["deg"]}
"""Units that a header may name, in SI."""
UNIT_OF = {"A": "half amplitudes in rad", "f": "Hz", "force": "N", "deflection": "rad"}
"""What is expected of commands that have an end."""


@dataclass(frozen=True)
class Swim:
    """N steps of one robot with n actuators."""

    name: str
    motion: Array
    """What the actuators did, (N, SUBSTEPS, n, 3), as their commands, of fins amplitude [rad],
    frequency [Hz], direction [rad]; NaN for one that gave nothing."""
    measured: Array
    """What the sensors said at the beginning of each step (N, 12), in the order of `CHANNELS`; NaN
    where there is nothing new."""

    def __len__(self) -> int:
        return len(self.motion)


def replay(layout: Layout, command: Array) -> Array:
    """What actuators that follow as they should do (N, SUBSTEPS, n, 3) under commands (N, n, 3),
    one per step, NaN for a lost one."""
    moving = ActuatorMotion(layout, FinMotion(layout))
    return np.array([followed(moving, row) for row in command])


def followed(moving: ActuatorMotion, command: Array) -> Array:
    """Moves actuators on by one step under a command (n, 3), and returns what they do (SUBSTEPS, n,
    3)."""
    motion = np.empty((SUBSTEPS, *command.shape))
    for s in range(SUBSTEPS):
        moving.step(command, STEP_S / SUBSTEPS / 2)
        motion[s] = np.where(moving.pushes[:, None], moving.command, np.nan)
        moving.step(command, STEP_S / SUBSTEPS / 2)
    return motion


def only_new(measured: Array) -> Array:
    """Samples (N, 12) of which those that a slow sensor only held are NaN."""
    held = np.zeros(measured.shape, bool)
    held[1:] = measured[1:] == measured[:-1]
    return np.where(held, np.nan, measured)


def smoothed(measured: Array) -> Array:
    """Samples (N, 12) without holes and with less noise: a first guess of what the robot did.
    Channels that say nothing are made of the others, or zero."""
    from scipy.signal import savgol_filter

    grid = np.arange(len(measured))
    full = np.zeros(measured.shape)
    for k, fresh, values in _channels(measured):
        full[:, k] = np.interp(grid, grid[fresh], values)
    said = np.asarray(np.isfinite(measured).any(axis=0))
    full[:, said] = savgol_filter(full[:, said], *SMOOTHED, axis=0)
    pace = np.gradient(full, STEP_S, axis=0)
    angles = full[:, ANGLES]
    made = np.concatenate(
        [body_velocity(angles, pace[:, :3]), body_rates(angles, pace[:, ANGLES])], axis=1
    )
    full[:, 6:] = np.where(said[6:], full[:, 6:], made)
    return full


def _channels(measured: Array) -> Iterator[tuple[int, NDArray[np.bool_], Array]]:
    """Channels of samples (N, 12) that say something, with the rows (N,) where they do and the
    values there, angles without jumps."""
    for k, column in enumerate(measured.T):
        fresh = np.isfinite(column)
        if fresh.any():
            yield (
                k,
                fresh,
                np.unwrap(column[fresh]) if ANGLES.start <= k < ANGLES.stop else column[fresh],
            )


def read_swim(path: str | os.PathLike[str], layout: Layout) -> Swim:
    """Returns the swim in a file. Raises DataError: the file is missing, too large or too short,
    belongs to another robot, lacks a column, or holds what cannot be; the sentence names the row or
    the column."""
    place = Path(path)
    return _log(place, layout) if place.suffix.lower() == ".npz" else _csv(place, layout)


def _log(path: Path, layout: Layout) -> Swim:
    names = ("time", "measured", "command")
    arrays = read_arrays(path, ("meta", *names), MAX_BYTES, "a swim log written by finlab simulate")
    meta = json_of(arrays["meta"], f"{path}: meta")
    said = meta.get("fins") if isinstance(meta, dict) else None
    own = [str(name) for name in said] if isinstance(said, list) else []
    if sorted(own) != sorted(layout.names):
        raise DataError(
            f"{path}: is of a robot with the actuators {', '.join(own)}, layout {layout.name} has "
            f"{', '.join(layout.names)}"
        )
    n = arrays["time"].size
    check_shapes(
        arrays, {"time": (n,), "measured": (n, 12), "command": (n, len(own), 3)}, str(path)
    )
    time, measured, command = (np.asarray(arrays[name], np.float64) for name in names)
    if not np.isfinite(time).all():
        raise DataError(f"{path}: expected finite numbers in time")
    if len(time) > 1 and not np.allclose(np.diff(time), STEP_S):
        raise DataError(
            f"{path}: expected a row every {STEP_S:g} s, as finlab simulate writes them"
        )
    _check_duration(len(time) * STEP_S, path)
    command = command[:, [own.index(name) for name in layout.names]]
    _check_commands(command, [f"{path}: row {k}" for k in range(1, n + 1)], layout)
    return Swim(path.name, replay(layout, command), only_new(measured))


def _check_duration(seconds: float, path: Path) -> None:
    if seconds < SHORTEST_S:
        least = f"expected at least {SHORTEST_S:g} s; five minutes are a good length"
        raise DataError(f"{path}: lasts {seconds:.1f} s, {least}")


def _csv(path: Path, layout: Layout) -> Swim:
    commands = sum(command_columns(layout), [])
    names = {name: name for name in ("t", *CHANNELS, *commands)}
    pairs = [f"{pose}|{rate}" for pose, rate in zip(CHANNELS[:6], CHANNELS[6:], strict=True)]
    expected = f"t, what was measured, and what was commanded, {', '.join(commands)}"
    read = read_columns(path, names, ("t", *commands, *pairs), expected, UNITS, gaps=True)
    n = len(read.sources)
    places = read.sources
    time = read.values["t"]
    _check_time(time, places)
    _check_duration(float(time[-1] - time[0]), path)
    for name in set(CHANNELS) & set(read.values):
        said = read.values[name][np.isfinite(read.values[name])]
        if len(said) < 2 or np.ptp(said) == 0.0:
            what = f"{said[0]:g} throughout" if len(said) else "empty"
            raise DataError(
                f"{path}: column {name} is {what}; is the sensor connected? leave the column out"
            )
    measured = np.stack([read.values.get(name, np.full(n, np.nan)) for name in CHANNELS], axis=-1)
    command = commands_in(read.values, layout)
    _check_commands(command, places, layout)
    grid = np.arange(time[0], time[-1], STEP_S)
    held = np.searchsorted(time, grid + 1e-6, side="right") - 1
    command = command[held]
    measured = _on_grid(time, only_new(measured), grid)
    return Swim(path.name, replay(layout, command), measured)


def _check_time(time: Array, places: Sequence[str]) -> None:
    steps = np.diff(time)
    for k in np.flatnonzero(~((steps > 0.0) & (steps <= LONGEST_GAP_S))).tolist():
        raise DataError(
            f"{places[k + 1]}, column t: {time[k + 1]:g} s after {time[k]:g} s, expected times "
            f"that rise by {LONGEST_GAP_S:g} s at most; sort the rows, or cut the file there and "
            "name both parts"
        )


def _check_commands(command: Array, places: Sequence[str], layout: Layout) -> None:
    known = np.isfinite(command)
    for k, i in np.argwhere(known.any(axis=2) & ~known.all(axis=2)):
        columns = ", ".join(command_columns(layout)[i])
        raise DataError(
            f"{places[k]}: of {columns} some are empty; fill all, or none for an actuator that "
            "was lost"
        )
    for i, one in enumerate(layout.actuators):
        for part, number in enumerate(one.KIND.numbers):
            if number.name not in UNIT_OF:
                continue
            low = one.lower[part]
            high = one.upper[part]
            if isinstance(one, Fin):
                low = 0.0
                high = (MAX_AMPLITUDE, MAX_FREQUENCY)[part]
            wrong = (command[:, i, part] < low - 1e-6) | (command[:, i, part] > high + 1e-6)
            if wrong.any():
                k = int(np.argmax(wrong))
                raise DataError(
                    f"{places[k]}, column {one.name}.{number.name}, holds {command[k, i, part]:g}, "
                    f"expected {UNIT_OF[number.name]} from {low:.4g} to {high:.4g}"
                )


def _on_grid(time: Array, measured: Array, grid: Array) -> Array:
    """New samples (N, 12) at times (N,) as means within half a step of the grid's times (M,), (M,
    12)."""
    edges = np.append(grid, grid[-1] + STEP_S) - 0.5 * STEP_S
    means = np.full((len(grid), measured.shape[1]), np.nan)
    for k, fresh, values in _channels(measured):
        means[:, k] = binned_statistic(time[fresh], values, "mean", edges).statistic
    return means
