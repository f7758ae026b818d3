"""Reads logs of ArduSub (DataFlash): demands, pulses and parameters.

pymavlink indexes the messages, and numpy reads them as columns.

Demands of roll, pitch, yaw and throttle are those of RATE, forward and lateral those of the pilot
(RCIN, channels RCMAP_*), which no other message holds. `ardusub_signals` says what pulses mean.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.log.ardusub_signals import (
    ARMED,
    DISARMED,
    PILOT_STEERS_SIDEWAYS,
    REPORTED,
    describe_frame,
    motor_outputs,
    stick_channel,
    stick_share,
)
from finlab.log.recorded import TRUNCATED, Event, LogRecord, Series, silenced
from finlab.log.working_time import by_changes, by_depth

MAGIC = b"\xa3\x95"
"""The first bytes of each message, and so of a file."""
HEAD_BYTES = 3
"""Bytes before the values of a message: MAGIC and its kind."""
CHANNELS = 14
"""Channels of one message of outputs, or of sticks."""
OTHER_VEHICLE = re.compile(r"(Ardu(?!Sub)|Blimp|AntennaTracker)\w*(?= V\d)")
"""The beginning of a message by which another vehicle of ArduPilot names itself."""
MESSAGES = ("PARM", "RATE", "CTUN", "RCOU", "RCIN", "ESC", "MSG", "ERR", "ARM", "EV", "MODE")
PILOTED = ("FORWARD", "LATERAL")
"""Demands that no message holds but the pilot's sticks."""
Columns = dict[str, Any]
"""Columns of one kind of message by name, and the times [s] under `time`."""


def read_dataflash(path: Path) -> LogRecord:
    """Reads a log of ArduSub.

    Args:
        path: the file.

    Raises:
        DataError: it lacks demands, or is of another vehicle.
        Exception: of any class, where the file is damaged.
    """
    tables, is_complete = _read_tables(path)
    messages = [*_message_rows(tables, "MSG", "time", "Message")]
    rates = _checked_rates(path, tables, [words for _, words in messages])
    parameters = {
        name: float(value) for name, value in _message_rows(tables, "PARM", "Name", "Value")
    }
    record = LogRecord("ardusub", _demands(tables, rates, parameters))
    if not is_complete:
        record.notes.append(TRUNCATED)
    _note_sticks(record, tables, parameters)
    _read_outputs(record, tables, parameters)
    _read_state(record, tables)
    describe_frame(record, parameters, path.stem)
    for time, words in messages:
        if REPORTED.search(words):
            record.events.append(Event(time, words))
    for time, subsystem, code in _message_rows(tables, "ERR", "time", "Subsys", "ECode"):
        words = f"error {code} of ArduPilot's subsystem {subsystem}"
        record.events.append(Event(time, words))
    return record


def _checked_rates(path: Path, tables: dict[str, Columns], messages: list[str]) -> Columns:
    """The columns of RATE; an error where the log is of another vehicle, or has none."""
    for words in messages:
        vehicle = OTHER_VEHICLE.match(words)
        if vehicle:
            raise DataError(
                f"{path}: is a log of {vehicle[0]}, expected one of ArduSub, whose demands are "
                "known"
            )
    if "RATE" not in tables:
        present = ", ".join(sorted(tables)) or "nothing"
        lacks = f"holds no RATE, expected the demands of ArduSub; it has {present}"
        raise DataError(f"{path}: {lacks}; set LOG_BITMASK so that it logs attitude rates")
    return tables["RATE"]


def _demands(tables: dict[str, Columns], rates: Columns, parameters: dict[str, float]) -> Series:
    """Demands (N, 6), FLU, -1 to 1, at the times of RATE; ArduSub's roll is FLU's, its pitch and
    yaw have the other sign, and its throttle goes from 0 to 1."""
    time = rates["time"]
    throttle = rates.get("AOut")
    if throttle is None and "CTUN" in tables:
        throttle = _values_at(tables["CTUN"], "ThO", time)[:, 0]
    heave = np.zeros(len(time))
    if throttle is not None:
        heave = 2.0 * np.asarray(throttle, np.float64) - 1.0
    sticks = tables.get("RCIN", {})
    forward, lateral = (
        _stick(sticks, parameters, stick_channel(parameters, name), time) for name in PILOTED
    )
    setpoints = [forward, -lateral, heave, rates["ROut"], -rates["POut"], -rates["YOut"]]
    return Series.of(time, np.stack(setpoints, axis=1))


def _note_sticks(
    record: LogRecord, tables: dict[str, Columns], parameters: dict[str, float]
) -> None:
    """Adds sentences on the demands of the pilot, and on those that the log lacks."""
    channels = {name: stick_channel(parameters, name) for name in PILOTED}
    sticks = tables.get("RCIN", {})
    missing = [name for name, channel in channels.items() if f"C{channel}" not in sticks]
    for name in missing:
        remedy = f"log RCIN, channel {channels[name]} (LOG_BITMASK)"
        record.asks.append(f"It holds no {name.lower()} demand: that axis is not judged; {remedy}.")
    if len(missing) < len(channels):
        record.notes.append("Demands forward and lateral are the pilot's (RCIN).")
        _leave_to_modes(record, tables)


def _leave_to_modes(record: LogRecord, tables: dict[str, Columns]) -> None:
    """Marks forward and lateral demands as not logged in modes that steer them themselves."""
    modes = tables.get("MODE", {})
    column = "ModeNum" if "ModeNum" in modes else "Mode"
    if column not in modes:
        return
    time = record.demand.time
    mode = _values_at(modes, column, time)[:, 0]
    is_steered = np.isfinite(mode) & ~np.isin(mode, PILOT_STEERS_SIDEWAYS)
    if not is_steered.any():
        return
    unlogged = np.zeros((len(time), 6))
    unlogged[is_steered, :2] = 1.0
    record.unlogged = Series(time, unlogged)
    record.notes.append(
        "In modes that steer forward and lateral themselves no message holds these demands: what "
        "outputs gave counts as asked there."
    )


def _read_state(record: LogRecord, tables: dict[str, Columns]) -> None:
    """Adds when the robot was armed (ARM, or else events), and under water (CTUN)."""
    arming = tables.get("ARM", {})
    if "ArmState" in arming:
        record.armed = by_changes(arming["time"], arming["ArmState"] > 0)
    elif "Id" in tables.get("EV", {}):
        events = tables["EV"]
        is_of_arming = np.isin(events["Id"], (ARMED, DISARMED))
        state = events["Id"] == ARMED
        record.armed = by_changes(events["time"][is_of_arming], state[is_of_arming])
    control = tables.get("CTUN", {})
    height = control.get("Alt", control.get("BAlt"))
    if height is not None:
        record.in_water = by_depth(control["time"], -height)


def _message_rows(
    tables: dict[str, Columns], name: str, *columns: str
) -> Iterator[tuple[Any, ...]]:
    """Rows of messages, which may be none; bytes as text."""
    table = tables.get(name) or dict.fromkeys(columns, np.empty(0))
    for row in zip(*(table[column].tolist() for column in columns), strict=True):
        yield tuple(v.decode("utf-8", "replace") if isinstance(v, bytes) else v for v in row)


def _read_tables(path: Path) -> tuple[dict[str, Columns], bool]:
    """Columns of the MESSAGES by name, and whether the last message of the file is whole.

    pymavlink finds where messages lie; numpy reads all of one kind at once.
    """
    from pymavlink import DFReader

    class Index(silenced(DFReader).DFReader_binary):  # type: ignore[misc]  # it ships no types
        init_arrays_fast = DFReader.DFReader_binary.init_arrays  # the fast one prints past Python

        def init_clock(self) -> None:
            """Times are those of the autopilot; no message has to be read for them."""

    tables = {}
    with Index(str(path)) as log:
        content = np.frombuffer(bytes(log.data_map), np.uint8)
        message_ends = []
        for kind, message in log.formats.items():
            if log.offsets[kind]:
                message_ends.append(log.offsets[kind][-1] + message.len)
        for name in MESSAGES:
            message = log.formats.get(log.name_to_id.get(name))
            if message is None:
                continue
            codes = [DFReader.FORMAT_TO_STRUCT[letter] for letter in message.format]
            table = _read_columns(content, message.columns, codes, log.offsets[message.type])
            if table:
                table["time"] = table["TimeUS"] * 1e-6
                tables[name] = table
    return tables, max(message_ends, default=0) <= len(content)


def _read_columns(
    content: NDArray[np.uint8], names: Sequence[str], codes: Sequence[Any], offsets: Sequence[int]
) -> Columns:
    """Columns of one kind of message; empty where no whole message is in the file.

    Args:
        content: the bytes of the file.
        names: names of the columns.
        codes: of each its code of `struct`, its unit or None, and its type.
        offsets: where the messages begin.
    """
    dtypes = [f"S{code[:-1]}" if code.endswith("s") else f"<{code}" for code, _, _ in codes]
    row_type = np.dtype([*zip(names, dtypes, strict=True)])
    starts = np.asarray(offsets, np.intp) + HEAD_BYTES
    starts = starts[starts + row_type.itemsize <= len(content)]
    rows = content[starts[:, None] + np.arange(row_type.itemsize)].view(row_type)[:, 0]
    if not len(rows):
        return {}
    columns = {}
    for name, (_, unit, _) in zip(names, codes, strict=True):
        columns[name] = rows[name] * unit if unit else rows[name]
    return columns


def _stick(sticks: Columns, parameters: dict[str, float], channel: int, time: Array) -> Array:
    """The demand of a stick of the pilot at times (N,), -1 to 1; NaN where its channel is not
    logged."""
    pulses = sticks.get(f"C{channel}")
    if pulses is None:
        return np.full(len(time), np.nan)
    share = stick_share(pulses, parameters, channel)
    return np.nan_to_num(Series.of(sticks["time"], share[:, None]).at(time)[:, 0])


def _read_outputs(
    record: LogRecord, tables: dict[str, Columns], parameters: dict[str, float]
) -> None:
    """Adds the motors' shares of full output, signed as their frame has them, and their speeds by
    ESCs."""
    pulses = tables.get("RCOU")
    if pulses is None:
        return
    by_channel = {i: pulses[f"C{i}"] for i in range(1, CHANNELS + 1) if f"C{i}" in pulses}
    outputs = motor_outputs(by_channel, parameters, record.notes)
    if outputs is None:
        return
    time = pulses["time"]
    record.outputs = Series.of(time, outputs.shares)
    escs = tables.get("ESC", {})
    speeds = []
    for channel in outputs.channels:
        rows = escs.get("Instance", np.empty(0)) == channel - 1
        speed = np.full((len(time), 1), np.nan)
        speeds.append(_values_at(escs, "RPM", time, rows) if rows.any() else speed)
    record.turns = Series.of(time, np.hstack(speeds))


def _values_at(table: Columns, column: str, time: Array, rows: Any = slice(None)) -> Array:
    """The last values of a column at times (N,), as (N, 1)."""
    return Series.of(table["time"][rows], table[column][rows][:, None]).at(time)
