"""What a bench measured of one thruster in still water: force and power over its command, from CSV files."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.columns import Columns, named_column, read_columns, sheets
from finlab.fit.voltages import Rows, at_voltage, by_voltage

_WORDS = {
    "PWM": "pwm pulse pulse_width pulsewidth pwm_signal pwm_value pwm_input pwm_width signal servo_signal "
    "esc esc_signal esc_pwm esc_input",
    "rpm": "rpm speed motor_speed",
    "input": "input command throttle esc_throttle motor_throttle duty duty_cycle",
    "force": "force thrust thrust_force total_thrust measured_thrust measured_force",
    "power": "power p electrical_power electric_power input_power power_in",
    "voltage": "voltage volts supply_voltage input_voltage battery_voltage bus_voltage",
    "current": "current amps supply_current input_current battery_current",
    "torque": "torque motor_torque",
}
NAMES = {word: name for name, words in _WORDS.items() for word in words.split()}
COMMANDS = {"PWM": "us", "input": "", "rpm": "rpm"}
"""Columns of commands with their units; the first that a file has is taken."""
EXPECTED = (
    "a command (PWM, input or rpm), force, and power or voltage and current; units in brackets, "
    "`force [kgf]`; `finlab fit fin` takes A, f, Fy, Fz of fins"
)
NEEDED = ("|".join(COMMANDS), "force", "power|voltage", "power|current")
TAKEN = {"PWM": "us", "force": "N", "power": "W", "voltage": "V", "current": "A", "torque": "N m"}
"""Units of columns that name none."""
UNSIGNED, PUSHES = 0.03, 0.1
"""Shares of the largest force: up to which a thruster rests, and from which on one pushes on either side of
the neutral command."""
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
    source: str
    """Names of the files."""
    notes: tuple[str, ...]
    """What was filled in or left aside, a sentence each."""


def read_bench(paths: Sequence[str | os.PathLike[str]], voltage: float | None = None) -> Bench:
    """Returns the rows of all files together.

    Paths are those of CSV files, and of workbooks (.xlsx) with a table in a sheet. Of several voltages the
    one named counts [V]; between two of them forces are interpolated. Raises DataError: a file is missing,
    lacks a column or holds what no thruster does, or there are several voltages and none is named."""
    read = [_tables(Path(path)) for path in paths]
    files, source = [table for tables, _ in read for table in tables], ", ".join(str(path) for path in paths)
    shared = [name for name in COMMANDS if all(name in file.values for file in files)]
    if not shared:
        raise DataError(f"{source}: no command stands in all files, expected {EXPECTED}")
    kind, notes = shared[0], [note for _, said in read for note in said]
    if shared[1:]:
        notes.append(f"commands are those of column {kind}; {' and '.join(shared[1:])} is left aside")
    bare = {name: file.headers[name] for file in files for name in file.bare if name in TAKEN}
    if bare:
        units = ", ".join(TAKEN[name] for name in bare)
        notes.append(f"no unit stands at {', '.join(bare.values())}: taken for {units}")
    tables = [rows for file in files for rows in _rows(file, kind, notes)]
    values, said = at_voltage(tables, voltage, source)
    return _checked(values, kind, source, (*dict.fromkeys(notes), *said))


def _tables(path: Path) -> tuple[list[Columns], tuple[str, ...]]:
    """The tables of a file, and notes on what was passed over."""
    if path.suffix.lower() not in (".xlsx", ".xlsm"):
        return [_renamed(read_columns(path, NAMES, NEEDED, EXPECTED))], ()
    held, other = sheets(path, _is_header)
    if not held:
        raise DataError(f"{path}: no sheet holds a table ({', '.join(other):.200}), expected {EXPECTED}")
    tables = []
    for title, table in held.items():
        columns = _renamed(read_columns(table, NAMES, NEEDED, EXPECTED))
        volts = re.search(r"(\d+(?:[.,]\d+)?) ?v(?:olts?)?\b", title, flags=re.IGNORECASE)
        if volts and "voltage" not in columns.values:
            columns.values["voltage"] = np.full(len(columns.places), float(volts[1].replace(",", ".")))
        tables.append(columns)
    return tables, (f"no table in sheet {', '.join(other):.200}",) if other else ()


def _is_header(cells: Sequence[str]) -> bool:
    """Whether cells stand above a table of a thruster."""
    try:
        names = {named_column(cell, NAMES).name for cell in cells}
    except DataError:  # a header whose unit is not known, which is said when it is read
        return True
    return "force" in names and bool(names & set(COMMANDS))


def _renamed(columns: Columns) -> Columns:
    """A throttle that is told as a pulse is one."""
    header = columns.headers.get("input", "")
    if "PWM" not in columns.values and re.match("[uµμm]", named_column(header, NAMES).unit):
        columns.values["PWM"], columns.headers["PWM"] = columns.values.pop("input"), header
    return columns


def _rows(file: Columns, kind: str, notes: list[str]) -> list[Rows]:
    """Rows of one table with signed forces, apart by voltage."""
    values = file.values
    command, force = values[kind], values["force"]
    if kind == "rpm" and named_column(file.headers[kind], NAMES).unit == "rpm":
        command = command * 60.0
    if kind == "rpm" and command.min() >= 0.0 > force.min():
        command = np.where(force < 0.0, -command, command)
        notes.append("column rpm has no sign: rows with negative forces got one")
    power = values["power"] if "power" in values else np.abs(values["voltage"] * values["current"])
    if power.min() < -NEGATIVE * np.abs(power).max():
        place = file.places[int(np.argmin(power))]
        least = f"{power.min():.4g} W, expected what the thruster takes, 0 or more"
        raise DataError(f"{place}: the power is {least}")
    rows = {"command": command, "force": force, "power": power}
    rows |= {name: values[name] for name in values if name in ("voltage", "torque")}
    apart = by_voltage(rows, command) if "voltage" in rows else [rows]
    return [_signed(each, COMMANDS[kind], notes) for each in apart]


def _signed(rows: Rows, unit: str, notes: list[str]) -> Rows:
    """Rows whose forces have signs: where they are sizes alone, those below the neutral command push back."""
    command, force = rows["command"], rows["force"]
    size = np.abs(force)
    if min(-force.min(), force.max()) > UNSIGNED * size.max():
        return rows
    neutral = float(np.median(command[size <= max(UNSIGNED * size.max(), size.min())]))
    sides = command < neutral, command > neutral
    if not all(size[own].max(initial=0.0) > PUSHES * size.max() for own in sides):
        return rows
    which = "sizes alone" if force.max() > -force.min() else "negative alone"
    notes.append(
        f"forces have no sign, they are {which}: those below the neutral command, "
        f"{f'{neutral:g} {unit}'.rstrip()}, count as reverse, negative"
    )
    return {**rows, "force": np.where(command < neutral, -size, size)}


def _checked(values: Rows, kind: str, source: str, notes: tuple[str, ...]) -> Bench:
    """The bench of rows of one voltage, if they can be one."""
    command, force, power = values["command"], values["force"], values["power"]
    if not force.any() or not power.any():
        raise DataError(f"{source}: {'power' if force.any() else 'force'} is 0 throughout; is it connected?")
    count = len(np.unique(command))
    if count < MIN_COMMANDS:
        raise DataError(f"{source}: {count} different commands, expected at least {MIN_COMMANDS}")
    order = np.argsort(command, kind="stable")
    torque = values["torque"][order] if "torque" in values else None
    power = np.maximum(power[order], 0.0)
    return Bench(command[order], force[order], power, torque, COMMANDS[kind], source, notes)
