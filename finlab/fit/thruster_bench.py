"""What a bench measured of one thruster in still water: force and power over its command, from CSV files."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.columns import read_columns, together

NAMES = {
    "pwm": "PWM", "pulse": "PWM", "pulse_width": "PWM", "rpm": "rpm", "input": "input", "command": "input",
    "throttle": "input", "force": "force", "thrust": "force", "power": "power", "p": "power",
    "voltage": "voltage", "current": "current", "torque": "torque",
}  # fmt: skip
COMMANDS = {"PWM": "us", "input": "", "rpm": "rpm"}
"""Columns of commands with their units; the first that a file has is taken."""
EXPECTED = (
    "a command (PWM, input or rpm), force, and power or voltage and current; units in brackets, "
    "`force [kgf]`; `finlab fit fin` takes A, f, Fy, Fz of fins"
)
MIN_COMMANDS = 5
"""Fewest different commands."""
NEGATIVE = 0.02
"""Share of the largest power by which a power may lie below 0, as noise."""


@dataclass(frozen=True)
class Bench:
    """Rows of one thruster in the order of the command."""

    command: Array
    """In `unit`, rising, some of them repeated (n,)."""
    force: Array
    """[N], (n,)."""
    power: Array
    """Electrical power [W], (n,)."""
    torque: Array | None
    """Torque on the thruster about its axis [N m], (n,), where the file tells it."""
    unit: str
    """Unit of the command."""
    source: str
    """Names of the files."""
    notes: tuple[str, ...]
    """What was filled in or left aside, a sentence each."""


def read_bench(paths: Sequence[str | os.PathLike[str]]) -> Bench:
    """Returns the rows of all files together.

    Raises:
        DataError: a file is missing, lacks a column or holds what no thruster does.
    """
    needed = ("|".join(COMMANDS), "force", "power|voltage", "power|current")
    files = [read_columns(Path(path), NAMES, needed, EXPECTED) for path in paths]
    values, source = together(files), ", ".join(str(path) for path in paths)
    places = [place for file in files for place in file.places]
    told = [name for name in COMMANDS if name in values]
    if not told:
        raise DataError(f"{source}: no command stands in all files, expected {EXPECTED}")
    kind, command, force, notes = told[0], values[told[0]], values["force"], []
    if told[1:]:
        notes.append(f"commands are those of column {kind}; {' and '.join(told[1:])} is left aside")
    if kind == "rpm" and command.min() >= 0.0 > force.min():
        command = np.where(force < 0.0, -command, command)
        notes.append("column rpm has no sign: rows with negative forces got one")
    power = values["power"] if "power" in values else np.abs(values["voltage"] * values["current"])
    if power.min() < -NEGATIVE * np.abs(power).max():
        place = places[int(np.argmin(power))]
        raise DataError(
            f"{place}: the power is {power.min():.4g} W, expected what the thruster takes, 0 or more"
        )
    if not force.any() or not power.any():
        raise DataError(f"{source}: {'power' if force.any() else 'force'} is 0 throughout; is it connected?")
    count = len(np.unique(command))
    if count < MIN_COMMANDS:
        raise DataError(f"{source}: {count} different commands, expected at least {MIN_COMMANDS}")
    order = np.argsort(command, kind="stable")
    torque = values["torque"][order] if "torque" in values else None
    return Bench(
        command[order],
        force[order],
        np.maximum(power[order], 0.0),
        torque,
        COMMANDS[kind],
        source,
        tuple(notes),
    )
