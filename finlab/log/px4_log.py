"""Reads logs of PX4 (ULog) by pyulog: setpoints, outputs of motors, and unallocated wrenches.

Setpoints are without unit, in x forward, y right, z down; outputs are shares of CA_ROTORi_CT (PX4,
messages `vehicle_thrust_setpoint`, `vehicle_torque_setpoint`, `actuator_motors`,
`control_allocator_status`).
"""

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.errors import DataError
from finlab.exchange.parameters import read_px4
from finlab.log.recorded import FLU, TRUNCATED, Event, LogRecord, Series, changes, silenced

MAGIC = b"ULog\x01\x125"
MAX_MOTORS, FIRST_MOTOR, MAX_PULSES = 12, 101, 16
"""Most motors, the number of the first as the function of an output, and most outputs that are
pulses."""
WARNING = ord("4")
"""Level of a message; more serious ones are below."""
DEFAULT_CT = 6.5
"""PX4's default of CA_ROTORi_CT, which is no force of any thruster in water."""


def _indexed(name: str, count: int) -> tuple[str, ...]:
    return tuple(name.replace("#", f"[{i}]") for i in range(count))


TOPICS = {
    "vehicle_thrust_setpoint": _indexed("xyz#", 3),
    "vehicle_torque_setpoint": _indexed("xyz#", 3),
    "actuator_motors": _indexed("control#", MAX_MOTORS),
    "actuator_outputs": _indexed("output#", MAX_PULSES),
    "control_allocator_status": (
        *_indexed("unallocated_thrust#", 3),
        *_indexed("unallocated_torque#", 3),
    ),
    "failure_detector_status": ("motor_failure_mask",),
    "esc_status": ("esc_online_flags", "esc_count", *_indexed("esc#.esc_rpm", 8)),
}
"""Topic -> the columns that are read."""


def read_ulog(path: Path) -> LogRecord:
    """Reads a log of PX4. Raises DataError: it lacks setpoints; any error: it is damaged."""
    from pyulog import core

    with _File(open(path, "rb", 0)) as file:
        log = silenced(core).ULog(file, [*TOPICS])
    begin = log.start_timestamp
    topics = {entry.name: _series(entry, begin) for entry in reversed(log.data_list)}
    thrust, torque = map(topics.get, list(TOPICS)[:2])
    if thrust is None or torque is None:
        raise DataError(
            f"{path}: holds no {[name for name in TOPICS if name not in topics][0]}, expected the "
            "setpoints "
            "that PX4 1.14 and newer log; log them with SDLOG_PROFILE, or take a newer PX4"
        )
    parameters = {
        **log.initial_parameters,
        **{name: value for _, name, value in log.changed_parameters},
    }
    setpoints = np.hstack([thrust.at(torque.time), torque.values]) * FLU
    record = LogRecord(
        "px4", Series(torque.time, setpoints, torque.max_jump_back), topics.get("actuator_motors")
    )
    if record.outputs is None and "actuator_outputs" in topics:
        record.outputs = _by_pulses(topics["actuator_outputs"], parameters)
    if unmet := topics.get("control_allocator_status"):
        record.unmet = Series(unmet.time, unmet.values * FLU)
    if log.file_corruption:
        record.notes.append("The file is damaged; what could be read was read.")
    elif file.cut:
        record.notes.append(TRUNCATED)
    if lost := sum(drop.duration for drop in log.dropouts):
        record.notes.append(f"PX4 says that {lost / 1000:.1f} s are missing from the log.")
    record.events += [
        Event((entry.timestamp - begin) * 1e-6, entry.message)
        for entry in log.logged_messages
        if entry.log_level <= WARNING
    ]
    if mask := topics.get("failure_detector_status"):
        record.events += changes(
            mask.time, _bits(mask), "failed, says PX4", "works again, says PX4"
        )
    if escs := topics.get("esc_status"):
        is_present = np.arange(MAX_MOTORS) < escs.values[:, 1:2]
        record.events += changes(
            escs.time, is_present & ~_bits(escs), "has an ESC offline", "is online again"
        )
        record.turns = Series(escs.time, escs.values[:, 2:])
    robot = record.describe(
        read_px4, {k: v for k, v in parameters.items() if k.startswith("CA_")}, path.stem
    )
    if robot and {
        abs(float(parameters.get(f"CA_ROTOR{i}_CT", DEFAULT_CT))) for i in range(robot.n)
    } == {DEFAULT_CT}:
        record.lacking.append(
            f"CA_ROTORi_CT is PX4's default, {DEFAULT_CT} for all, which are no newtons of a "
            "thruster; name the "
            "robot by --robot LAYOUT."
        )
    return record


class _File(io.BufferedReader):
    """A file that knows whether it ended amid what was read; a message begins with a head of 3
    bytes."""

    cut = False

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        self.cut |= (size or 0) - len(data) not in (0, 3)
        return data


def _series(topic: Any, begin: int) -> Series:
    """The columns of a topic that are read; NaN for one that it lacks."""
    stamps = topic.data["timestamp"]
    none = np.full(len(stamps), np.nan)
    with np.errstate(invalid="ignore"):  # numbers of a damaged file may be none
        columns = [
            np.asarray(topic.data.get(name, none), np.float64) for name in TOPICS[topic.name]
        ]
    return Series.of((stamps - float(begin)) * 1e-6, np.stack(columns, axis=1))


def _bits(series: Series) -> NDArray[np.bool_]:
    """Flags (N, 12) in the first column."""
    return (
        np.nan_to_num(series.values[:, :1]).astype(np.int64) >> np.arange(MAX_MOTORS) & 1
    ).astype(bool)


def _by_pulses(outputs: Series, parameters: dict[str, Any]) -> Series | None:
    """Outputs of motors by PWM_MAIN_FUNCi and the ends of their pulses; None where no output is a
    motor's."""
    motors = {}
    reversing = int(parameters.get("CA_R_REV", 0))
    for i, pulse in enumerate(outputs.values.T, 1):
        motor = int(parameters.get(f"PWM_MAIN_FUNC{i}", 0)) - FIRST_MOTOR
        low, high = (
            float(parameters.get(f"PWM_MAIN_{key}{i}", default)) for key, default in PULSE_LIMITS
        )
        if 0 <= motor < MAX_MOTORS and high > low:
            share = (pulse - low) / (high - low)
            share = 2.0 * share - 1.0 if reversing >> motor & 1 else share
            motors[motor] = np.where(pulse < low, np.nan, np.clip(share, -1.0, 1.0))
    if not motors or {*motors} != {*range(len(motors))}:
        return None
    return Series(
        outputs.time,
        np.stack([motors[motor] for motor in sorted(motors)], axis=1),
        outputs.max_jump_back,
    )


PULSE_LIMITS = (("MIN", 1000.0), ("MAX", 2000.0))
