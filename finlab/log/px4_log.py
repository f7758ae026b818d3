"""Logs of PX4 (ULog), read by pyulog: setpoints of thrust and torque, outputs of motors, what was left.

Setpoints are without unit, in x forward, y right, z down; outputs are shares of CA_ROTORi_CT (PX4, messages
`vehicle_thrust_setpoint`, `vehicle_torque_setpoint`, `actuator_motors`, `control_allocator_status`).
"""

import io
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.exchange.parameters import read_px4
from finlab.log.recorded import FLU, Event, Recorded, Series, changes

MAGIC = b"ULog\x01\x125"
TOPICS = (
    *("vehicle_thrust_setpoint", "vehicle_torque_setpoint", "actuator_motors", "actuator_outputs"),
    *("control_allocator_status", "failure_detector_status", "esc_status"),
)
MOTORS, FIRST_MOTOR = 12, 101
"""Most motors, and the number of the first as the function of an output."""
WARNING = ord("4")
"""Level of a message; more serious ones are below."""
TOY = 6.5
"""PX4's default of CA_ROTORi_CT, which is no force of any thruster in water."""


def read_ulog(path: Path) -> Recorded:
    """Reads a log of PX4. Raises DataError: it lacks setpoints; any error: it is damaged."""
    from pyulog import ULog

    with redirect_stdout(io.StringIO()):
        log = ULog(str(path), list(TOPICS))
    topics = {each.name: each.data for each in reversed(log.data_list)}
    if lacking := [name for name in TOPICS[:2] if name not in topics]:
        raise DataError(
            f"{path}: holds no {lacking[0]}, expected the setpoints that PX4 1.14 and newer log; log them "
            "with SDLOG_PROFILE, or take a newer PX4"
        )
    parameters = {**log.initial_parameters, **{name: value for _, name, value in log.changed_parameters}}
    begin = log.start_timestamp

    def series(name: str, *fields: str) -> Series:
        return Series.of((topics[name]["timestamp"] - float(begin)) * 1e-6, _columns(topics[name], fields))

    thrust, torque = (series(name, "xyz[0]", "xyz[1]", "xyz[2]") for name in TOPICS[:2])
    both = np.hstack([thrust.at(torque.time), torque.values]) * FLU
    record = Recorded("px4", Series.of(torque.time, both))
    if "actuator_motors" in topics:
        names = [f"control[{i}]" for i in range(MOTORS)]
        record.outputs = series("actuator_motors", *(n for n in names if n in topics["actuator_motors"]))
    elif "actuator_outputs" in topics:
        record.outputs = _by_pulses(series, parameters)
    if "control_allocator_status" in topics:
        names = [f"unallocated_{kind}[{i}]" for kind in ("thrust", "torque") for i in range(3)]
        unmet = series("control_allocator_status", *names)
        record.unmet = Series(unmet.time, unmet.values * FLU)
    if log.file_corruption:
        record.notes.append("The file is damaged; what could be read was read.")
    if lost := sum(drop.duration for drop in log.dropouts):
        record.notes.append(f"PX4 says that {lost / 1000:.1f} s are missing from the log.")
    record.events += [
        Event((each.timestamp - begin) * 1e-6, each.message)
        for each in log.logged_messages
        if each.log_level <= WARNING
    ]
    if "failure_detector_status" in topics:
        mask = series("failure_detector_status", "motor_failure_mask")
        record.events += changes(mask.time, _bits(mask), "failed, says PX4", "works again, says PX4")
    if "esc_status" in topics:
        online = series("esc_status", "esc_online_flags", "esc_count")
        known = np.arange(MOTORS) < online.values[:, 1:]
        record.events += changes(online.time, known & ~_bits(online), "has an ESC offline", "is online again")
    _geometry(record, parameters, path)
    return record


def _columns(data: dict[str, Any], fields: tuple[str, ...]) -> Array:
    """Columns of a topic; zeros for one that it lacks."""
    zero = np.zeros(len(data["timestamp"]))
    with np.errstate(invalid="ignore"):  # numbers of a damaged file may be none
        return np.stack([np.asarray(data.get(name, zero), np.float64) for name in fields], axis=1)


def _bits(series: Series) -> Any:
    """Flags (N, 12) in the first column."""
    return (np.nan_to_num(series.values[:, :1]).astype(np.int64) >> np.arange(MOTORS) & 1).astype(bool)


def _by_pulses(series: Any, parameters: dict[str, Any]) -> Series | None:
    """Outputs of motors by PWM_MAIN_FUNCi and the ends of their pulses; None where no output is a motor's."""
    outputs = series("actuator_outputs", *(f"output[{i}]" for i in range(16)))
    motors: dict[int, Array] = {}
    reversing = int(parameters.get("CA_R_REV", 0))
    for i in range(16):
        motor = int(parameters.get(f"PWM_MAIN_FUNC{i + 1}", 0)) - FIRST_MOTOR
        least, most = (float(parameters.get(f"PWM_MAIN_{end}{i + 1}", usual)) for end, usual in _ENDS)
        if 0 <= motor < MOTORS and most > least:
            share = (outputs.values[:, i] - least) / (most - least)
            share = 2.0 * share - 1.0 if reversing >> motor & 1 else share
            motors[motor] = np.where(outputs.values[:, i] < least, np.nan, np.clip(share, -1.0, 1.0))
    if not motors or [*sorted(motors)] != [*range(len(motors))]:
        return None
    return Series(outputs.time, np.stack([motors[motor] for motor in sorted(motors)], axis=1))


_ENDS = (("MIN", 1000.0), ("MAX", 2000.0))


def _geometry(record: Recorded, parameters: dict[str, Any], path: Path) -> None:
    """The robot by CA_ROTOR*."""
    lines = [f"{name} {value}" for name, value in parameters.items() if name.startswith("CA_")]
    if (robot := record.describe(read_px4, "\n".join(lines), path.stem)) is None:
        return
    sizes = [abs(float(parameters.get(f"CA_ROTOR{i}_CT", TOY))) for i in range(robot.n)]
    if set(sizes) == {TOY}:
        record.lacking.append(
            f"CA_ROTORi_CT is PX4's default, {TOY} for all, which are no newtons of a thruster; name the "
            "robot by --robot LAYOUT."
        )
