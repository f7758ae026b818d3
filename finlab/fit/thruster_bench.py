"""Reads benches of one thruster in still water: force and power over its command.

Files are CSV files and workbooks. Where a bench was measured at several voltages, its rows are
split by voltage, and interpolated between two of them. `thruster_fit` fits a thruster to a bench.
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
from finlab.files.csv_table import CsvTable, read_table
from finlab.fit.columns import (
    MAX_BYTES,
    Columns,
    concatenate,
    named_column,
    read_columns,
    read_sheets,
)

_WORDS = {
    "PWM": "pwm pulse pulse_width pulsewidth pwm_signal pwm_value pwm_input pwm_width signal "
    "servo_signal esc esc_signal esc_pwm esc_input",
    "rpm": "rpm speed motor_speed",
    "input": "input command throttle esc_throttle motor_throttle duty duty_cycle",
    "force": "force thrust thrust_force total_thrust measured_thrust measured_force",
    "power": "power p electrical_power electric_power input_power power_in",
    "voltage": "voltage volts supply_voltage input_voltage battery_voltage bus_voltage",
    "current": "current amps supply_current input_current battery_current",
    "torque": "torque motor_torque",
}
"""Quantities, and the words for them with blanks between, in lower case."""
NAMES: dict[str, str] = {}
"""Quantities by the words for them."""
for _name, _words_of_name in _WORDS.items():
    NAMES |= dict.fromkeys(_words_of_name.split(), _name)
COMMANDS = {"PWM": "us", "input": "", "rpm": "rpm"}
"""Columns of commands with their units; the first that a file has is taken."""
EXPECTED_COLUMNS = (
    "a command (PWM, input or rpm), force, and power or voltage and current; units in brackets, "
    "`force [kgf]`; `finlab fit fin` takes A, f, Fy, Fz of fins"
)
"""What a sentence says was expected."""
NEEDED_COLUMNS = ("|".join(COMMANDS), "force", "power|voltage", "power|current")
"""Columns without which no thruster can be fitted; of `a|b` one is enough."""
DEFAULT_UNITS = {
    "PWM": "us",
    "force": "N",
    "power": "W",
    "voltage": "V",
    "current": "A",
    "torque": "N m",
}
"""Units of columns that name none."""
UNSIGNED = 0.03
"""Share of the largest force that forces of one sign do not exceed where all are sizes alone, or
where a thruster pushes one way; also that of a thruster at rest."""
PUSHING = 0.1
"""Share of the largest force from which on a thruster pushes on a side of the neutral command."""
MIN_COMMANDS = 5
"""Fewest different commands."""
NEGATIVE = 0.02
"""Share of the largest power by which a power may lie below 0, as noise."""
Rows = Mapping[str, Array]
"""Columns of a bench by name (n,), with `command`, `force` and `power`."""
_VOLTAGE = re.compile(r"(?:\bat |@ ?)?\b(\d+(?:[.,]\d+)?) ?v(?:olts?)?\b", re.IGNORECASE)
"""A voltage in the title of a sheet, or in a header."""
SAME_VOLTAGE = 0.05
"""Share by which voltages of one supply may differ."""
OVERLAP = 0.3
"""Share of the commands at a voltage within those at a higher one, from which on the two are two
tables."""


class VoltageError(DataError):
    """A bench was measured at several voltages, and none is named."""

    def __init__(self, text: str, levels: tuple[float, ...] = ()) -> None:
        """Takes the sentence, and the voltages [V], rising."""
        super().__init__(text)
        self.levels = levels


def by_voltage(rows: Rows, command: Array) -> list[Rows]:
    """Splits the rows of one table by the voltage of the supply.

    A supply that sags under load is one: there commands of a lower voltage lie beyond those of a
    higher one.

    Args:
        rows: the rows (n,), with a column `voltage` [V].
        command: their commands (n,).

    Returns:
        The rows of each supply.
    """
    volts = np.abs(rows["voltage"])
    groups = _groups_of_voltage(volts)
    supplies = [groups[-1]]  # indices of rows, from the highest voltage on
    for group in groups[-2::-1]:
        higher = command[supplies[-1]]
        is_within = (command[group] >= higher.min()) & (command[group] <= higher.max())
        if np.mean(is_within) > OVERLAP:
            supplies.append(group)
        else:
            supplies[-1] = np.concatenate([group, supplies[-1]])
    tables: list[Rows] = []
    for supply in supplies:
        indices = np.sort(supply)
        tables.append({name: values[indices] for name, values in rows.items()})
    return tables


def at_voltage(
    tables: Sequence[Rows], voltage: float | None, source: str
) -> tuple[Rows, tuple[str, ...]]:
    """Returns the rows at one voltage, and notes on how they were taken.

    Args:
        tables: tables of one voltage each, by the median of their column `voltage`.
        voltage: the voltage [V]; None where all tables are of one.
        source: names of the files, for the sentences.

    Raises:
        VoltageError: there are several voltages and none is named.
        DataError: the one that is named does not lie among them.
    """
    medians = []
    for rows in tables:
        medians.append(np.median(np.abs(rows["voltage"])) if "voltage" in rows else np.nan)
    voltages = np.array(medians)
    groups = _groups_of_voltage(voltages)
    if np.isnan(voltages).any() and (voltage is not None or len(groups) > 1):
        raise DataError(f"{source}: does not tell at which voltage all rows were measured")
    levels = np.array([np.median(voltages[group]) for group in groups])
    measured = f"measured at {', '.join(f'{level:.4g}' for level in levels)} V"
    if voltage is None and len(groups) > 1:
        text = f"{source}: {measured}; say which counts, --voltage {levels[-1]:.4g}"
        raise VoltageError(text, tuple(levels.tolist()))
    rows_of_level = [concatenate([tables[k] for k in group]) for group in groups]
    if voltage is None:
        return rows_of_level[0], ()
    nearest = int(np.argmin(np.abs(levels - voltage)))
    if abs(voltage - levels[nearest]) <= 0.5 * SAME_VOLTAGE * levels[nearest]:
        if len(groups) == 1:
            return rows_of_level[nearest], ()
        return rows_of_level[nearest], (
            f"{measured}: the rows at {levels[nearest]:.4g} V are taken",
        )
    if not levels[0] < voltage < levels[-1]:
        raise DataError(f"{source}: {measured}, which tells nothing of {voltage:g} V")
    upper = int(np.searchsorted(levels, voltage))
    low, high = levels[upper - 1 : upper + 1].tolist()
    rows = _interpolate(
        rows_of_level[upper - 1], rows_of_level[upper], (voltage - low) / (high - low)
    )
    return rows, (f"interpolated between the rows at {low:.4g} V and at {high:.4g} V",)


def _groups_of_voltage(volts: Array) -> list[NDArray[np.intp]]:
    """Indices of voltages (n,) that are one within SAME_VOLTAGE, the lowest first."""
    order = np.argsort(volts, kind="stable")
    steps = np.diff(volts[order]) > SAME_VOLTAGE * volts[order][1:]
    return np.split(order, np.flatnonzero(steps) + 1)


def _interpolate(low: Rows, high: Rows, share: float) -> Rows:
    """The table at a share of the difference between two, over the commands that both have."""
    first = max(low["command"].min(), high["command"].min())
    last = min(low["command"].max(), high["command"].max())
    commands = np.unique(np.concatenate([low["command"], high["command"]]))
    commands = commands[(commands >= first) & (commands <= last)]

    def means(rows: Rows, name: str) -> Array:
        """The means of a column at each command, interpolated."""
        unique, index, count = np.unique(rows["command"], return_inverse=True, return_counts=True)
        return np.asarray(np.interp(commands, unique, np.bincount(index, rows[name]) / count))

    table = {}
    for name in low:
        if name in high:
            table[name] = (1.0 - share) * means(low, name) + share * means(high, name)
    return table


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

    Args:
        paths: CSV files, and workbooks (.xlsx) with a table in each sheet.
        voltage: the voltage that counts where there are several [V]; between two of them forces
            are interpolated.

    Raises:
        DataError: a file is missing, lacks a column or holds what no thruster does, or there are
            several voltages and none is named.
    """
    tables: list[Columns] = []
    notes: list[str] = []
    for path in paths:
        file_tables, file_notes = _read_tables(Path(path))
        tables += file_tables
        notes += file_notes
    source = ", ".join(str(path) for path in paths)
    commands = [name for name in COMMANDS if all(name in table.values for table in tables)]
    if not commands:
        raise DataError(f"{source}: no command stands in all files, expected {EXPECTED_COLUMNS}")
    kind, *unused = commands
    if unused:
        notes.append(f"commands are those of column {kind}; {' and '.join(unused)} is left aside")
    header_of: dict[str, str] = {}  # of quantities without a unit
    for table in tables:
        for name in table.without_unit:
            if name in DEFAULT_UNITS:
                header_of[name] = table.headers[name]
    if header_of:
        units = ", ".join(DEFAULT_UNITS[name] for name in header_of)
        notes.append(f"no unit stands at {', '.join(header_of.values())}: taken for {units}")
    rows: list[Rows] = []
    for table in tables:
        rows += _rows_by_voltage(table, kind, notes)
    values, voltage_notes = at_voltage(rows, voltage, source)
    return _checked(values, kind, source, (*dict.fromkeys(notes), *voltage_notes))


def _read_tables(path: Path) -> tuple[list[Columns], tuple[str, ...]]:
    """The tables of a file, and notes on sheets without one."""
    if path.suffix.lower() not in (".xlsx", ".xlsm"):
        table = read_table(path, MAX_BYTES, "a CSV file of measurements")
        return [_with_pulse_column(columns) for columns in _columns_of(table)], ()
    tables_by_sheet, empty_sheets = read_sheets(path, _is_header)
    if not tables_by_sheet:
        raise DataError(
            f"{path}: no sheet holds a table ({', '.join(empty_sheets):.200}), expected "
            f"{EXPECTED_COLUMNS}"
        )
    tables = []
    for title, table in tables_by_sheet.items():
        volts = _VOLTAGE.search(title)
        for columns in map(_with_pulse_column, _columns_of(table)):
            if volts and "voltage" not in columns.values:
                _add_voltage(columns, volts)
            tables.append(columns)
    return tables, (f"no table in sheet {', '.join(empty_sheets):.200}",) if empty_sheets else ()


def _columns_of(table: CsvTable) -> list[Columns]:
    """The columns of a table; those of each voltage, where the headers name several side by side
    (`pwm 12V, force 12V, pwm 16V, force 16V`). Columns without a voltage belong to all."""
    by_voltage: dict[str, dict[int, str]] = {}
    matches = [_VOLTAGE.search(cell) for cell in table.header]
    for volts in {match[0]: match for match in matches if match}.values():
        names = {}
        for i, (cell, match) in enumerate(zip(table.header, matches, strict=True)):
            if match is None or match[1] == volts[1]:
                names[i] = _VOLTAGE.sub("", cell).strip()
        if _is_header([*names.values()]):
            by_voltage[volts[1]] = names
    if not by_voltage:
        return [read_columns(table, NAMES, NEEDED_COLUMNS, EXPECTED_COLUMNS)]
    tables = []
    for voltage, names in by_voltage.items():
        own = table.columns(names)
        columns = read_columns(own, NAMES, NEEDED_COLUMNS, EXPECTED_COLUMNS)
        measured = columns.values.get("voltage")
        if measured is not None and "power" not in columns.values:
            columns.values["power"] = np.abs(measured * columns.values["current"])
        _add_voltage(columns, voltage)  # a supply sags under load; its name is what users know
        tables.append(columns)
    return tables


def _add_voltage(columns: Columns, volts: str | re.Match[str]) -> None:
    """Adds a column with the voltage that a title or a header names."""
    number = volts if isinstance(volts, str) else volts[1]
    columns.values["voltage"] = np.full(len(columns.sources), float(number.replace(",", ".")))


def _is_header(cells: Sequence[str]) -> bool:
    """Whether the cells of a row name a command and a force."""
    try:
        names = {named_column(cell, NAMES).name for cell in cells}
    except DataError:  # a header whose unit is not known, which is said when it is read
        return True
    return "force" in names and bool(names & set(COMMANDS))


def _with_pulse_column(columns: Columns) -> Columns:
    """The same columns; an `input` in microseconds is a pulse, PWM."""
    header = columns.headers.get("input", "")
    if "PWM" not in columns.values and re.match("[uµμm]", named_column(header, NAMES).unit):
        columns.values["PWM"] = columns.values.pop("input")
        columns.headers["PWM"] = header
    return columns


def _rows_by_voltage(file: Columns, kind: str, notes: list[str]) -> list[Rows]:
    """Rows of one table with signed forces, split by voltage; adds sentences to the notes."""
    values = file.values
    if file.left_aside:
        notes.append(
            f"{', '.join(file.left_aside)} is left aside: it names no unit, and another column of "
            "the same does"
        )
    command = values[kind]
    force = values["force"]
    if kind == "rpm" and named_column(file.headers[kind], NAMES).unit == "rpm":
        command = command * 60.0
    if kind == "rpm" and command.min() >= 0.0 > force.min():
        command = np.where(force < 0.0, -command, command)
        notes.append("column rpm has no sign: rows with negative forces got one")
    power = values["power"] if "power" in values else np.abs(values["voltage"] * values["current"])
    if power.min() < -NEGATIVE * np.abs(power).max():
        source = file.sources[int(np.argmin(power))]
        shown = f"{power.min():.4g} W, expected what the thruster takes, 0 or more"
        raise DataError(f"{source}: the power is {shown}")
    rows = {"command": command, "force": force, "power": power}
    rows |= {name: values[name] for name in values if name in ("voltage", "torque")}
    by_level = by_voltage(rows, command) if "voltage" in rows else [rows]
    return [_with_signs(level, COMMANDS[kind], notes) for level in by_level]


def _with_signs(rows: Rows, unit: str, notes: list[str]) -> Rows:
    """Rows whose forces have signs: where all are of one sign, and the thruster pushes on both
    sides of its neutral command, those below it count as negative."""
    command = rows["command"]
    force = rows["force"]
    size = np.abs(force)
    if min(-force.min(), force.max()) > UNSIGNED * size.max():
        return rows
    neutral = float(np.median(command[size <= max(UNSIGNED * size.max(), size.min())]))
    sides = command < neutral, command > neutral
    if not all(size[side].max(initial=0.0) > PUSHING * size.max() for side in sides):
        return rows
    which = "sizes alone" if force.max() > -force.min() else "negative alone"
    notes.append(
        f"forces have no sign, they are {which}: those below the neutral command, "
        f"{f'{neutral:g} {unit}'.rstrip()}, count as reverse, negative"
    )
    return {**rows, "force": np.where(command < neutral, -size, size)}


def _checked(values: Rows, kind: str, source: str, notes: tuple[str, ...]) -> BenchData:
    """The bench of rows; an error where no thruster can be fitted to them."""
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
