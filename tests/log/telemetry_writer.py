"""Telemetry logs of a ground station, whose frames pymavlink packs."""

import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v10 import common as version_1
from pymavlink.dialects.v20 import common as version_2

from tests.log.conftest import SubMotion

BEGIN_US = 1_700_000_000_000_000
"""Time of the first frame, since 1970 [us]."""
ARMED = 128
"""Bit of a heartbeat's base mode."""
Said = tuple[float, int, Any]
"""Time [s], number of the system that sends it, and the message."""


def write_telemetry(path: Path, said: Iterable[Said], dialect: Any = version_2) -> Path:
    """Writes messages in the order of their times, each as its system sends it."""
    senders: dict[int, Any] = {}
    content = b""
    parts = []
    for time, system, message in sorted(said, key=lambda row: row[0]):
        if system not in senders:
            senders[system] = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
        stamp = struct.pack(">Q", BEGIN_US + round(time * 1e6))
        parts.append(stamp + message.pack(senders[system]))
    path.write_bytes(content + b"".join(parts))
    return path


def telemetry_of(
    motion: SubMotion,
    mode: int = 19,
    dialect: Any = version_2,
    *,
    armed: tuple[float, float] = (0.0, np.inf),
    sticks: str = "channels",
    autopilot: int = 3,
    vehicle: int = 12,
) -> list[Said]:
    """What ArduSub and a ground station say in a dive: heartbeats each second, parameters, and
    outputs and sticks at each sample.

    Args:
        motion: the dive.
        mode: number of ArduSub's mode.
        dialect: of pymavlink.
        armed: from when to when motors are armed [s].
        sticks: `channels` for RC_CHANNELS, `joystick` for MANUAL_CONTROL, or nothing.
        autopilot: what the heartbeat says of the autopilot.
        vehicle: what it says of the vehicle.
    """
    start = float(motion.time[0])
    said: list[Said] = []
    for second in np.arange(start, motion.time[-1], 1.0):
        base = ARMED if armed[0] <= second < armed[1] else 0
        beat = dialect.MAVLink_heartbeat_message(vehicle, autopilot, base, mode, 4, 3)
        said.append((second, 1, beat))
        ground = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
        said.append((second + 1e-4, 255, ground))
    count = len(motion.parameters)
    for k, (name, value) in enumerate(motion.parameters.items()):
        message = dialect.MAVLink_param_value_message(name.encode(), value, 9, count, k)
        said.append((start + 1e-3, 1, message))
    for time, stick, pulse in zip(motion.time, motion.stick, motion.pulse.astype(int), strict=True):
        boot_ms = round(time * 1e3)
        rest = [0] * 8 if dialect is version_2 else []
        output = dialect.MAVLink_servo_output_raw_message(boot_ms * 1000, 0, *pulse, *rest)
        said.append((time, 1, output))
        # Channels of ArduSub: pitch, roll, throttle, yaw, forward, lateral.
        widths = np.round(1500 + 400 * stick[[1, 0, 3, 2, 4, 5]]).astype(int)
        if sticks == "channels":
            unused = [65535] * 12
            message = dialect.MAVLink_rc_channels_message(boot_ms, 18, *widths, *unused, 0)
            said.append((time - 1e-5, 1, message))
        elif sticks == "joystick":
            x, y, r = (round(2000 * share) for share in (stick[4], stick[5], stick[2]))
            z = round(500 + 1000 * stick[3])
            message = dialect.MAVLink_manual_control_message(1, x, y, z, r, 0)
            said.append((time - 1e-5, 255, message))
    return said


__all__ = ["telemetry_of", "version_1", "version_2", "write_telemetry"]
