"""Logs of ArduSub (DataFlash), indexed by pymavlink and read as columns: demands, pulses, parameters.

Demands of roll, pitch, yaw and throttle are those of RATE, forward and lateral those of the pilot (RCIN,
channels RCMAP_*), which no other message holds. An output of 1500 us is rest, 400 us more or less full
(ArduSub, `AP_Motors6DOF`).
"""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.exchange.motor_factors import read_parameters_of_ardusub
from finlab.log.recorded import Event, Recorded, Series

MAGIC = b"\xa3\x95"
REST_US, FULL_US = 1500.0, 400.0
FIRST_MOTOR, MOTORS, CHANNELS = 33, 8, 14
"""Function of the output of motor 1, most motors, and channels of one message of outputs."""
WORTH = re.compile(r"fail|leak|lost|error|crash|bad |low", re.IGNORECASE)
"""Words by which a message is told."""
VEHICLE = re.compile(r"(Ardu(?!Sub)|Blimp|AntennaTracker)\w*(?= V\d)")
"""How a message begins by which another vehicle of ArduPilot names itself."""
Columns = dict[str, Any]


def read_dataflash(path: Path) -> Recorded:
    """Reads a log of ArduSub. Raises DataError: it lacks demands; any error: it is damaged."""
    tables = _tables(path, ("PARM", "RATE", "CTUN", "RCOU", "RCIN", "MSG", "ERR"))
    said = [*map(_text, tables["MSG"]["Message"])] if "MSG" in tables else []
    if other := next((name for words in said if (name := VEHICLE.match(words))), None):
        raise DataError(f"{path}: is a log of {other[0]}, expected one of ArduSub, whose demands are known")
    if "RATE" not in tables:
        lacks = (
            f"holds no RATE, expected the demands of ArduSub; it has {', '.join(sorted(tables)) or 'nothing'}"
        )
        raise DataError(f"{path}: {lacks}; set LOG_BITMASK so that it logs attitude rates")
    parameters = (
        {
            _text(name): float(value)
            for name, value in zip(*map(tables.get("PARM", {}).get, ("Name", "Value")), strict=True)
        }
        if "PARM" in tables
        else {}
    )
    rate = tables["RATE"]
    time = rate["TimeUS"] * 1e-6
    throttle = rate.get("AOut")
    if throttle is None and "CTUN" in tables:
        throttle = Series.of(tables["CTUN"]["TimeUS"] * 1e-6, tables["CTUN"]["ThO"][:, None]).at(time)[:, 0]
    heave = np.zeros(len(time)) if throttle is None else 2.0 * np.asarray(throttle, np.float64) - 1.0
    record = Recorded("ardusub", Series(time, np.empty((len(time), 6))))
    forward, lateral = (_of_pilot(record, tables, parameters, time, *each) for each in _STICKS)
    setpoints = [forward, -lateral, heave, rate["ROut"], -rate["POut"], -rate["YOut"]]
    record.demand = Series.of(time, np.stack(setpoints, axis=1))
    _outputs(record, tables, parameters)
    _geometry(record, parameters, path)
    if "MSG" in tables:
        messages = zip(tables["MSG"]["TimeUS"], said, strict=True)
        record.events += [Event(float(at) * 1e-6, words) for at, words in messages if WORTH.search(words)]
    if "ERR" in tables:
        rows = zip(*(tables["ERR"][key] for key in ("TimeUS", "Subsys", "ECode")), strict=True)
        record.events += [
            Event(float(at) * 1e-6, f"error {code} of ArduPilot's subsystem {of}") for at, of, code in rows
        ]
    return record


_STICKS = (("FORWARD", 5), ("LATERAL", 6))


def _tables(path: Path, wanted: tuple[str, ...]) -> dict[str, Columns]:
    """Columns of messages by their names; pymavlink says where they lie, numpy reads them all at once."""
    from pymavlink.DFReader import FORMAT_TO_STRUCT, DFReader_binary

    class Index(DFReader_binary):  # type: ignore[misc]  # it ships no types
        def init_clock(self) -> None:
            """Times are those of the autopilot; no message has to be read for them."""

    tables = {}
    with _quiet(), Index(str(path)) as log:
        content = np.frombuffer(bytes(log.data_map), np.uint8)
        for name in wanted:
            form = log.formats.get(log.name_to_id.get(name))
            if form is None:
                continue
            codes = [FORMAT_TO_STRUCT[letter] for letter in form.format]
            kinds = [f"S{code[:-1]}" if code.endswith("s") else f"<{code}" for code, _, _ in codes]
            kind = np.dtype([*zip(form.columns, kinds, strict=True)])
            starts = np.asarray(log.offsets[form.type], np.intp) + 3
            starts = starts[starts + kind.itemsize <= len(content)]
            rows = content[starts[:, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
            if len(rows):
                units = {each: unit or 1.0 for each, (_, unit, _) in zip(form.columns, codes, strict=True)}
                tables[name] = {
                    each: rows[each] if rows[each].dtype.kind == "S" else rows[each] * units[each]
                    for each in form.columns
                }
    return tables


@contextmanager
def _quiet() -> Iterator[None]:
    """Drops what pymavlink prints of each byte that is no message, by its part in C, too."""
    kept = [os.dup(1), os.dup(2)]
    with open(os.devnull, "wb") as nowhere:
        for place in (1, 2):
            os.dup2(nowhere.fileno(), place)
    try:
        yield
    finally:
        for place, own in enumerate(kept, 1):
            os.dup2(own, place)
            os.close(own)


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")


def _of_pilot(
    record: Recorded,
    tables: dict[str, Columns],
    parameters: dict[str, float],
    time: Array,
    stick: str,
    usual: int,
) -> Array:
    """What the pilot's stick asked for (N,), -1 to 1."""
    channel = int(parameters.get(f"RCMAP_{stick}", usual))
    pulses = tables.get("RCIN", {}).get(f"C{channel}")
    if pulses is None:
        record.asks.append(
            f"It holds no {stick.lower()} demand: that axis is not judged; log RCIN, channel {channel} "
            "(LOG_BITMASK)."
        )
        return np.full(len(time), np.nan)
    record.notes.append("Demands forward and lateral are the pilot's (RCIN); modes that steer them log none.")
    least, rest, most = (
        parameters.get(f"RC{channel}_{key}", value)
        for key, value in (("MIN", 1100), ("TRIM", 1500), ("MAX", 1900))
    )
    away = np.where(pulses > 0, pulses - rest, 0.0)
    share = np.where(away < 0.0, away / max(rest - least, 1.0), away / max(most - rest, 1.0))
    sign = -1.0 if parameters.get(f"RC{channel}_REVERSED", 0) else 1.0
    series = Series.of(tables["RCIN"]["TimeUS"] * 1e-6, sign * np.clip(share, -1.0, 1.0)[:, None])
    return np.nan_to_num(series.at(time)[:, 0])


def _outputs(record: Recorded, tables: dict[str, Columns], parameters: dict[str, float]) -> None:
    """Shares of full output of the motors, as their frame says which way they push."""
    if "RCOU" not in tables:
        return
    functions = {int(parameters.get(f"SERVO{i}_FUNCTION", 0)): i for i in range(CHANNELS, 0, -1)}
    if not any(FIRST_MOTOR <= each < FIRST_MOTOR + MOTORS for each in functions):
        functions = {FIRST_MOTOR + i: i + 1 for i in range(MOTORS)}
        record.notes.append(
            "It says of no output that it is a motor's (SERVOn_FUNCTION): channel n is motor n."
        )
    shares = []
    for motor in range(MOTORS):
        pulse = tables["RCOU"].get(f"C{functions.get(FIRST_MOTOR + motor)}")
        if pulse is None:
            break
        sign = parameters.get(f"MOT_{motor + 1}_DIRECTION", 1.0)
        shares.append(np.where(pulse > 0, sign * (pulse - REST_US) / FULL_US, np.nan))
    if shares:
        record.outputs = Series.of(tables["RCOU"]["TimeUS"] * 1e-6, np.stack(shares, axis=1))


def _geometry(record: Recorded, parameters: dict[str, float], path: Path) -> None:
    """The robot by its frame, whose arms and newtons nothing says."""
    lines = [f"{name} {value:g}" for name, value in parameters.items() if name.startswith(("FRAME_", "MOT_"))]
    if record.describe(read_parameters_of_ardusub, "\n".join(lines), path.stem):
        record.lacking.append(
            "A frame of ArduSub has no arms and no newtons: guesses are taken; name the robot by --robot "
            "LAYOUT."
        )
