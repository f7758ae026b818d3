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
from finlab.log.working_time import by_samples

MAGIC = b"ULog\x01\x125"
"""The first bytes of a file."""
MAX_MOTORS = 12
"""Most motors."""
FIRST_MOTOR = 101
"""PWM_MAIN_FUNCi of the output of the first motor; the next ones have the next numbers."""
MAX_PULSES = 16
"""Most outputs that are pulses."""
WARNING = ord("4")
"""Level of a warning; more serious messages have lower levels."""
DEFAULT_CT = 6.5
"""PX4's default of CA_ROTORi_CT, which is no force of any thruster in water."""
PULSE_MIN_US = 1000.0
"""PX4's default of PWM_MAIN_MINi [us]."""
PULSE_MAX_US = 2000.0
"""PX4's default of PWM_MAIN_MAXi [us]."""


def _indexed(name: str, count: int) -> tuple[str, ...]:
    """Names of the columns of an array, whose index is the # in a name."""
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
    "actuator_armed": ("armed", "lockdown", "manual_lockdown", "kill", "termination"),
    "vehicle_status": ("arming_state",),
    "vehicle_land_detected": ("landed",),
    "esc_status": ("esc_online_flags", "esc_count", *_indexed("esc#.esc_rpm", 8)),
}
"""Columns that are read, by topic."""
ARMING_STATE_ARMED = 2
"""Value of `arming_state` of `vehicle_status` while motors are armed."""


def read_ulog(path: Path) -> LogRecord:
    """Reads a log of PX4.

    Args:
        path: the file.

    Raises:
        DataError: it lacks setpoints.
        Exception: of any class, where the file is damaged.
    """
    from pyulog import core

    with _File(open(path, "rb", 0)) as file:
        log = silenced(core).ULog(file, [*TOPICS])
    start = log.start_timestamp
    topics = {entry.name: _series(entry, start) for entry in reversed(log.data_list)}
    parameters = dict(log.initial_parameters)
    for _, name, value in log.changed_parameters:
        parameters[name] = value
    outputs = topics.get("actuator_motors")
    if outputs is None and "actuator_outputs" in topics:
        outputs = _by_pulses(topics["actuator_outputs"], parameters)
    record = LogRecord("px4", _setpoints(path, topics), outputs)
    _read_state(record, topics)
    unallocated = topics.get("control_allocator_status")
    if unallocated:
        record.unmet = Series(unallocated.time, unallocated.values * FLU)
    if log.file_corruption:
        record.notes.append("The file is damaged; what could be read was read.")
    elif file.cut:
        record.notes.append(TRUNCATED)
    lost_ms = sum(dropout.duration for dropout in log.dropouts)
    if lost_ms:
        record.notes.append(f"PX4 says that {lost_ms / 1000:.1f} s are missing from the log.")
    for entry in log.logged_messages:
        if entry.log_level <= WARNING:
            record.events.append(Event((entry.timestamp - start) * 1e-6, entry.message))
    _read_health(record, topics)
    _describe_robot(record, parameters, path.stem)
    return record


def _setpoints(path: Path, topics: dict[str, Series]) -> Series:
    """Setpoints of thrust and torque (N, 6), FLU, at the times of those of torque."""
    thrust = topics.get("vehicle_thrust_setpoint")
    torque = topics.get("vehicle_torque_setpoint")
    if thrust is None or torque is None:
        missing = next(name for name in TOPICS if name not in topics)
        raise DataError(
            f"{path}: holds no {missing}, expected the setpoints that PX4 1.14 and newer log; log "
            "them with SDLOG_PROFILE, or take a newer PX4"
        )
    setpoints = np.hstack([thrust.at(torque.time), torque.values]) * FLU
    return Series(torque.time, setpoints, torque.max_jump_back)


def _read_state(record: LogRecord, topics: dict[str, Series]) -> None:
    """Adds when motors were armed and not locked, and when the robot had not landed."""
    arming = topics.get("actuator_armed")
    status = topics.get("vehicle_status")
    if arming:
        flags = np.nan_to_num(arming.values) > 0.0
        is_locked = flags[:, 1:].any(axis=1)
        record.armed = by_samples(arming.time, flags[:, 0] & ~is_locked)
    elif status:
        is_armed = status.values[:, 0] == ARMING_STATE_ARMED
        record.armed = by_samples(status.time, is_armed)
    landing = topics.get("vehicle_land_detected")
    if landing:
        record.in_water = by_samples(landing.time, ~(np.nan_to_num(landing.values[:, 0]) > 0.0))


def _read_health(record: LogRecord, topics: dict[str, Series]) -> None:
    """Adds failures of motors and of ESCs as events, and the speeds that ESCs report."""
    failures = topics.get("failure_detector_status")
    if failures:
        record.events += changes(
            failures.time, _bits(failures), "failed, says PX4", "works again, says PX4"
        )
    escs = topics.get("esc_status")
    if escs:
        is_present = np.arange(MAX_MOTORS) < escs.values[:, 1:2]
        is_offline = is_present & ~_bits(escs)
        record.events += changes(escs.time, is_offline, "has an ESC offline", "is online again")
        record.turns = Series(escs.time, escs.values[:, 2:])


def _describe_robot(record: LogRecord, parameters: dict[str, Any], name: str) -> None:
    """Adds the robot by its parameters CA_*, and a sentence where they hold no newtons."""
    geometry = {key: value for key, value in parameters.items() if key.startswith("CA_")}
    robot = record.describe(read_px4, geometry, name)
    if robot is None:
        return
    sizes = {abs(float(parameters.get(f"CA_ROTOR{i}_CT", DEFAULT_CT))) for i in range(robot.n)}
    if sizes == {DEFAULT_CT}:
        record.lacking.append(
            f"CA_ROTORi_CT is PX4's default, {DEFAULT_CT} for all, which are no newtons of a "
            "thruster; name the robot by --robot LAYOUT."
        )


class _File(io.BufferedReader):
    """A file that notices whether it ended in the middle of a message, whose head has 3 bytes."""

    cut = False
    """Whether it did."""

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
        low = float(parameters.get(f"PWM_MAIN_MIN{i}", PULSE_MIN_US))
        high = float(parameters.get(f"PWM_MAIN_MAX{i}", PULSE_MAX_US))
        if 0 <= motor < MAX_MOTORS and high > low:
            share = (pulse - low) / (high - low)
            if reversing >> motor & 1:
                share = 2.0 * share - 1.0
            motors[motor] = np.where(pulse < low, np.nan, np.clip(share, -1.0, 1.0))
    if not motors or {*motors} != {*range(len(motors))}:
        return None
    return Series(
        outputs.time,
        np.stack([motors[motor] for motor in sorted(motors)], axis=1),
        outputs.max_jump_back,
    )
