"""Directions in which actuators point: their own axes, turned, mirrored, and pointed along a direction."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Actuator, Fin, Layout, Rudder, Thruster
from finlab.layout.axes import is_full_turn, wrapped

Vector = tuple[float, float, float]
MIRROR = np.array([1.0, -1.0, 1.0])
"""The plane y = 0 as a mirror."""
AHEAD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
SHORT = 1e-6
"""Length below which a vector has no direction, and an axis no part along another one."""
DIGITS = 12


def axis_names(part: Actuator) -> tuple[str, ...]:
    """Fields of an actuator's own axes, as the rows of its frame."""
    return ("shaft", "zero") if isinstance(part, Fin) else part.AXES or ("axis",)


def arc_name(part: Actuator) -> str:
    """The field with the angles that an actuator turns through; nothing for one with a fixed axis."""
    return {"rudder": "deflection", "azimuth": "arc", "tilt": "arc"}.get(part.type, "")


def direction(part: Actuator) -> Vector:
    """What of an actuator is pointed: a thruster's axis, zero of an azimuth, the shaft of a fin or rudder."""
    return part.frame[axis_names(part).index(pointed(part))]


def pointed(part: Actuator) -> str:
    """The field that `direction` is."""
    names = axis_names(part)
    return names[-1] if part.type in ("azimuth", "tilt") else names[0]


def with_axes(part: Actuator, frame: ArrayLike, position: ArrayLike | None = None) -> Actuator:
    """The actuator with other own axes (3, 3), rows in the body frame, and at another place (3,) [m].

    The shaft of a fin that is horizontal, with zero across it, becomes a mounting angle again.
    """
    rows = (np.round(np.asarray(frame, dtype=np.float64), DIGITS) + 0.0).tolist()
    changes: dict[str, Any] = dict(zip(axis_names(part), map(tuple, rows), strict=False))
    if isinstance(part, Fin):
        changes["mounting_angle"] = None
    if position is not None:
        changes["position"] = tuple((np.round(np.asarray(position, dtype=np.float64), DIGITS) + 0.0).tolist())
    return replace(part, **changes)


def rotated(part: Actuator, axis: ArrayLike, angle: float) -> Actuator:
    """The actuator turned about an axis (3,) of the body by an angle [rad], place and own axes alike."""
    turn = rotation(axis, angle)
    return with_axes(part, np.array(part.frame) @ turn.T, turn @ np.array(part.position))


def rotation(axis: ArrayLike, angle: float) -> Array:
    """The matrix (3, 3) of a turn about a unit vector (3,) by an angle [rad]."""
    x, y, z = np.asarray(axis, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def image(part: Actuator) -> Actuator:
    """The actuator on the other side of the plane y = 0, under the same name.

    What turns one way about a shaft turns the other way about its image: arcs and the reaction torque change
    sign. A horizontal shaft keeps its mounting angle, whose zero is the other way round there.
    """
    level = isinstance(part, Fin) and part.mounting_angle is not None
    frame = np.array(part.frame) * MIRROR * ([[1.0], [-1.0], [1.0]] if level else 1.0)
    mirrored = with_axes(part, frame, np.array(part.position) * MIRROR)
    if isinstance(mirrored, Fin):
        low, high = mirrored.limits.zero_direction
        if is_full_turn(high - low):
            return mirrored
        ends = _turned_back(low, high, math.pi if level else 0.0)
        return replace(mirrored, limits=replace(mirrored.limits, zero_direction=ends))
    changes: dict[str, Any] = {}
    if name := arc_name(mirrored):
        changes[name] = tuple(-end + 0.0 for end in reversed(getattr(mirrored, name)))
    if not isinstance(mirrored, Rudder):
        changes["torque_per_newton"] = -mirrored.torque_per_newton + 0.0
    return replace(mirrored, **changes)


def _turned_back(low: float, high: float, about: float) -> tuple[float, float]:
    """The interval of `about` less the angles of another one [rad], within a turn of 0."""
    middle, half = float(wrapped(about - 0.5 * (low + high))), 0.5 * (high - low)
    return middle - half, middle + half


def facing(part: Actuator, towards: Vector) -> Actuator:
    """The actuator with its `direction` along a vector of any length.

    The other axis turns along as little as can be, but where it has no arc to keep: a fin that turns all
    round has zero where a mounting angle has it, or ahead. A rudder has its leading edge ahead. Raises
    FinlabError: the vector has no length."""
    length = math.hypot(*towards)
    if not SHORT < length < math.inf:
        raise FinlabError(f"direction of {part.name}: expected a vector with a length, got {towards}")
    wanted, frame = np.array(towards) / length, np.array(part.frame)
    k = axis_names(part).index(pointed(part))
    if np.abs(wanted - frame[k]).max() < SHORT:
        return part
    frame = frame @ _between(frame[k], wanted, frame[2 if k == 0 else 0]).T
    frame[k] = wanted
    if isinstance(part, Fin) and is_full_turn(np.diff(part.limits.zero_direction)[0]):
        level = abs(wanted[2]) < SHORT
        frame[1] = np.cross(UP, wanted) if level else _across(wanted, AHEAD)
    if isinstance(part, Rudder) and math.hypot(*wanted[1:]) > SHORT:
        frame[1] = _across(wanted, AHEAD)
    return with_axes(part, frame)


def turned_about(part: Actuator, towards: Vector) -> Actuator:
    """The actuator turned about its `direction`, with its other axis as near to a vector of any length as
    stands across it: zero of a fin, the leading edge of a rudder, what an azimuth turns about. Raises
    FinlabError: the vector points along the direction."""
    if isinstance(part, Thruster):
        return part
    frame, wanted = np.array(part.frame), np.array(towards, dtype=np.float64)
    k = axis_names(part).index(pointed(part))
    if not SHORT < np.linalg.norm(np.cross(frame[k], wanted)) < math.inf:
        raise FinlabError(f"{part.name}: expected a direction across its {pointed(part)}, got {towards}")
    frame[1 - k] = _across(frame[k], wanted)
    return with_axes(part, frame)


def _across(axis: Array, wanted: Array) -> Array:
    """The unit vector across an axis that is nearest to another one."""
    across = wanted - (wanted @ axis) * axis
    return np.asarray(across / np.linalg.norm(across))


def _between(old: Array, new: Array, spare: Array) -> Array:
    """The least turn (3, 3) of one unit vector to another; about `spare` where they are opposite."""
    axis = np.cross(old, new)
    size = float(np.linalg.norm(axis))
    if size < SHORT:
        return np.eye(3) if old @ new > 0.0 else rotation(spare, math.pi)
    return rotation(axis / size, math.atan2(size, float(old @ new)))


def replaced(layout: Layout, part: Actuator) -> Layout:
    """The layout with another actuator in the place of the one of the same name."""
    parts = list(layout.actuators)
    parts[layout.index(part.name)] = part
    return replace(layout, actuators=tuple(parts))


def part_of(layout: Layout, name: str) -> Actuator:
    """The actuator of a name."""
    return layout.actuators[layout.index(name)]
