"""Reads telemetry logs (`.tlog`) of ground stations such as QGroundControl: what ArduSub sent while
the vehicle swam, and what the pilot's sticks sent to it.

Such a log is a row of frames of MAVLink 1 and 2, each after the time at which it came: 8 bytes, big
end first, microseconds since 1970. Frames are found one by one; numpy reads all of one kind at
once, and checks their CRC (X.25, with the extra byte of the kind).

It holds outputs (SERVO_OUTPUT_RAW), sticks (RC_CHANNELS, else MANUAL_CONTROL), modes and arming
(HEARTBEAT), and parameters where the ground station asked for them. It holds no output of a
controller: what the robot was asked for is known along the axes that a mode leaves to the pilot.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.log.ardusub_signals import (
    MANUAL,
    PILOT_HEAVES,
    PILOT_STEERS_SIDEWAYS,
    REPORTED,
    STICK_CHANNELS,
    Parameters,
    describe_frame,
    motor_outputs,
    stick_channel,
    stick_share,
)
from finlab.log.recorded import FLU, TRUNCATED, Event, LogRecord, Series
from finlab.log.working_time import by_depth, by_samples

SUFFIX = ".tlog"
"""Suffix of a telemetry log."""
STAMP_BYTES = 8
"""Bytes of the time before a frame."""
VERSION_1 = 0xFE
"""First byte of a frame of MAVLink 1."""
VERSION_2 = 0xFD
"""First byte of a frame of MAVLink 2."""
HEAD_BYTES = {VERSION_1: 6, VERSION_2: 10}
"""Bytes of a frame before its values."""
CRC_BYTES = 2
"""Bytes of the check sum behind the values."""
SIGNATURE_BYTES = 13
"""Bytes of a signature behind that, where bit 0 of the third byte is set."""
FIRST_BYTE = re.compile(rb"[\xfd\xfe]")
"""What a frame begins with."""
YEARS_US = (int(9e14), int(41e14))
"""Times of a ground station: from 1998 to 2099 [us]."""

ARDUPILOT = 3
"""`autopilot` of a heartbeat of ArduPilot."""
PX4 = 12
"""The same of PX4."""
NO_AUTOPILOT = 8
"""The same of what is no vehicle, such as a ground station."""
SUBMARINE = 12
"""`type` of a heartbeat of ArduSub."""
ARMED_BIT = 128
"""Bit of `base_mode` of a heartbeat while motors are armed."""
UNUSED_US = 65535
"""Pulse of a stick that is not used [us]."""
ACRO_YAW_P = 3.375
"""Default of the parameter of that name, at which the stick's yaw counts whole in mode MANUAL."""
JS_GAIN_DEFAULT = 0.5
"""Default of the parameter of that name: share of a joystick that counts."""
FULL_STICK = 1000.0
"""Largest x, y and r of MANUAL_CONTROL; z goes from 0 to it."""


class Kind(NamedTuple):
    """One kind of message."""

    number: int
    crc_extra: int
    dtype: np.dtype[np.void]
    """Of its values, in the order in which they are sent."""


def _kind(number: int, crc_extra: int, fields: str) -> Kind:
    """A kind of message by its fields, such as `<u2:type`."""
    pairs = [tuple(field.split(":")[::-1]) for field in fields.split()]
    return Kind(number, crc_extra, np.dtype([*pairs]))


def _numbered(letters: str, name: str, first: int, last: int) -> str:
    """Fields with numbers in their names; # stands for the number."""
    return " ".join(
        f"{letters}:{name.replace('#', str(number))}" for number in range(first, last + 1)
    )


HEARTBEAT = _kind(
    0, 50, "<u4:custom_mode u1:type u1:autopilot u1:base_mode u1:system_status u1:mavlink_version"
)
PARAM_VALUE = _kind(
    22, 220, "<f4:param_value <u2:param_count <u2:param_index S16:param_id u1:param_type"
)
SERVO_OUTPUT_RAW = _kind(
    36,
    222,
    f"<u4:time_usec {_numbered('<u2', 'servo#', 1, 8)} u1:port {_numbered('<u2', 'servo#', 9, 16)}",
)
RC_CHANNELS = _kind(
    65, 118, f"<u4:time_boot_ms {_numbered('<u2', 'chan#', 1, 18)} u1:chancount u1:rssi"
)
MANUAL_CONTROL = _kind(69, 243, "<i2:x <i2:y <i2:z <i2:r <u2:buttons u1:target")
VFR_HUD = _kind(74, 20, "<f4:airspeed <f4:groundspeed <f4:alt <f4:climb <i2:heading <u2:throttle")
NAMED_VALUE_FLOAT = _kind(251, 170, "<u4:time_boot_ms <f4:value S10:name")
STATUSTEXT = _kind(253, 83, "u1:severity S50:text")


class Frames(NamedTuple):
    """The frames of a log whose times are those of a clock."""

    content: NDArray[np.uint8]
    """The whole file."""
    start: NDArray[np.intp]
    """Where each frame begins (N,)."""
    time: Array
    """When each came, after the first (N,) [s]."""
    is_version_2: NDArray[np.bool_]
    """(N,)."""
    number: NDArray[np.int64]
    """The number of its kind (N,)."""
    system: NDArray[np.uint8]
    """The system that sent it (N,)."""
    component: NDArray[np.uint8]
    """The component of the system that sent it (N,)."""


class Messages(NamedTuple):
    """Messages of one kind."""

    time: Array
    """When each came (M,) [s]."""
    values: AnyArray
    """Their values by name, a structured array (M,)."""
    system: NDArray[np.uint8]
    """The systems that sent them (M,)."""
    component: NDArray[np.uint8]
    """Their components (M,)."""

    def of(self, system: int, component: int) -> "Messages":
        """Those that one component sent."""
        chosen = (self.system == system) & (self.component == component)
        return Messages(*(column[chosen] for column in self))


def looks_like(head: bytes) -> bool:
    """Returns whether a file begins as a telemetry log does.

    Args:
        head: its first bytes.
    """
    if len(head) <= STAMP_BYTES or head[STAMP_BYTES] not in HEAD_BYTES:
        return False
    return YEARS_US[0] < int.from_bytes(head[:STAMP_BYTES], "big") < YEARS_US[1]


def read_telemetry(path: Path) -> LogRecord:
    """Reads a telemetry log of ArduSub.

    Args:
        path: the file.

    Raises:
        DataError: it is of another vehicle, or lacks outputs or demands.
        Exception: of any class, where the file is damaged.
    """
    content = path.read_bytes()
    starts, is_damaged, is_complete = _frame_starts(content)
    frames = _frames(content, starts)
    beats, is_altered = _messages(frames, HEARTBEAT)
    system, component = _vehicle(path, beats)

    def sent(kind: Kind) -> Messages:
        nonlocal is_altered
        messages, has_altered = _messages(frames, kind)
        is_altered |= has_altered
        return messages.of(system, component)

    parameters = _parameters(sent(PARAM_VALUE))
    servos = sent(SERVO_OUTPUT_RAW)
    notes: list[str] = []
    is_first_port = servos.values["port"] == 0
    pulses = {i: servos.values[f"servo{i}"][is_first_port] for i in range(1, 17)}
    outputs = motor_outputs(pulses, parameters, notes)
    if outputs is None or not len(outputs.shares):
        raise DataError(
            f"{path}: holds no SERVO_OUTPUT_RAW, expected the outputs of ArduSub; let it send them "
            "(SRn_RC_CHAN or MAVn_RC_CHAN above 0), or take the log on the vehicle (.bin)"
        )
    output_series = Series.of(servos.time[is_first_port], outputs.shares)
    heartbeats = beats.of(system, component)
    modes = Series.of(heartbeats.time, heartbeats.values["custom_mode"][:, None])
    mode = modes.at(output_series.time)[:, 0]
    joystick, has_altered = _messages(frames, MANUAL_CONTROL)
    sticks = _sticks(
        output_series.time,
        parameters,
        sent(RC_CHANNELS),
        Messages(*(column[joystick.values["target"] == system] for column in joystick)),
        sent(NAMED_VALUE_FLOAT),
    )
    if sticks is None:
        raise DataError(
            f"{path}: holds neither RC_CHANNELS nor MANUAL_CONTROL, expected what the pilot's "
            "sticks asked for; take the log on the vehicle (.bin), which has all demands"
        )
    record = LogRecord("ardusub", Series(output_series.time, sticks), output_series)
    record.unlogged = Series(output_series.time, _unlogged(mode))
    is_armed = (heartbeats.values["base_mode"] & ARMED_BIT) > 0
    record.armed = by_samples(heartbeats.time, is_armed)
    speeds = sent(VFR_HUD)
    record.in_water = by_depth(speeds.time, -speeds.values["alt"])
    if is_damaged or is_altered | has_altered:
        notes.append("The file is damaged; what could be read was read.")
    elif not is_complete:
        notes.append(TRUNCATED)
    record.notes += notes
    record.asks += _lacks(output_series)
    describe_frame(record, parameters, path.stem)
    texts = sent(STATUSTEXT)
    for time, words in zip(texts.time.tolist(), texts.values["text"].tolist(), strict=True):
        said = words.decode("utf-8", "replace")
        if REPORTED.search(said):
            record.events.append(Event(time, said))
    return record


def _frame_starts(content: bytes) -> tuple[list[int], bool, bool]:
    """Where frames begin; whether some bytes belong to none; whether the last one is whole.

    A frame that no other follows at its end is none: the search goes on a byte later.
    """
    starts: list[int] = []
    is_damaged = False
    size = len(content)
    position = STAMP_BYTES
    while position + HEAD_BYTES[VERSION_1] + CRC_BYTES <= size:
        first = content[position]
        if first == VERSION_2:
            length = HEAD_BYTES[VERSION_2] + content[position + 1] + CRC_BYTES
            length += SIGNATURE_BYTES * (content[position + 2] & 1)
        elif first == VERSION_1:
            length = HEAD_BYTES[VERSION_1] + content[position + 1] + CRC_BYTES
        else:
            length = 0
        following = position + length + STAMP_BYTES
        is_last = following >= size
        if length and (is_last or content[following] in HEAD_BYTES):
            starts.append(position)
            position = following
            continue
        is_damaged = True
        match = FIRST_BYTE.search(content, position + 1)
        if match is None:
            break
        position = match.start()
    is_complete = position - STAMP_BYTES == size
    if starts and position - STAMP_BYTES > size:
        starts.pop()
    return starts, is_damaged, is_complete


def _frames(content: bytes, starts: list[int]) -> Frames:
    """The frames that begin at some places."""
    octets = np.frombuffer(content, np.uint8)
    start = np.array(starts, np.intp)
    stamp_bytes = octets[start[:, None] + np.arange(-STAMP_BYTES, 0)]
    stamp_us = np.ascontiguousarray(stamp_bytes).view(">u8")[:, 0]
    is_timed = (stamp_us > YEARS_US[0]) & (stamp_us < YEARS_US[1])
    start = start[is_timed]
    known_us = stamp_us[is_timed].astype(np.int64)
    is_version_2 = octets[start] == VERSION_2
    low, middle, high = (
        octets[np.minimum(start + place, len(octets) - 1)].astype(np.int64) for place in (7, 8, 9)
    )
    number_2 = low + (middle << 8) + (high << 16)
    number_1 = octets[start + 5].astype(np.int64)
    return Frames(
        content=octets,
        start=start,
        time=np.asarray((known_us - known_us[:1]) * 1e-6, np.float64),
        is_version_2=is_version_2,
        number=np.where(is_version_2, number_2, number_1),
        system=octets[start + np.where(is_version_2, 5, 3)],
        component=octets[start + np.where(is_version_2, 6, 4)],
    )


def _messages(frames: Frames, kind: Kind) -> tuple[Messages, bool]:
    """The messages of one kind whose check sum is right, and whether some were wrong.

    MAVLink 2 leaves out zeros at the end of a message, and may add fields behind those that are
    known.
    """
    rows = np.flatnonzero(frames.number == kind.number)
    start = frames.start[rows]
    is_version_2 = frames.is_version_2[rows]
    head_size = np.where(is_version_2, HEAD_BYTES[VERSION_2], HEAD_BYTES[VERSION_1])
    sent_size = frames.content[start + 1].astype(np.intp)
    is_right = _check_sums_are_right(frames.content, start, head_size + sent_size, kind)
    chosen = rows[is_right]
    place = np.arange(kind.dtype.itemsize)
    index = (start + head_size)[is_right, None] + place
    is_sent = place < sent_size[is_right, None]
    last = len(frames.content) - 1
    octets = np.where(is_sent, frames.content[np.minimum(index, last)], 0).astype(np.uint8)
    values = np.ascontiguousarray(octets).view(kind.dtype)[:, 0]
    messages = Messages(
        frames.time[chosen], values, frames.system[chosen], frames.component[chosen]
    )
    return messages, not is_right.all()


def _check_sums_are_right(
    content: NDArray[np.uint8], start: NDArray[np.intp], size: NDArray[np.intp], kind: Kind
) -> NDArray[np.bool_]:
    """Whether the CRC of frames (M,) is that of their bytes but the first, and of the extra byte.

    Args:
        content: the whole file.
        start: where each frame begins (M,).
        size: bytes of its head and its values (M,).
        kind: the kind of all of them.
    """
    last = len(content) - 1
    crc = np.full(len(start), 0xFFFF, np.uint16)
    for place in range(1, int(size.max(initial=0))):
        updated = _crc_with(crc, content[np.minimum(start + place, last)])
        crc = np.where(place < size, updated, crc)
    crc = _crc_with(crc, np.full(len(start), kind.crc_extra, np.uint8))
    low = content[np.minimum(start + size, last)].astype(np.uint16)
    high = content[np.minimum(start + size + 1, last)].astype(np.uint16)
    return np.asarray((start + size + 1 <= last) & (crc == low + (high << 8)))


def _crc_with(crc: NDArray[np.uint16], octet: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """The check sums (M,) of X.25 with one more byte (M,) each."""
    mixed = (octet ^ crc).astype(np.uint8)  # the lower byte of the sum
    mixed ^= mixed << 4
    wide = mixed.astype(np.uint16)
    return np.asarray((crc >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4), np.uint16)


def _vehicle(path: Path, beats: Messages) -> tuple[int, int]:
    """System and component of ArduSub; an error where the log is of another vehicle."""
    of_vehicle = np.flatnonzero(beats.values["autopilot"] != NO_AUTOPILOT)
    if not len(of_vehicle):
        raise DataError(
            f"{path}: holds no heartbeat of an autopilot, expected a telemetry log (.tlog) of "
            "ArduSub"
        )
    is_sub = (beats.values["autopilot"] == ARDUPILOT) & (beats.values["type"] == SUBMARINE)
    of_sub = np.flatnonzero(is_sub)
    if not len(of_sub):
        first = beats.values[of_vehicle[0]]
        if first["autopilot"] == PX4:
            raise DataError(
                f"{path}: is telemetry of PX4, which sends no demanded wrenches, expected that of "
                "ArduSub; take the log on the vehicle (.ulg)"
            )
        raise DataError(
            f"{path}: is telemetry of a vehicle of type {first['type']} (MAV_TYPE), expected "
            f"ArduSub, type {SUBMARINE}"
        )
    row = of_sub[0]
    return int(beats.system[row]), int(beats.component[row])


def _parameters(messages: Messages) -> dict[str, float]:
    """The vehicle's parameters; of one that was sent several times the last value."""
    names = [name.decode("ascii", "replace") for name in messages.values["param_id"].tolist()]
    return dict(zip(names, messages.values["param_value"].astype(float).tolist(), strict=True))


def _sticks(
    time: Array, parameters: Parameters, channels: Messages, joystick: Messages, named: Messages
) -> Array | None:
    """What the pilot's sticks ask for (N, 6), FLU, -1 to 1, at times (N,) [s]; 0 before the first
    message. None where there is none.

    Args:
        time: the times.
        parameters: of the vehicle.
        channels: RC_CHANNELS, which ArduSub sends: what it made of its input.
        joystick: MANUAL_CONTROL, which the ground station sends.
        named: NAMED_VALUE_FLOAT, among which ArduSub sends the joystick's gain.
    """
    if len(channels.time):
        share = {}
        for name in STICK_CHANNELS:
            channel = stick_channel(parameters, name)
            pulses = channels.values[f"chan{min(max(channel, 1), 18)}"]
            used = np.where(pulses == UNUSED_US, 0, pulses)
            share[name] = stick_share(used, parameters, channel)
        source = channels
    elif len(joystick.time):
        share = _joystick_shares(joystick, parameters, named)
        source = joystick
    else:
        return None
    roll, pitch, throttle, yaw, forward, lateral = (share[name] for name in STICK_CHANNELS)
    yaw = yaw * parameters.get("ACRO_YAW_P", ACRO_YAW_P) / ACRO_YAW_P
    # ArduSub: forward, right and up; roll, pitch and yaw of x forward, y right, z down.
    wrench = np.stack([forward, lateral, -throttle, roll, pitch, yaw], axis=1) * FLU
    return np.nan_to_num(Series.of(source.time, wrench).at(time))


def _joystick_shares(
    joystick: Messages, parameters: Parameters, named: Messages
) -> dict[str, Array]:
    """What ArduSub makes of MANUAL_CONTROL, by the names of `STICK_CHANNELS`, -1 to 1 (ArduSub,
    `joystick.cpp`)."""
    is_gain = named.values["name"] == b"PilotGain"
    gains = Series.of(named.time[is_gain], named.values["value"][is_gain, None])
    default = parameters.get("JS_GAIN_DEFAULT", JS_GAIN_DEFAULT)
    gain = np.nan_to_num(gains.at(joystick.time)[:, 0], nan=default)
    values = joystick.values
    throttle_gain = gain * parameters.get("JS_THR_GAIN", 1.0)
    half = 0.5 * FULL_STICK
    shares = {
        "ROLL": np.zeros(len(gain)),
        "PITCH": np.zeros(len(gain)),
        "THROTTLE": throttle_gain * (values["z"] - half) / half,
        "YAW": gain * values["r"] / FULL_STICK,
        "FORWARD": gain * values["x"] / FULL_STICK,
        "LATERAL": gain * values["y"] / FULL_STICK,
    }
    return {name: np.clip(share, -1.0, 1.0) for name, share in shares.items()}


def _unlogged(mode: Array) -> Array:
    """Along which axes (N, 6) sticks are not what the robot was asked for, 1 or 0.

    Args:
        mode: number of the mode of each sample (N,); NaN where it is not known.
    """
    unlogged = np.ones((len(mode), 6))
    unlogged[np.isin(mode, PILOT_STEERS_SIDEWAYS), :2] = 0.0
    unlogged[np.isin(mode, PILOT_HEAVES), 2] = 0.0
    unlogged[mode == MANUAL] = 0.0
    return unlogged


def _lacks(outputs: Series) -> list[str]:
    """Sentences on what a telemetry log does not hold."""
    step = np.diff(outputs.time)
    rate = 1.0 / max(float(np.median(step)), 1e-6) if len(step) else 0.0
    return [
        "A telemetry log holds no output of a controller: along axes that a mode does not leave to "
        "the pilot's sticks, which are all but surge, sway and heave outside of MANUAL, what "
        "outputs gave counts as asked, and nothing is missing there; the log on the vehicle (.bin) "
        "has these demands.",
        f"It has outputs {rate:.0f} times a second: what was lost for a shorter time may not be in "
        "it.",
    ]
