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
"""As `FULL_TURN_TOLERANCE`, for zero directions in a file, which are rounded; they may exceed a
turn as much [rad]."""
FILE_UNIT_TOLERANCE = 1e-3
"""Largest difference from 1 of the length of a unit vector in a file [1], and from a right angle of
two axes [rad]: people write three decimals or more."""
UNIT_ROUNDING = 1e-14
"""Differences up to this one are rounding [1, rad]: such vectors stay as they are, bit for bit."""
MIN_LENGTH = 1e-6
"""Length below which a vector has no direction, and an axis no component along another one [1]."""
SAME_DIRECTION = 1e-9
"""Difference of direction that is rounding [rad]."""
VERTICAL = 1e-6
"""How far a direction may be off the vertical or the horizontal [1]."""
DECIMALS = 12
"""Decimals to which axes and points are rounded after a rotation."""
FULL_TURN_TOLERANCE_DEG = 1e-6
"""Most by which an arc in degrees may be less than a full turn and be printed as one [deg]."""

MIRROR_SIGNS = np.array([1.0, -1.0, 1.0])
"""Signs (3,) of a vector's components in its mirror image in the plane y = 0."""
FORWARD = np.array([1.0, 0.0, 0.0])
"""The x axis of the body frame (3,)."""
UP = np.array([0.0, 0.0, 1.0])
"""The z axis of the body frame (3,)."""


def is_full_turn(arc: Any) -> Any:
    """Returns whether arcs [rad], a number, an array or a tensor, cover the circle."""
    return arc >= TURN - FULL_TURN_TOLERANCE


def arcs_outside(
    arc: tuple[float, float] | None, zones: Sequence[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Returns what zones leave of an arc.

    Args:
        arc: least and greatest angle [rad]; None of all directions.
        zones: least and greatest angle of each zone [rad], modulo a turn.

    Returns:
        Arcs [rad], ascending; none where the zones leave nothing.
    """
    begin, end = (0.0, TURN) if arc is None else arc
    if arc is None and zones:
        # Begin all round at the end of a zone, where no arc is cut in two.
        begin = zones[0][1]
        end = begin + TURN
    taken = []
    for low, high in zones:
        first = begin + (low - begin) % TURN
        for turn in (0.0, -TURN):
            taken.append((first + turn, first + turn + high - low))
    arcs = []
    position = begin
    for low, high in sorted(taken):
        if low > position + SAME_DIRECTION:
            arcs.append((position, min(low, end)))
        position = max(position, high)
        if position >= end:
            break
    if position < end - SAME_DIRECTION:
        arcs.append((position, end))
    return [(low, high) for low, high in arcs if high > low + SAME_DIRECTION]


def wrapped(angle: ArrayLike) -> Array:
    """Returns angles (...) [rad] modulo a turn, within [-pi, pi)."""
    return np.asarray(np.mod(np.asarray(angle) + math.pi, TURN) - math.pi)


def wrapped_angle(angle: float) -> float:
    """Returns one angle [rad] modulo a turn, within [-pi, pi), as `wrapped` does many."""
    return (angle + math.pi) % TURN - math.pi


def feasible(
    command: AnyArray, lower: Array, upper: Array, is_angle: NDArray[np.bool_]
) -> AnyArray:
    """Returns the commands within limits that are nearest to given ones.

    Args:
        command: commands (..., n, 3) [rad, Hz or N, by kind of actuator].
        lower: least command (n, 3).
        upper: greatest command (n, 3).
        is_angle: which numbers (n, 3) are angles; these are first wrapped to within half a turn of
            the middle of their limits.

    Returns:
        Commands (..., n, 3), at a limit exactly where they were beyond it.
    """
    seam = 0.5 * (lower + upper) - math.pi
    wrapped_command = np.where(is_angle, np.mod(command - seam, TURN) + seam, command)
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
    """Returns a unit vector of a file, with length 1 to rounding.

    Args:
        key: the argument or key that it belongs to, for the message.
        vector: the vector, body frame; None where the file has none.

    Raises:
        LayoutError: it is missing, or its length is not 1 within `FILE_UNIT_TOLERANCE`.
    """
    if vector is None:
        raise LayoutError("is missing, expected a unit vector", key)
    length = math.hypot(*vector)
    if abs(length - 1.0) > FILE_UNIT_TOLERANCE:
        raise LayoutError(
            f"expected a unit vector, got one of length {length:.6g}; divide it by that", key
        )
    if abs(length - 1.0) < UNIT_ROUNDING:
        return vector
    x, y, z = (component / length for component in vector)
    return x, y, z


def perpendicular_axes(
    first: tuple[str, Vector3 | None], second: tuple[str, Vector3 | None]
) -> tuple[Vector3, Vector3]:
    """Returns two unit vectors of a file at a right angle to rounding.

    The first one keeps its direction, the second one is rotated (Gram-Schmidt).

    Args:
        first: its key and vector, body frame.
        second: key and vector of the axis that is to be perpendicular to it.

    Returns:
        Both unit vectors, body frame.

    Raises:
        LayoutError: one is missing or no unit vector, or the angle is not a right one within
            `FILE_UNIT_TOLERANCE`.
    """
    a = unit_vector(*first)
    b = unit_vector(*second)
    cosine = sum(a_k * b_k for a_k, b_k in zip(a, b, strict=True))
    if abs(cosine) > FILE_UNIT_TOLERANCE:
        degrees = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
        raise LayoutError(
            f"must stand across {first[0]}, got {degrees:.4g} degrees between them", second[0]
        )
    if abs(cosine) < UNIT_ROUNDING:
        return a, b
    # b - (a . b) a
    rejection = (b[0] - cosine * a[0], b[1] - cosine * a[1], b[2] - cosine * a[2])
    return a, unit_vector(second[0], rejection)


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Returns the cross product a x b of two vectors (3,)."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return x, y, z


def rotation(axis: ArrayLike, angle: float) -> Array:
    """Returns a rotation matrix, by Rodrigues' formula.

    R = I + sin(angle) K + (1 - cos(angle)) K^2, where K v = axis x v.

    Args:
        axis: unit vector (3,) about which it rotates.
        angle: angle of the rotation [rad].

    Returns:
        The matrix (3, 3).
    """
    x, y, z = np.asarray(axis, dtype=np.float64)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K)


def perpendicular(axis: Array, wanted: Array) -> Array:
    """Returns the unit vector perpendicular to an axis that is nearest to a wanted vector.

    Args:
        axis: unit vector (3,).
        wanted: vector (3,) of any length, not along the axis.

    Returns:
        Unit vector (3,).
    """
    rejection = wanted - (wanted @ axis) * axis
    return np.asarray(rejection / np.linalg.norm(rejection))


def least_rotation(old: Array, new: Array, half_turn_axis: Array) -> Array:
    """Returns the rotation of least angle that takes one unit vector to another.

    Args:
        old: unit vector (3,).
        new: unit vector (3,).
        half_turn_axis: unit vector (3,) about which it rotates where the two are opposite.

    Returns:
        The matrix (3, 3).
    """
    axis = np.cross(old, new)
    sine = float(np.linalg.norm(axis))
    cosine = float(old @ new)
    if sine < MIN_LENGTH:
        return np.eye(3) if cosine > 0.0 else rotation(half_turn_axis, math.pi)
    return rotation(axis / sine, math.atan2(sine, cosine))


def arc_words(low: float, high: float) -> str:
    """Returns an arc in words, for a cell of a printed table: degrees, or "any direction".

    Args:
        low: where the arc begins [rad].
        high: where it ends [rad].
    """
    low_deg = math.degrees(low)
    high_deg = math.degrees(high)
    if high_deg - low_deg >= 360.0 - FULL_TURN_TOLERANCE_DEG:
        return "any direction"
    return f"{low_deg:.0f}..{high_deg:.0f} deg"


def vector_words(values: Sequence[float]) -> str:
    """Returns a vector as text with three digits, for a cell of a printed table."""
    return f"({', '.join(f'{value:.3g}' for value in values)})"


def mask_of(axes: Sequence[str]) -> NDArray[np.bool_]:
    """Returns the mask (6,) of axes of a wrench: True for those named."""
    return np.array([axis in axes for axis in AXES])


def axes_in(mask: NDArray[np.bool_]) -> tuple[Axis, ...]:
    """Returns the names of the axes that are True in a mask (6,); the inverse of `mask_of`."""
    return tuple(axis for axis, is_set in zip(AXES, mask, strict=True) if is_set)
