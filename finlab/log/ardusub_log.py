"""Reads logs of ArduSub (DataFlash): demands, pulses and parameters.

pymavlink indexes the messages, and numpy reads them as columns.

Demands of roll, pitch, yaw and throttle are those of RATE, forward and lateral those of the pilot
(RCIN, channels RCMAP_*), which no other message holds. An output of 1500 us is rest, 400 us more or
less full (ArduSub, `AP_Motors6DOF`).
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.exchange.motor_factors import read_parameters_of_ardusub
from finlab.log.recorded import TRUNCATED, Event, LogRecord, Series, silenced

MAGIC = b"\xa3\x95"
"""The first bytes of each message, and so of a file."""
HEAD_BYTES = 3
"""Bytes before the values of a message: MAGIC and its kind."""
REST_US = 1500.0
"""Pulse of a motor at rest [us]."""
FULL_US = 400.0
"""Pulse of a motor at full thrust, above or below the one at rest [us]."""
FIRST_MOTOR = 33
"""SERVOn_FUNCTION of the output of motor 1; the next motors have the next numbers."""
MOTORS = 8
"""Most motors."""
CHANNELS = 14
"""Channels of one message of outputs."""
REPORTED = re.compile(r"fail|leak|lost|error|crash|bad |low", re.IGNORECASE)
"""Words of messages that become events."""
OTHER_VEHICLE = re.compile(r"(Ardu(?!Sub)|Blimp|AntennaTracker)\w*(?= V\d)")
"""The beginning of a message by which another vehicle of ArduPilot names itself."""
MESSAGES = ("PARM", "RATE", "CTUN", "RCOU", "RCIN", "ESC", "MSG", "ERR")
STICK_CHANNELS = {"FORWARD": 5, "LATERAL": 6}
"""Demands of the pilot, and their default channels."""
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
    frame = {
        name: value for name, value in parameters.items() if name.startswith(("FRAME_", "MOT_"))
    }
    if record.describe(read_parameters_of_ardusub, frame, path.stem):
        guesses = "guesses are taken; name the robot by --robot LAYOUT"
        record.lacking.append(f"A frame of ArduSub has no arms and no newtons: {guesses}.")
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


def _stick_channels(parameters: dict[str, float]) -> dict[str, int]:
    """The channel of each demand of the pilot."""
    return {
        name: int(parameters.get(f"RCMAP_{name}", default))
        for name, default in STICK_CHANNELS.items()
    }


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
    channels = _stick_channels(parameters)
    sticks = tables.get("RCIN", {})
    forward = _stick(sticks, parameters, channels["FORWARD"], time)
    lateral = _stick(sticks, parameters, channels["LATERAL"], time)
    setpoints = [forward, -lateral, heave, rates["ROut"], -rates["POut"], -rates["YOut"]]
    return Series.of(time, np.stack(setpoints, axis=1))


def _note_sticks(
    record: LogRecord, tables: dict[str, Columns], parameters: dict[str, float]
) -> None:
    """Adds sentences on the demands of the pilot, and on those that the log lacks."""
    channels = _stick_channels(parameters)
    sticks = tables.get("RCIN", {})
    missing = [name for name, channel in channels.items() if f"C{channel}" not in sticks]
    for name in missing:
        remedy = f"log RCIN, channel {channels[name]} (LOG_BITMASK)"
        record.asks.append(f"It holds no {name.lower()} demand: that axis is not judged; {remedy}.")
    if len(missing) < len(channels):
        reason = "modes that steer them log none"
        record.notes.append(f"Demands forward and lateral are the pilot's (RCIN); {reason}.")


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
    minimum = parameters.get(f"RC{channel}_MIN", 1100)
    trim = parameters.get(f"RC{channel}_TRIM", 1500)
    maximum = parameters.get(f"RC{channel}_MAX", 1900)
    pulse_points = np.maximum.accumulate([minimum, trim, maximum])
    share = np.interp(np.where(pulses > 0, pulses, trim), pulse_points, [-1.0, 0.0, 1.0])
    sign = -1.0 if parameters.get(f"RC{channel}_REVERSED", 0) else 1.0
    return np.nan_to_num(Series.of(sticks["time"], sign * share[:, None]).at(time)[:, 0])


def _read_outputs(
    record: LogRecord, tables: dict[str, Columns], parameters: dict[str, float]
) -> None:
    """Adds the motors' shares of full output, signed as their frame has them, and their speeds by
    ESCs."""
    pulses = tables.get("RCOU")
    if pulses is None:
        return
    functions = {int(parameters.get(f"SERVO{i}_FUNCTION", 0)): i for i in range(CHANNELS, 0, -1)}
    if not any(FIRST_MOTOR <= function < FIRST_MOTOR + MOTORS for function in functions):
        functions = {FIRST_MOTOR + i: i + 1 for i in range(MOTORS)}
        rule = "channel n is motor n"
        record.notes.append(f"It says of no output that it is a motor's (SERVOn_FUNCTION): {rule}.")
    time = pulses["time"]
    escs = tables.get("ESC", {})
    shares = []
    speeds = []
    for motor in range(MOTORS):
        channel = functions.get(FIRST_MOTOR + motor, 0)
        pulse = pulses.get(f"C{channel}")
        if pulse is None:
            break
        sign = parameters.get(f"MOT_{motor + 1}_DIRECTION", 1.0)
        shares.append(np.where(pulse > 0, sign * (pulse - REST_US) / FULL_US, np.nan))
        rows = escs.get("Instance", np.empty(0)) == channel - 1
        speed = np.full((len(time), 1), np.nan)
        speeds.append(_values_at(escs, "RPM", time, rows) if rows.any() else speed)
    if shares:
        record.outputs = Series.of(time, np.stack(shares, axis=1))
        record.turns = Series.of(time, np.hstack(speeds))


def _values_at(table: Columns, column: str, time: Array, rows: Any = slice(None)) -> Array:
    """The last values of a column at times (N,), as (N, 1)."""
    return Series.of(table["time"][rows], table[column][rows][:, None]).at(time)
