"""The checks of a wrench before it is answered, and of a velocity before it is used: their age,
their frame, and what is NaN."""

import math
from typing import NamedTuple

import numpy as np

from finlab.allocation.question import check_flow
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import CommandError
from finlab.swim.control.contract import NOT_MEASURED
from finlab_allocator.frames import StaticFrames
from finlab_allocator.parameters import Parameters

NO_STAMP = 0.0
"""Time of a message that has no stamp [s]."""


class StampedInput(NamedTuple):
    """A wrench, or a velocity, as it came."""

    numbers: Array
    """Fx, Fy, Fz, Tx, Ty, Tz (6,) [N, N m]; of a velocity VX, VY, VZ, WX, WY, WZ [m/s, rad/s]."""
    frame: str
    """Its frame; empty for that of the robot."""
    stamp_s: float
    """When it was made, by the clock of ROS [s]; `NO_STAMP` where it does not say."""


class ImuSample(NamedTuple):
    """A sample of an IMU, as it came."""

    rates: Array
    """Angular velocity (3,) in the IMU's frame [rad/s]."""
    orientation: Array
    """Quaternion x, y, z, w (4,) of the IMU's frame in one with z up; 0 where there is none."""
    frame: str
    """The IMU's frame; empty for that of the robot."""
    stamp_s: float
    """When it was taken, by the clock of ROS [s]; `NO_STAMP` where it does not say."""
    acceleration: Array = NOT_MEASURED
    """Specific force (3,) in the IMU's frame [m/s^2]; NaN where there is none."""


class DriveSample(NamedTuple):
    """What some drives say of themselves, as it came."""

    names: tuple[str, ...]
    """Of the actuators."""
    speed: Array
    """Speeds, one of each name; NaN where there is none."""
    current: Array
    """Currents [A], in the same order."""
    stamp_s: float
    """When they were taken, by the clock of ROS [s]; `NO_STAMP` where it does not say."""


class Target(NamedTuple):
    """A wrench to answer."""

    wrench: Array
    """(6,) [N, N m] in the frame of the robot, 0 along axes that were NaN."""
    free: tuple[str, ...]
    """Axes that may take any wrench."""


def target_of(
    given: StampedInput, now_s: float, parameters: Parameters, frames: StaticFrames
) -> Target:
    """Returns the target that a wrench asks for.

    Args:
        given: the wrench.
        now_s: now, by the clock of ROS [s].
        parameters: of the node.
        frames: static transforms that are known.

    Raises:
        CommandError: it is stale, of an unknown frame, or holds NaN or infinity.
    """
    age_of("wrench", given.stamp_s, now_s, parameters.watchdog_s)
    wrench = given.numbers
    for axis, value in zip(AXES, wrench.tolist(), strict=True):
        if math.isinf(value):
            raise CommandError(f"wrench: {axis} is infinite, expected a number in N or N m")
    is_nan = np.isnan(wrench)
    if is_nan.any():
        return _freed(given, is_nan, parameters)
    if given.frame not in ("", parameters.frame):
        wrench = frames.wrench_in(parameters.frame, given.frame, wrench)
    return Target(wrench, parameters.free)


def velocity_of(
    given: StampedInput, now_s: float, parameters: Parameters, frames: StaticFrames
) -> Array:
    """Returns a velocity (6,) of the robot [m/s, rad/s] in its own frame.

    Args:
        given: the velocity.
        now_s: now, by the clock of ROS [s].
        parameters: of the node.
        frames: static transforms that are known.

    Raises:
        CommandError: it is stale, of an unknown frame, or holds NaN or infinity.
    """
    age_of("velocity", given.stamp_s, now_s, parameters.watchdog_s)
    velocity = given.numbers
    if given.frame not in ("", parameters.frame):
        velocity = frames.twist_in(parameters.frame, given.frame, velocity)
    check_flow(velocity)
    return velocity


def age_of(what: str, stamp_s: float, now_s: float, most_s: float) -> float:
    """Returns how old a message is by its stamp [s]; 0 without a stamp, or ahead of the clock.

    Args:
        what: the message, for the sentence.
        stamp_s: its stamp [s].
        now_s: now, by the clock of ROS [s].
        most_s: age up to which it counts [s].

    Raises:
        CommandError: it is older than that, or lies as far ahead.
    """
    if stamp_s == NO_STAMP:
        return 0.0
    age_s = now_s - stamp_s
    if age_s > most_s:
        raise CommandError(
            f"{what}: its stamp is {age_s:.3g} s old, expected at most watchdog_s = {most_s:g} s; "
            "send newer ones, or set the clocks of both computers"
        )
    if age_s < -most_s:
        raise CommandError(
            f"{what}: its stamp lies {-age_s:.3g} s ahead of this computer's clock, expected at "
            f"most watchdog_s = {most_s:g} s; set the clocks of both computers"
        )
    return max(age_s, 0.0)


def _freed(given: StampedInput, is_nan: Array, parameters: Parameters) -> Target:
    """The target of a wrench of which some components are NaN."""
    names = tuple(axis for axis, flag in zip(AXES, is_nan, strict=True) if flag)
    if parameters.nan == "refuse":
        raise CommandError(
            f"wrench: {', '.join(names)} is NaN, expected numbers; with nan := free such an axis "
            "may take any wrench"
        )
    if given.frame not in ("", parameters.frame):
        raise CommandError(
            f"wrench: {', '.join(names)} is NaN in frame {given.frame!r:.60}, and an axis can be "
            f"free in {parameters.frame!r:.60} alone; send it in that frame"
        )
    free = tuple(axis for axis in AXES if axis in parameters.free or axis in names)
    return Target(np.where(is_nan, 0.0, given.numbers), free)
