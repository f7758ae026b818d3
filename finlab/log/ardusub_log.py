"""Logs of ArduSub (DataFlash), indexed by pymavlink and read as columns: demands, pulses,
parameters.

Demands of roll, pitch, yaw and throttle are those of RATE, forward and lateral those of the pilot
(RCIN, channels RCMAP_*), which no other message holds. An output of 1500 us is rest, 400 us more or
less full (ArduSub, `AP_Motors6DOF`).
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.exchange.motor_factors import read_parameters_of_ardusub
from finlab.log.recorded import CUT, Event, Recorded, Series, silent

MAGIC = b"\xa3\x95"
REST_US = 1500.0
FULL_US = 400.0
FIRST_MOTOR, MOTORS, CHANNELS = 33, 8, 14
"""Function of the output of motor 1, most motors, and channels of one message of outputs."""
WORTH = re.compile(r"fail|leak|lost|error|crash|bad |low", re.IGNORECASE)
"""Words by which a message is told."""
VEHICLE = re.compile(r"(Ardu(?!Sub)|Blimp|AntennaTracker)\w*(?= V\d)")
"""How a message begins by which another vehicle of ArduPilot names itself."""
WANTED = ("PARM", "RATE", "CTUN", "RCOU", "RCIN", "ESC", "MSG", "ERR")
STICKS = {"FORWARD": 5, "LATERAL": 6}
"""Demand of the pilot -> its usual channel."""
Columns = dict[str, Any]


def read_dataflash(path: Path) -> Recorded:
    """Reads a log of ArduSub. Raises DataError: it lacks demands; any error: it is damaged."""
    tables, complete = _tables(path)
    messages = [*_rows(tables, "MSG", "time", "Message")]
    if other := next((match for _, words in messages if (match := VEHICLE.match(words))), None):
        raise DataError(
            f"{path}: is a log of {other[0]}, expected one of ArduSub, whose demands are known"
        )
    if (rate := tables.get("RATE")) is None:
        has = ", ".join(sorted(tables)) or "nothing"
        lacks = f"holds no RATE, expected the demands of ArduSub; it has {has}"
        raise DataError(f"{path}: {lacks}; set LOG_BITMASK so that it logs attitude rates")
    parameters = {name: float(value) for name, value in _rows(tables, "PARM", "Name", "Value")}
    time = rate["time"]
    throttle = rate.get("AOut")
    sticks = tables.get("RCIN", {})
    if throttle is None and (control := tables.get("CTUN")):
        throttle = _held(control, "ThO", time)[:, 0]
    heave = (
        np.zeros(len(time)) if throttle is None else 2.0 * np.asarray(throttle, np.float64) - 1.0
    )
    channels = {name: int(parameters.get(f"RCMAP_{name}", usual)) for name, usual in STICKS.items()}
    forward, lateral = (_stick(sticks, parameters, channel, time) for channel in channels.values())
    setpoints = [forward, -lateral, heave, rate["ROut"], -rate["POut"], -rate["YOut"]]
    record = Recorded("ardusub", Series.of(time, np.stack(setpoints, axis=1)))
    if not complete:
        record.notes.append(CUT)
    lacking = [name for name, channel in channels.items() if f"C{channel}" not in sticks]
    for name in lacking:
        how = f"log RCIN, channel {channels[name]} (LOG_BITMASK)"
        record.asks.append(f"It holds no {name.lower()} demand: that axis is not judged; {how}.")
    if len(lacking) < len(channels):
        how = "modes that steer them log none"
        record.notes.append(f"Demands forward and lateral are the pilot's (RCIN); {how}.")
    _outputs(record, tables, parameters)
    frame = {
        name: value for name, value in parameters.items() if name.startswith(("FRAME_", "MOT_"))
    }
    if record.describe(read_parameters_of_ardusub, frame, path.stem):
        guesses = "guesses are taken; name the robot by --robot LAYOUT"
        record.lacking.append(f"A frame of ArduSub has no arms and no newtons: {guesses}.")
    record.events += [Event(at, words) for at, words in messages if WORTH.search(words)]
    record.events += [
        Event(at, f"error {code} of ArduPilot's subsystem {of}")
        for at, of, code in _rows(tables, "ERR", "time", "Subsys", "ECode")
    ]
    return record


def _rows(tables: dict[str, Columns], name: str, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Rows of messages, which may be none; bytes as text."""
    table = tables.get(name) or dict.fromkeys(columns, np.empty(0))
    for row in zip(*(table[column].tolist() for column in columns), strict=True):
        yield tuple(v.decode("utf-8", "replace") if isinstance(v, bytes) else v for v in row)


def _tables(path: Path) -> tuple[dict[str, Columns], bool]:
    """Columns of the wanted messages by their names, and whether the last message is whole.
    pymavlink says where they lie, numpy reads them all at once."""
    from pymavlink import DFReader

    class Index(silent(DFReader).DFReader_binary):  # type: ignore[misc]  # it ships no types
        init_arrays_fast = DFReader.DFReader_binary.init_arrays  # the fast one prints past Python

        def init_clock(self) -> None:
            """Times are those of the autopilot; no message has to be read for them."""

    tables = {}
    with Index(str(path)) as log:
        content = np.frombuffer(bytes(log.data_map), np.uint8)
        ends = [
            log.offsets[kind][-1] + form.len
            for kind, form in log.formats.items()
            if log.offsets[kind]
        ]
        for name in WANTED:
            if (form := log.formats.get(log.name_to_id.get(name))) is None:
                continue
            codes = [DFReader.FORMAT_TO_STRUCT[letter] for letter in form.format]
            kinds = [f"S{code[:-1]}" if code.endswith("s") else f"<{code}" for code, _, _ in codes]
            kind = np.dtype([*zip(form.columns, kinds, strict=True)])
            starts = np.asarray(log.offsets[form.type], np.intp) + 3
            starts = starts[starts + kind.itemsize <= len(content)]
            rows = content[starts[:, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
            if len(rows):
                units = zip(form.columns, codes, strict=True)
                tables[name] = {
                    column: rows[column] * unit if unit else rows[column]
                    for column, (_, unit, _) in units
                }
                tables[name]["time"] = tables[name]["TimeUS"] * 1e-6
    return tables, max(ends, default=0) <= len(content)


def _stick(sticks: Columns, parameters: dict[str, float], channel: int, time: Array) -> Array:
    """What a stick of the pilot asked for at times (N,), -1 to 1; NaN where its channel is not
    logged."""
    if (pulses := sticks.get(f"C{channel}")) is None:
        return np.full(len(time), np.nan)
    least, rest, most = (
        parameters.get(f"RC{channel}_{key}", value)
        for key, value in (("MIN", 1100), ("TRIM", 1500), ("MAX", 1900))
    )
    ends = np.maximum.accumulate([least, rest, most])
    share = np.interp(np.where(pulses > 0, pulses, rest), ends, [-1.0, 0.0, 1.0])
    sign = -1.0 if parameters.get(f"RC{channel}_REVERSED", 0) else 1.0
    return np.nan_to_num(Series.of(sticks["time"], sign * share[:, None]).at(time)[:, 0])


def _outputs(record: Recorded, tables: dict[str, Columns], parameters: dict[str, float]) -> None:
    """Shares of full output of the motors, as their frame says which way they push, and what ESCs
    say."""
    if (pulses := tables.get("RCOU")) is None:
        return
    functions = {int(parameters.get(f"SERVO{i}_FUNCTION", 0)): i for i in range(CHANNELS, 0, -1)}
    if not any(FIRST_MOTOR <= each < FIRST_MOTOR + MOTORS for each in functions):
        functions = {FIRST_MOTOR + i: i + 1 for i in range(MOTORS)}
        how = "channel n is motor n"
        record.notes.append(f"It says of no output that it is a motor's (SERVOn_FUNCTION): {how}.")
    time = pulses["time"]
    escs = tables.get("ESC", {})
    shares = []
    speeds = []
    for motor in range(MOTORS):
        channel = functions.get(FIRST_MOTOR + motor, 0)
        if (pulse := pulses.get(f"C{channel}")) is None:
            break
        sign = parameters.get(f"MOT_{motor + 1}_DIRECTION", 1.0)
        shares.append(np.where(pulse > 0, sign * (pulse - REST_US) / FULL_US, np.nan))
        rows = escs.get("Instance", np.empty(0)) == channel - 1
        speed = np.full((len(time), 1), np.nan)
        speeds.append(_held(escs, "RPM", time, rows) if rows.any() else speed)
    if shares:
        record.outputs = Series.of(time, np.stack(shares, axis=1))
        record.turns = Series.of(time, np.hstack(speeds))


def _held(table: Columns, column: str, time: Array, rows: Any = slice(None)) -> Array:
    """What a column held at times (N,), as (N, 1)."""
    return Series.of(table["time"][rows], table[column][rows][:, None]).at(time)
