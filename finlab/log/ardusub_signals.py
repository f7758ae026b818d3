"""Meaning of the numbers that ArduSub logs and sends: pulses of motors, sticks of the pilot, and
modes.

An output of 1500 us is rest, 400 us more or less full (ArduSub, `AP_Motors6DOF`). A stick at its
trim asks for nothing, at either end for full thrust (`RC_Channel::norm_input`). Who steers an axis
depends on the mode (`mode_manual.cpp`, `mode_stabilize.cpp`, `mode_althold.cpp`).
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.exchange.motor_factors import read_parameters_of_ardusub
from finlab.log.recorded import LogRecord

Parameters = Mapping[str, float]
"""ArduSub's parameters by name."""
REST_US = 1500.0
"""Pulse of a motor at rest [us]."""
FULL_US = 400.0
"""Pulse of a motor at full thrust, above or below the one at rest [us]."""
ESC_DEAD_BAND_US = 25.0
"""Pulses of a motor that differ from rest by no more are 0 N: the dead band of the Basic ESC, and
of most others for thrusters [us]."""
FIRST_MOTOR = 33
"""SERVOn_FUNCTION of the output of motor 1; the next motors have the next numbers."""
MOTORS = 8
"""Most motors."""
CHANNELS = 16
"""Most outputs."""
STICK_CHANNELS = {"ROLL": 2, "PITCH": 1, "THROTTLE": 3, "YAW": 4, "FORWARD": 5, "LATERAL": 6}
"""Demands of the pilot, and their default channels (RCMAP_*)."""
STICK_US = (1100.0, 1500.0, 1900.0)
"""Default pulses of a stick at its ends and its trim [us]: RCn_MIN, RCn_TRIM, RCn_MAX."""
STABILIZE = 0
ACRO = 1
ALT_HOLD = 2
SURFACE = 9
MANUAL = 19
SURFTRAK = 21
"""Numbers of the modes in which sticks are demands."""
PILOT_STEERS_SIDEWAYS = (STABILIZE, ACRO, ALT_HOLD, SURFACE, MANUAL, SURFTRAK)
"""Modes in which the pilot's sticks are the demands forward and lateral."""
PILOT_HEAVES = (STABILIZE, ACRO, MANUAL)
"""Modes in which the pilot's stick is the demand of throttle."""
REPORTED = re.compile(r"fail|leak|lost|error|crash|bad |low", re.IGNORECASE)
"""Words of messages that become events."""
ARMED = 10
DISARMED = 11
"""Numbers of the events of arming (ArduPilot, `LogEvent`)."""


class MotorOutputs(NamedTuple):
    """Outputs of motors 1 to n over M samples."""

    shares: Array
    """Shares of full output (M, n), signed as the frame has them; NaN where a motor has no
    pulse."""
    channels: tuple[int, ...]
    """Output of each motor, from 1."""


def motor_outputs(
    pulses: Mapping[int, AnyArray], parameters: Parameters, notes: list[str]
) -> MotorOutputs | None:
    """Returns the outputs of the motors; None where no channel is a motor's.

    Args:
        pulses: widths of pulses (M,) [us] by channel, from 1.
        parameters: SERVOn_FUNCTION, MOT_n_DIRECTION.
        notes: takes a sentence where parameters do not say which channels are motors.
    """
    functions = {int(parameters.get(f"SERVO{i}_FUNCTION", 0)): i for i in range(CHANNELS, 0, -1)}
    if not any(FIRST_MOTOR <= function < FIRST_MOTOR + MOTORS for function in functions):
        functions = {FIRST_MOTOR + i: i + 1 for i in range(MOTORS)}
        rule = "channel n is motor n"
        notes.append(f"It says of no output that it is a motor's (SERVOn_FUNCTION): {rule}.")
    shares = []
    channels = []
    for motor in range(MOTORS):
        channel = functions.get(FIRST_MOTOR + motor, 0)
        pulse = pulses.get(channel)
        if pulse is None:
            break
        sign = parameters.get(f"MOT_{motor + 1}_DIRECTION", 1.0)
        shares.append(np.where(pulse > 0, sign * (pulse - REST_US) / FULL_US, np.nan))
        channels.append(channel)
    return MotorOutputs(np.stack(shares, axis=1), tuple(channels)) if shares else None


def stick_channel(parameters: Parameters, name: str) -> int:
    """Returns the channel of a demand of the pilot, by its name in `STICK_CHANNELS`."""
    return int(parameters.get(f"RCMAP_{name}", STICK_CHANNELS[name]))


def stick_share(pulses: AnyArray, parameters: Parameters, channel: int) -> Array:
    """Returns the demand of a stick, -1 to 1; 0 where it has no pulse.

    Args:
        pulses: widths of its pulses (M,) [us].
        parameters: RCn_MIN, RCn_TRIM, RCn_MAX, RCn_REVERSED.
        channel: n.
    """
    ends = [
        parameters.get(f"RC{channel}_{end}", default)
        for end, default in zip(("MIN", "TRIM", "MAX"), STICK_US, strict=True)
    ]
    pulse_points = np.maximum.accumulate(ends)
    trim = ends[1]
    share = np.interp(np.where(pulses > 0, pulses, trim), pulse_points, [-1.0, 0.0, 1.0])
    sign = -1.0 if parameters.get(f"RC{channel}_REVERSED", 0) else 1.0
    return np.asarray(sign * share)


def describe_frame(record: LogRecord, parameters: Parameters, name: str) -> None:
    """Adds the robot by its frame, and what a frame does not say.

    Args:
        record: the record of the log.
        parameters: FRAME_CONFIG, MOT_*.
        name: the name of the layout.
    """
    frame = {key: value for key, value in parameters.items() if key.startswith(("FRAME_", "MOT_"))}
    if record.describe(read_parameters_of_ardusub, frame, name):
        guesses = "guesses are taken; name the robot by --robot LAYOUT"
        record.lacking.append(f"A frame of ArduSub has no arms and no newtons: {guesses}.")


def in_dead_band(shares: AnyArray) -> NDArray[np.bool_]:
    """Whether ESCs take outputs for rest.

    Args:
        shares: of full output (...,).
    """
    rounding_us = 1e-6
    return np.asarray(np.abs(shares) * FULL_US <= ESC_DEAD_BAND_US + rounding_us)
