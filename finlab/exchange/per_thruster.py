"""Thrusters by place and direction in plain values: a mapping for each, or a list of all of each kind."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.labels import axis_of, lookup
from finlab.exchange.limits import limits_in
from finlab.exchange.walk import Node, numbers_in
from finlab.layout import Thruster

UNIT = 0.05
"""A vector whose length is this close to 1 is a direction."""
Row = dict[str, Any]


def records_in(node: Node) -> dict[str, Row]:
    """Returns the mappings, by name, of thrusters that stand below a node; none where it holds no such.

    Raises:
        LayoutError: some have a place or a direction alone.
    """
    if isinstance(node.value, Mapping):
        held = [(str(key), row) for key, row in node.value.items()]
    elif isinstance(node.value, list):
        held = [(f"[{i}]", row) for i, row in enumerate(node.value)]
    else:
        return {}
    rows = {key: dict(_split(row)) for key, row in held if isinstance(row, Mapping)}
    whole: dict[str, Row] = {key: row for key, row in rows.items() if _place(row) and _points(row)}
    for key, row in rows.items() if whole else ():
        if key not in whole and (_place(row) or _points(row)):
            lacks = "direction" if _place(row) else "position"
            raise LayoutError(f"has no {lacks}, and others beside it have one", f"{node.words}.{key}")
    return whole


def lists_in(node: Node, exchange: Exchange) -> dict[str, Row]:
    """Returns the same of a mapping that holds the places of all thrusters, and all directions, as lists.

    Raises:
        LayoutError: their shape is not said, or the lists do not fit each other.
    """
    if not isinstance(node.value, Mapping):
        return {}
    (place_key, places, _), (key, directions, _) = (
        lookup(node.value, words, labels.LENGTHS) for words in (labels.POSITION, labels.DIRECTION)
    )
    axes, at = numbers_in(directions), numbers_in(places)
    if axes is None or at is None or axes.size < 6 or axes.size % 3 or axes.ndim > 2:
        return {}
    names = lookup(node.value, labels.NAMES)[1]
    count = lookup(node.value, labels.COUNT)[1]
    n = axes.size // 3
    if at.size != axes.size:
        raise LayoutError(f"holds {at.size} numbers, and {key} {axes.size}", f"{node.words}.{place_key}")
    if axes.ndim == 1 and n != (len(names) if isinstance(names, list) else count):
        raise LayoutError(
            f"holds {axes.size} numbers without a shape; write a list of 3 for each, or count: {n}",
            f"{node.words}.{key}",
        )
    by_row = _by_row(axes, n, f"{node.words}.{key}", exchange)
    axes, at = (each.reshape(n, 3) if by_row else each.reshape(3, n).T for each in (axes, at))
    ends = limits_in(node.value, n, exchange)
    told = names if isinstance(names, list) and len(names) == n else [f"thruster{i + 1}" for i in range(n)]
    rows = zip(map(str, told), at.tolist(), axes.tolist(), ends, strict=True)
    return {
        name: {place_key: place, key: axis, **({} if pair is None else {"limits": list(pair)})}
        for name, place, axis, pair in rows
    }


def _by_row(axes: Array, n: int, what: str, exchange: Exchange) -> bool:
    """Whether each thruster's direction stands in one piece, not all x before all y."""
    if axes.ndim == 2 and n != 3:
        return axes.shape == (n, 3)
    if exchange.rows:
        return exchange.rows == "thrusters"
    fit = [_all_unit(axes.reshape(n, 3)), _all_unit(axes.reshape(3, n).T)]
    if fit[0] == fit[1]:
        raise LayoutError(
            "may stand thruster by thruster, or all x before all y; say --rows thrusters or --rows axes", what
        )
    order = "thruster by thruster" if fit[0] else "all x, all y, all z"
    exchange.note(f"{what} is read {order}: so each direction has the length 1.")
    return fit[0]


def _all_unit(vectors: Array) -> bool:
    return bool((np.abs(np.linalg.norm(vectors, axis=1) - 1.0) < UNIT).all())


def thruster_of(key: str, row: Row, frd: bool, center: Array, exchange: Exchange) -> Thruster:
    """Returns the thruster of a mapping under a key; `center` (3,) [m] becomes the origin.

    Raises:
        LayoutError: something in it is no number, or its direction is not clear.
    """
    name_key, name, _ = lookup(row, labels.NAME)
    name = str(name) if name_key and not str(name).isdecimal() else key.strip("[]")
    name = f"thruster{int(name) + 1}" if name.isdecimal() and key.startswith("[") else name
    place_key, place, size = lookup(row, labels.POSITION, labels.LENGTHS)
    place = _three(place, f"{key}.{place_key}") * size - center
    axis_key, axis, _ = lookup(row, labels.DIRECTION)
    if axis_key:
        axis = _three(axis, f"{key}.{axis_key}")
    else:
        axis_key, angles, size = lookup(row, labels.ANGLES, labels.DEGREES)
        turn = _three(angles, f"{key}.{axis_key}") / size
        if np.abs(turn).max() > 2 * np.pi:
            raise LayoutError("is more than a turn; are these degrees? call it rpy_deg", f"{key}.{axis_key}")
        exchange.note(f"{axis_key} turns the axis x of a thruster, along which it pushes.")
        axis = Rotation.from_euler("xyz", turn).apply([1.0, 0.0, 0.0])
    length = float(np.linalg.norm(axis))
    if not 1e-9 < length < 1e9:
        raise LayoutError("has no length", f"{key}.{axis_key}")
    if abs(length - 1.0) > UNIT:
        exchange.note(f"{key}.{axis_key} has length {length:g}; its direction alone is read.")
    sign = TO_FRD[:3, 0] if frd else np.ones(3)
    (force,) = limits_in(row, 1, exchange)
    return exchange.thruster(name, place * sign, axis / length * sign, force)


def _split(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """A mapping's items; `x`, `y`, `z` become one position, `dx`, `dy`, `dz` or the like one direction."""
    short = {str(key).lower().strip(): value for key, value in row.items()}
    yield from row.items()
    if {"x", "y"} <= set(short):
        if any(axis_of(key) for key in short if key not in ("x", "y", "z", "fx", "fy", "fz")):
            return  # a wrench, or a place with angles: whoever reads wrenches sees to it
        yield "position", [short["x"], short["y"], short.get("z", 0.0)]
    for letter in ("p", "pos", "pos_"):
        keys = [f"{letter}{axis}" for axis in "xyz"]
        if set(keys[:2]) <= set(short):
            yield "position", [short[keys[0]], short[keys[1]], short.get(keys[2], 0.0)]
    for letter in ("d", "a", "n", "u", "dir_", "dir", "f" if "x" in short else "d"):
        keys = [f"{letter}{axis}" for axis in "xyz"]
        if set(keys[:2]) <= set(short):
            yield "direction", [short[keys[0]], short[keys[1]], short.get(keys[2], 0.0)]


def _place(row: Row) -> bool:
    return _short(lookup(row, labels.POSITION, labels.LENGTHS)[1])


def _short(value: Any) -> bool:
    """Whether a value may be a vector of one thruster."""
    return isinstance(value, Mapping | str) or (
        isinstance(value, list) and len(value) < 6 and not any(isinstance(each, list) for each in value)
    )


def _points(row: Row) -> bool:
    """Whether a mapping says where its thruster points.

    Raises:
        LayoutError: it may be a direction as well as angles.
    """
    key, value, _ = lookup(row, labels.UNCLEAR)
    told = any(
        _short(lookup(row, words, units)[1])
        for words, units in ((labels.DIRECTION, None), (labels.ANGLES, labels.DEGREES))
    )
    if key and not told and _place(row) and _short(value):
        raise LayoutError(
            "may be a direction, or roll, pitch and yaw; call it `direction`, or `rpy` in radians", key
        )
    return told


def _three(value: Any, what: str) -> Array:
    array = numbers_in(value)
    if isinstance(value, Mapping):
        array = numbers_in([value.get(axis) for axis in "xyz"])
    if array is None or array.shape != (3,):
        raise LayoutError(f"is {value!r:.60}, expected three numbers", what)
    return array
