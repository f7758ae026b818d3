"""Angles, directions on a robot as files give them, turns of frames, and the axes of a wrench."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import LayoutError

TURN = 2.0 * math.pi
"""A full turn [rad]."""
FULL_TURN_TOLERANCE = 1e-6
"""By how much [rad] an arc may fall short of a full turn and still be one."""
FILE_TURN_TOLERANCE = 1e-3
"""By how much [rad] zero directions in a file, which are rounded, may miss a full turn or exceed
it."""


def is_full_turn(arc: Any) -> Any:
    """Says whether arcs [rad] cover the circle, for a number, an array or a tensor."""
    return arc >= TURN - FULL_TURN_TOLERANCE


def wrapped(angle: ArrayLike) -> Array:
    """Returns the same angles (...) within [-pi, pi) [rad]."""
    return np.asarray(np.mod(np.asarray(angle) + math.pi, TURN) - math.pi)


def feasible(command: AnyArray, lower: Array, upper: Array, angle: NDArray[np.bool_]) -> AnyArray:
    """Returns commands (..., n, 3) brought within limits (n, 3) exactly: those that are angles (n,
    3) wrap towards the middle of theirs, then all clip."""
    seam = 0.5 * (lower + upper) - math.pi
    turned = np.where(angle, np.mod(command - seam, TURN) + seam, command)
    return np.asarray(np.clip(turned, lower, upper))


def command_change(command: ArrayLike) -> Array:
    """Changes from each command to the next, without their sign: (T, n, 3) to (T - 1, n, 3).

    Amplitude [rad], frequency [Hz], and the zero direction the short way round [rad]; NaN stays
    NaN.
    """
    change = np.abs(np.diff(np.asarray(command), axis=0))
    change[..., 2] = np.abs(wrapped(change[..., 2]))
    return change


Vector = tuple[float, float, float]
Component = Annotated[float, Meta(ge=-1.001, le=1.001)]
Direction3 = tuple[Component, Component, Component]
"""A unit vector in a file."""
ROUNDED = 1e-3
"""By how much a unit vector in a file may be longer or shorter than 1, and two that stand across
each other may miss the right angle [rad]: three decimals or more."""
EXACT = 1e-14
"""Deviations up to this one are rounding; such vectors stay as they are."""


def unit_vector(key: str, vector: Vector | None) -> Vector:
    """Returns a direction with length 1 exactly. Raises LayoutError: it is missing, or its length
    is not 1 within `ROUNDED`; the message names the key."""
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
    first: tuple[str, Vector | None], second: tuple[str, Vector | None]
) -> tuple[Vector, Vector]:
    """Returns two directions, each with its key, as unit vectors at a right angle; the first stays
    as it is. Raises LayoutError: one is missing or no unit vector, or they do not stand across each
    other."""
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


def cross(a: Vector, b: Vector) -> Vector:
    """Returns the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


MIRROR = np.array([1.0, -1.0, 1.0])
"""The plane y = 0 as a mirror."""
AHEAD = np.array([1.0, 0.0, 0.0])
UP = np.array([0.0, 0.0, 1.0])
SHORT = 1e-6
"""Length below which a vector has no direction, and an axis no part along another one."""
DIGITS = 12


def rotation(axis: ArrayLike, angle: float) -> Array:
    """The matrix (3, 3) of a turn about a unit vector (3,) by an angle [rad], by Rodrigues'
    formula."""
    x, y, z = np.asarray(axis, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def across(axis: Array, wanted: Array) -> Array:
    """Returns the unit vector across an axis (3,) that is nearest to another one."""
    part = wanted - (wanted @ axis) * axis
    return np.asarray(part / np.linalg.norm(part))


def least_turn(old: Array, new: Array, spare: Array) -> Array:
    """Returns the least turn (3, 3) of one unit vector to another; about `spare` where they are
    opposite."""
    axis = np.cross(old, new)
    size = float(np.linalg.norm(axis))
    if size < SHORT:
        return np.eye(3) if old @ new > 0.0 else rotation(spare, math.pi)
    return rotation(axis / size, math.atan2(size, float(old @ new)))


def arc_words(low: float, high: float) -> str:
    """Returns an arc [rad] in degrees, in words."""
    low = math.degrees(low)
    high = math.degrees(high)
    return "any direction" if high - low >= 360.0 - 1e-6 else f"{low:.0f}..{high:.0f} deg"


def vector_words(values: Sequence[float]) -> str:
    """Returns a vector in words."""
    return f"({', '.join(f'{value:.3g}' for value in values)})"


Axis = Literal["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
AXES: tuple[Axis, ...] = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
"""The axes of a wrench, in order: forces [N] and torques [N m] along x forward, y left, z up."""
UNITS = ("N", "N", "N", "N m", "N m", "N m")
"""In which each of them is told."""
CommandedAxes = Annotated[
    tuple[Axis, ...],
    Meta(min_length=1, max_length=6, description="axes of the wrench that the robot commands"),
]


def mask_of(axes: Sequence[str]) -> NDArray[np.bool_]:
    """Returns a mask (6,) of some axes."""
    return np.array([axis in axes for axis in AXES])


def axes_in(mask: NDArray[np.bool_]) -> tuple[Axis, ...]:
    """Returns the axes of a mask (6,)."""
    return tuple(axis for axis, one in zip(AXES, mask, strict=True) if one)
