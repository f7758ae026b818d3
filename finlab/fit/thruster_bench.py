"""Benches of one thruster in still water, from CSV files and workbooks: force and power over its
command.

At several voltages it is known which rows are of one voltage, and what lies between two of them.
"""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.columns import Columns, named_column, read_columns, sheets, together

_WORDS = {
    "PWM": "pwm pulse pulse_width pulsewidth pwm_signal pwm_value pwm_input pwm_width signal "
    "servo_signal "
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
"""Shares of the largest force: up to which a thruster rests, and from which on one pushes on either
side of the neutral command."""
MIN_COMMANDS = 5
"""Fewest different commands."""
NEGATIVE = 0.02
"""Share of the largest power by which a power may lie below 0, as noise."""
Rows = Mapping[str, Array]
"""Columns of a bench by name (n,), with `command`, `force` and `power`."""
NEAR = 0.05
"""Share by which voltages of one supply may differ."""
WITHIN = 0.3
"""Share of the commands at a voltage within those at a higher one, from which on the two are two
tables."""


def by_voltage(rows: Rows, command: Array) -> list[Rows]:
    """Returns the rows of one table, apart where it was measured at several voltages, commands
    (n,).

    A supply that sags under load is one: there commands of a lower voltage lie beyond those of a
    higher one.
    """
    volts = np.abs(rows["voltage"])
    parts = _levels(volts)
    tables = [parts[-1]]
    for part in parts[-2::-1]:
        higher = command[tables[-1]]
        if np.mean((command[part] >= higher.min()) & (command[part] <= higher.max())) > WITHIN:
            tables.append(part)
        else:
            tables[-1] = np.concatenate([part, tables[-1]])
    return [{name: values[np.sort(table)] for name, values in rows.items()} for table in tables]


def at_voltage(
    tables: Sequence[Rows], voltage: float | None, source: str
) -> tuple[Rows, tuple[str, ...]]:
    """Returns the rows of one voltage [V], None where there is only one, and notes on what was
    done.

    Each table is of one voltage, by its middle in column `voltage`; without that column of any.
    Raises DataError: there are several and none is named, or that one does not lie among them;
    `source` has the names of the files."""
    known = np.array(
        [np.median(np.abs(rows["voltage"])) if "voltage" in rows else np.nan for rows in tables]
    )
    groups = _levels(known)
    if np.isnan(known).any() and (voltage is not None or len(groups) > 1):
        raise DataError(f"{source}: does not tell at which voltage all rows were measured")
    levels = np.array([np.median(known[own]) for own in groups])
    named = f"measured at {', '.join(f'{level:.4g}' for level in levels)} V"
    if voltage is None and len(groups) > 1:
        raise DataError(f"{source}: {named}; say which counts, --voltage {levels[-1]:.4g}")
    within = [together([tables[k] for k in own]) for own in groups]
    if voltage is None:
        return within[0], ()
    near = int(np.argmin(np.abs(levels - voltage)))
    if abs(voltage - levels[near]) <= 0.5 * NEAR * levels[near]:
        return within[near], (f"{named}: the rows at {levels[near]:.4g} V are taken",) * (
            len(groups) > 1
        )
    if not levels[0] < voltage < levels[-1]:
        raise DataError(f"{source}: {named}, which tells nothing of {voltage:g} V")
    upper = int(np.searchsorted(levels, voltage))
    low, high = levels[upper - 1 : upper + 1].tolist()
    rows = _between(within[upper - 1], within[upper], (voltage - low) / (high - low))
    return rows, (f"interpolated between the rows at {low:.4g} V and at {high:.4g} V",)


def _levels(volts: Array) -> list[NDArray[np.intp]]:
    """Places of voltages (n,) that are one, the lowest first."""
    order = np.argsort(volts, kind="stable")
    steps = np.diff(volts[order]) > NEAR * volts[order][1:]
    return np.split(order, np.flatnonzero(steps) + 1)


def _between(low: Rows, high: Rows, share: float) -> Rows:
    """The table at a share of the way from one to the other, over commands that both reach."""
    ends = [(rows["command"].min(), rows["command"].max()) for rows in (low, high)]
    first = max(own[0] for own in ends)
    last = min(own[1] for own in ends)
    places = np.unique(np.concatenate([low["command"], high["command"]]))
    places = places[(places >= first) & (places <= last)]

    def means(rows: Rows, name: str) -> Array:
        at, where, count = np.unique(rows["command"], return_inverse=True, return_counts=True)
        return np.asarray(np.interp(places, at, np.bincount(where, rows[name]) / count))

    names = [name for name in low if name in high]
    return {name: (1.0 - share) * means(low, name) + share * means(high, name) for name in names}


@dataclass(frozen=True)
class BenchData:
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


def read_bench(paths: Sequence[str | os.PathLike[str]], voltage: float | None = None) -> BenchData:
    """Returns the rows of all files together.

    Paths are those of CSV files, and of workbooks (.xlsx) with a table in a sheet. Of several
    voltages the one named counts [V]; between two of them forces are interpolated. Raises
    DataError: a file is missing, lacks a column or holds what no thruster does, or there are
    several voltages and none is named."""
    read = [_tables(Path(path)) for path in paths]
    files = [table for tables, _ in read for table in tables]
    source = ", ".join(str(path) for path in paths)
    kind, *others = [name for name in COMMANDS if all(name in file.values for file in files)] or [
        ""
    ]
    if not kind:
        raise DataError(f"{source}: no command stands in all files, expected {EXPECTED}")
    notes = [note for _, said in read for note in said]
    if others:
        notes.append(f"commands are those of column {kind}; {' and '.join(others)} is left aside")
    if bare := {name: file.headers[name] for file in files for name in file.bare if name in TAKEN}:
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
        raise DataError(
            f"{path}: no sheet holds a table ({', '.join(other):.200}), expected {EXPECTED}"
        )
    tables = []
    for title, table in held.items():
        columns = _renamed(read_columns(table, NAMES, NEEDED, EXPECTED))
        volts = re.search(r"(\d+(?:[.,]\d+)?) ?v(?:olts?)?\b", title, flags=re.IGNORECASE)
        if volts and "voltage" not in columns.values:
            columns.values["voltage"] = np.full(
                len(columns.places), float(volts[1].replace(",", "."))
            )
        tables.append(columns)
    return tables, (f"no table in sheet {', '.join(other):.200}",) if other else ()


def _is_header(cells: Sequence[str]) -> bool:
    try:
        names = {named_column(cell, NAMES).name for cell in cells}
    except DataError:  # a header whose unit is not known, which is said when it is read
        return True
    return "force" in names and bool(names & set(COMMANDS))


def _renamed(columns: Columns) -> Columns:
    header = columns.headers.get("input", "")
    if "PWM" not in columns.values and re.match("[uµμm]", named_column(header, NAMES).unit):
        columns.values["PWM"] = columns.values.pop("input")
        columns.headers["PWM"] = header
    return columns


def _rows(file: Columns, kind: str, notes: list[str]) -> list[Rows]:
    """Rows of one table with signed forces, apart by voltage."""
    values = file.values
    command = values[kind]
    force = values["force"]
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
    """Rows whose forces have signs: where they are sizes alone, those below the neutral command
    push back."""
    command = rows["command"]
    force = rows["force"]
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


def _checked(values: Rows, kind: str, source: str, notes: tuple[str, ...]) -> BenchData:
    command = values["command"]
    force = values["force"]
    power = values["power"]
    if not force.any() or not power.any():
        raise DataError(
            f"{source}: {'power' if force.any() else 'force'} is 0 throughout; is it connected?"
        )
    count = len(np.unique(command))
    if count < MIN_COMMANDS:
        raise DataError(f"{source}: {count} different commands, expected at least {MIN_COMMANDS}")
    order = np.argsort(command, kind="stable")
    torque = values["torque"][order] if "torque" in values else None
    power = np.maximum(power[order], 0.0)
    return BenchData(command[order], force[order], power, torque, COMMANDS[kind], source, notes)
