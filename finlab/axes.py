"""Geometry of the body frame: angles, unit vectors as files give them, rotations, and the axes of
a wrench.

Actuators, layouts, exchange formats and the app use it. The body frame has x forward, y left, z up.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import LayoutError

Vector3 = tuple[float, float, float]
"""Components along x (forward), y (left) and z (up) of the body frame, in any unit."""
Component = Annotated[float, Meta(ge=-1.001, le=1.001)]
"""A component of a unit vector in a file, which is rounded."""
Direction3 = tuple[Component, Component, Component]
"""A unit vector in a file, body frame."""
Axis = Literal["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
"""Name of one axis of a wrench."""

AXES: tuple[Axis, ...] = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
"""The axes of a wrench, in order: forces [N] and torques [N m] along x forward, y left, z up."""
UNITS = ("N", "N", "N", "N m", "N m", "N m")
"""Unit of each axis of a wrench."""
MotionAxis = Literal["surge", "sway", "heave", "roll", "pitch", "yaw"]
"""Name of one axis of motion."""
MOTIONS: tuple[MotionAxis, ...] = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""The axes of motion, in the order of a wrench: what a force or torque along each one moves."""
CommandedAxes = Annotated[
    tuple[Axis, ...],
    Meta(min_length=1, max_length=6, description="axes of the wrench that the robot commands"),
]
"""Axes of the wrench that a robot commands, as a layout file gives them."""

TURN = 2.0 * math.pi
"""A full turn [rad]."""
FULL_TURN_TOLERANCE = 1e-6
"""Most by which an arc may be less than a full turn and still count as one [rad]."""
FILE_TURN_TOLERANCE = 1e-3
"""The same of zero directions in a file, which are rounded; they may exceed a turn as much
[rad]."""
ROUNDED = 1e-3
"""Most by which a unit vector in a file may be longer or shorter than 1, and two at a right angle
may miss it [rad]: three decimals or more."""
EXACT = 1e-14
"""Deviations up to this one are rounding; such vectors stay as they are."""
SHORT = 1e-6
"""Length below which a vector has no direction, and an axis no component along another one."""
DIGITS = 12
"""Decimals to which axes and points are rounded after a rotation."""
DEGREES_ROUNDED = 1e-6
"""Most by which an arc in degrees may be less than a full turn and be printed as one [deg]."""

MIRROR = np.array([1.0, -1.0, 1.0])
"""Signs (3,) of a vector's components in its mirror image in the plane y = 0."""
AHEAD = np.array([1.0, 0.0, 0.0])
"""The x axis of the body frame (3,)."""
UP = np.array([0.0, 0.0, 1.0])
"""The z axis of the body frame (3,)."""


def is_full_turn(arc: Any) -> Any:
    """Returns whether arcs [rad], a number, an array or a tensor, cover the circle."""
    return arc >= TURN - FULL_TURN_TOLERANCE


def wrapped(angle: ArrayLike) -> Array:
    """Returns angles (...) [rad] modulo a turn, within [-pi, pi)."""
    return np.asarray(np.mod(np.asarray(angle) + math.pi, TURN) - math.pi)


def feasible(command: AnyArray, lower: Array, upper: Array, angle: NDArray[np.bool_]) -> AnyArray:
    """Returns commands brought within their limits exactly.

    Args:
        command: commands (..., n, 3) [rad, Hz or N, by kind].
        lower: least command (n, 3).
        upper: greatest command (n, 3).
        angle: which numbers (n, 3) are angles; these are first wrapped to within half a turn of
            the middle of their limits.

    Returns:
        Commands (..., n, 3) within the limits.
    """
    seam = 0.5 * (lower + upper) - math.pi
    wrapped_command = np.where(angle, np.mod(command - seam, TURN) + seam, command)
    return np.asarray(np.clip(wrapped_command, lower, upper))


def command_change(command: ArrayLike) -> Array:
    """Returns the absolute changes from each command of fins to the next.

    Args:
        command: amplitude [rad], frequency [Hz] and zero direction [rad] (T, n, 3); NaN stays NaN.

    Returns:
        Absolute changes (T - 1, n, 3), of the zero direction the shorter way round.
    """
    change = np.abs(np.diff(np.asarray(command), axis=0))
    change[..., 2] = np.abs(wrapped(change[..., 2]))
    return change


def unit_vector(key: str, vector: Vector3 | None) -> Vector3:
    """Returns a unit vector of a file with length 1 to rounding.

    Args:
        key: the argument or key that it belongs to, for the message.
        vector: the vector, body frame; None where the file has none.

    Raises:
        LayoutError: it is missing, or its length is not 1 within `ROUNDED`.
    """
    if vector is None:
        raise LayoutError("is missing, expected a unit vector", key)
    length = math.hypot(*vector)
    if abs(length - 1.0) > ROUNDED:
        raise LayoutError(
            f"expected a unit vector, got one of length {length:.6g}; divide it by that", key
        )
    if abs(length - 1.0) < EXACT:
        return vector
    x, y, z = (value / length for value in vector)
    return x, y, z


def axes_across(
    first: tuple[str, Vector3 | None], second: tuple[str, Vector3 | None]
) -> tuple[Vector3, Vector3]:
    """Returns two unit vectors of a file at a right angle to rounding; the second is turned.

    Args:
        first: key and vector, body frame.
        second: key and vector that is to be across the first.

    Raises:
        LayoutError: one is missing or no unit vector, or the angle is not a right one within
            `ROUNDED`.
    """
    a = unit_vector(*first)
    b = unit_vector(*second)
    along = sum(x * y for x, y in zip(a, b, strict=True))
    if abs(along) > ROUNDED:
        degrees = math.degrees(math.acos(max(-1.0, min(1.0, along))))
        raise LayoutError(
            f"must stand across {first[0]}, got {degrees:.4g} degrees between them", second[0]
        )
    if abs(along) < EXACT:
        return a, b
    across = (b[0] - along * a[0], b[1] - along * a[1], b[2] - along * a[2])
    return a, unit_vector(second[0], across)


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Returns the cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def rotation(axis: ArrayLike, angle: float) -> Array:
    """Returns the rotation matrix (3, 3) about a unit vector (3,) by an angle [rad].

    Rodrigues' formula, R = I + sin(angle) K + (1 - cos(angle)) K^2, where K v = axis x v.
    """
    x, y, z = np.asarray(axis, dtype=np.float64)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K)


def across(axis: Array, wanted: Array) -> Array:
    """Returns the unit vector (3,) at a right angle to a unit vector `axis` (3,) that is nearest to
    the vector `wanted` (3,)."""
    rejection = wanted - (wanted @ axis) * axis
    return np.asarray(rejection / np.linalg.norm(rejection))


def least_turn(old: Array, new: Array, half_turn_axis: Array) -> Array:
    """Returns the rotation matrix (3, 3) of least angle that turns one unit vector to another.

    Args:
        old: unit vector (3,).
        new: unit vector (3,).
        half_turn_axis: unit vector (3,) about which it turns where the two are opposite.
    """
    axis = np.cross(old, new)
    sine = float(np.linalg.norm(axis))
    cosine = float(old @ new)
    if sine < SHORT:
        return np.eye(3) if cosine > 0.0 else rotation(half_turn_axis, math.pi)
    return rotation(axis / sine, math.atan2(sine, cosine))


def arc_words(low: float, high: float) -> str:
    """Returns an arc [rad] in degrees, for a cell of a printed table."""
    low = math.degrees(low)
    high = math.degrees(high)
    if high - low >= 360.0 - DEGREES_ROUNDED:
        return "any direction"
    return f"{low:.0f}..{high:.0f} deg"


def vector_words(values: Sequence[float]) -> str:
    """Returns a vector as text with three digits, for a cell of a printed table."""
    return f"({', '.join(f'{value:.3g}' for value in values)})"


def mask_of(axes: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which axes of a wrench (6,) are among some."""
    return np.array([axis in axes for axis in AXES])


def axes_in(mask: NDArray[np.bool_]) -> tuple[Axis, ...]:
    """Returns the names of the axes that are set in a mask (6,)."""
    return tuple(axis for axis, is_set in zip(AXES, mask, strict=True) if is_set)
