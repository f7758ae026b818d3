"""Directions on a robot, as files give them: unit vectors in the body frame, rounded to some decimals."""

import math
from typing import Annotated

from msgspec import Meta

from finlab.errors import LayoutError

Vector = tuple[float, float, float]
Component = Annotated[float, Meta(ge=-1.001, le=1.001)]
Direction3 = tuple[Component, Component, Component]
"""A unit vector in a file."""
ROUNDED = 1e-3
"""By how much a unit vector in a file may be longer or shorter than 1, and two that stand across each other
may miss the right angle [rad]: three decimals or more."""
EXACT = 1e-14
"""Deviations up to this one are rounding; such vectors stay as they are."""


def unit_vector(key: str, vector: Vector | None) -> Vector:
    """Returns a direction with length 1 exactly.

    Raises:
        LayoutError: it is missing, or its length is not 1 within `ROUNDED`; the message names the key.
    """
    if vector is None:
        raise LayoutError("required key is missing", key)
    length = math.hypot(*vector)
    if abs(length - 1.0) > ROUNDED:
        raise LayoutError(f"expected a unit vector, got one of length {length:.6g}; divide it by that", key)
    if abs(length - 1.0) < EXACT:
        return vector
    x, y, z = (value / length for value in vector)
    return x, y, z


def axes_across(first: tuple[str, Vector | None], second: tuple[str, Vector | None]) -> tuple[Vector, Vector]:
    """Returns two directions, each with its key, as unit vectors at a right angle; the first stays as it is.

    Raises:
        LayoutError: one is missing or no unit vector, or they do not stand across each other.
    """
    a, b = unit_vector(*first), unit_vector(*second)
    along = sum(x * y for x, y in zip(a, b, strict=True))
    if abs(along) > ROUNDED:
        degrees = math.degrees(math.acos(max(-1.0, min(1.0, along))))
        raise LayoutError(f"must stand across {first[0]}, got {degrees:.4g} degrees between them", second[0])
    if abs(along) < EXACT:
        return a, b
    across = (b[0] - along * a[0], b[1] - along * a[1], b[2] - along * a[2])
    return a, unit_vector(second[0], across)


def cross(a: Vector, b: Vector) -> Vector:
    """Returns the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
