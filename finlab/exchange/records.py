"""Thrusters in plain values, a mapping for each: by place and direction, or by the wrench of its
command."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES, Axis
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import Node, axis_of, lookup, nodes, numbers_in, plain
from finlab.files.csv_table import LENGTHS, TURNS

UNIT = 0.05
"""A vector whose length is this close to 1 is a direction, or a force per newton."""
WORDS = {
    "tam",
    "tcm",
    "allocation",
    "allocator",
    "alloc",
    "mixer",
    "mixing",
    "mix",
    "effectiveness",
}
"""Words of a key that holds an allocation matrix."""
NEAR = "matrix thruster thrusters thrust force forces b t configuration config control motor motors"
"""Words that may stand with `matrix` in such a key."""
OTHER = "mass inertia damping drag added coriolis covariance weight weights gain gains rotation "
OTHER += "inverse inv pinv pseudo pseudoinverse"
"""Words of a key that holds another matrix."""
CLEAR = {"fx", "fy", "fz", "tx", "ty", "tz", "mx", "my", "mz"}
"""Labels that are those of a wrench under any key."""
Row = dict[str, Any]


class Found(NamedTuple):
    """Thrusters at one place of the values, each by name, as the file has it.

    Thrusters without places and directions have wrenches (axes, n); `order` is how a note says that
    their matrix was read."""

    node: Node
    rows: dict[str, Row]
    axes: tuple[Axis, ...] = ()
    columns: Array = np.zeros((0, 0))
    order: str = ""


def found_in(data: Any, exchange: Exchange, table: bool) -> Found:
    """Returns the thrusters in plain values, or in a `table` whose six rows nothing names.

    Places and directions go before a matrix, since they tell more. Raises LayoutError: none are
    there, or several times, or they may be read in two ways."""
    placed = [each for node in nodes(data) if (each := _placed(node, exchange))]
    every = placed or [each for node in nodes(data) if (each := _wrenches(node, exchange, table))]
    if len(every) > 1:
        what = "thrusters by place and direction" if placed else "a matrix"
        keys = ", ".join(each.node.words for each in every[:6])
        raise LayoutError(f"holds {what} more than once, at {keys}; leave one in the file")
    if every:
        return every[0]
    shaped = [(each.words, numbers_in(each.value)) for each in nodes(data) if each.path]
    lists = [
        f"{words} {array.shape}" for words, array in shaped if array is not None and array.size > 5
    ]
    seen = (
        f"; its lists of numbers, {', '.join(lists[:8])}, have no key that says so" if lists else ""
    )
    raise LayoutError(
        "has no matrix, expected six rows of numbers (Fx, Fy, Fz, Tx, Ty, Tz) under a key such as "
        "`tam` or "
        f"`allocation_matrix`, or a position and a direction of each thruster{seen}"
    )


def _held(value: Any) -> dict[str, Mapping[str, Any]]:
    """The mappings right below a value, by their keys or places."""
    if isinstance(value, list):
        value = {f"[{i}]": each for i, each in enumerate(value)}
    pairs = value.items() if isinstance(value, Mapping) else ()
    return {str(key): each for key, each in pairs if isinstance(each, Mapping)}


def _placed(node: Node, exchange: Exchange) -> Found | None:
    """Thrusters by place and direction: mappings below a node, or lists of all in one."""
    rows = {key: _joined(row) for key, row in _held(node.value).items()}
    says = {
        key: (_short(lookup(row, labels.POSITION, LENGTHS)[1]), _points(row))
        for key, row in rows.items()
    }
    if not any(map(all, says.values())):
        lists = _lists(node, exchange)
        return Found(node, lists) if lists else None
    for key, (place, points) in says.items():
        if place != points:
            lacks = "direction" if place else "position"
            raise LayoutError(
                f"has no {lacks}, and others beside it have one", f"{node.words}.{key}"
            )
    return Found(node, {key: row for key, row in rows.items() if all(says[key])})


def _joined(row: Mapping[str, Any]) -> Row:
    """A mapping; `x`, `y`, `z` become one position, `dx`, `dy`, `dz` or the like one direction,
    unless it has torques or angles: a wrench is for others to read."""
    joined = {**row}
    short = {str(key).lower().strip().replace("_", ""): value for key, value in row.items()}
    if any(axis_of(key) in ("Tx", "Ty", "Tz") for key in short):
        return joined
    for what, starts in (
        ("position", ("", "p", "pos")),
        ("direction", ("d", "a", "n", "u", "dir", "f")),
    ):
        for start in starts:
            if {f"{start}x", f"{start}y"} <= set(short):
                joined.setdefault(what, [short.get(f"{start}{axis}", 0.0) for axis in "xyz"])
    return joined


def _short(value: Any) -> bool:
    """Whether a value may be a vector of one thruster."""
    return isinstance(value, Mapping | str) or (
        isinstance(value, list)
        and len(value) < 6
        and not any(isinstance(each, list) for each in value)
    )


def _points(row: Row) -> bool:
    """Whether a mapping says where its thruster points; an error where that may be angles as
    well."""
    points = any(
        _short(lookup(row, words, TURNS)[1]) for words in (labels.DIRECTION, labels.ANGLES)
    )
    key, value, _ = lookup(row, labels.UNCLEAR)
    if key and not points and _short(value) and lookup(row, labels.POSITION, LENGTHS)[0]:
        raise LayoutError(
            "may be a direction, or roll, pitch and yaw; call it `direction`, or `rpy` in radians",
            key,
        )
    return points


def _lists(node: Node, exchange: Exchange) -> dict[str, Row]:
    """The thrusters of a mapping that holds the places of all, and all directions, as lists."""
    value = node.value if isinstance(node.value, Mapping) else {}
    place_key, places, size = lookup(value, labels.POSITION, LENGTHS)
    key, directions, _ = lookup(value, labels.DIRECTION)
    axes = numbers_in(directions)
    at = numbers_in(places)
    if axes is None or at is None or axes.size < 6 or axes.size % 3 or axes.ndim > 2:
        return {}
    n = axes.size // 3
    what = f"{node.words}.{key}"
    names, count = (lookup(value, words)[1] for words in (labels.NAMES, labels.COUNT))
    if at.size != axes.size:
        raise LayoutError(
            f"holds {at.size} numbers, and {key} {axes.size}", f"{node.words}.{place_key}"
        )
    if axes.ndim == 1 and n != (len(names) if isinstance(names, list) else count):
        raise LayoutError(
            f"holds {axes.size} numbers without a shape; write a list of 3 for each, or count: {n}",
            what,
        )
    by_row = axes.shape == (n, 3)
    if axes.ndim == 1 or n == 3:
        fit = [is_unit(axes.reshape(n, 3).T), is_unit(axes.reshape(3, n))]
        if fit[0] == fit[1] and not exchange.rows:
            raise LayoutError(
                "may stand thruster by thruster, or all x before all y; say --rows thrusters or "
                "--rows axes",
                what,
            )
        by_row = exchange.rows == "thrusters" if exchange.rows else fit[0]
        exchange.note(
            f"{what} is read {'thruster by thruster' if by_row else 'all x, all y, all z'}."
        )
    axes, at = (
        each.reshape(n, 3) if by_row else each.reshape(3, n).T for each in (axes, at * size)
    )
    rows = zip(_names(node, n), at.tolist(), axes.tolist(), strict=True)
    return {name: {"position": place, "direction": axis} for name, place, axis in rows}


def is_allocation(node: Node) -> bool:
    """Whether a node's key is that of an allocation matrix."""
    around = [
        re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", key[:100]) for key in ("", *node.path[-3:])
    ]
    words = {word.lower() for word in around[-1]}
    known = bool(words & WORDS) or ("matrix" in words and words <= {*NEAR.split()})
    return known and not {word.lower() for each in around for word in each} & {*OTHER.split()}


def _wrenches(node: Node, exchange: Exchange, table: bool) -> Found | None:
    """Thrusters by their wrenches: a mapping for each, or a matrix whose key or rows say that it is
    one."""
    value = node.value
    sure = is_allocation(node)
    names = list[str]()
    held = _held(value)
    if held and len(held) == len(value):
        return _of_records(node, held)
    if isinstance(value, Mapping):
        rows = {
            axis: row
            for key, row in value.items()
            if (axis := axis_of(key)) and isinstance(row, list)
        }
        if len(rows) > 1 and (sure or len({plain(key) for key in value} & CLEAR) > 1):
            matrix = _array([*rows.values()], node)
            named = {name: Row() for name in _names(node, matrix.shape[1])}
            return Found(node, named, tuple(rows), matrix, "by its labels")
        if sure and isinstance(flat := lookup(value, "data")[1], list):
            value = flat
        elif len(value) > 1 and all(isinstance(row, list) for row in value.values()):
            names = [*map(str, value)]
            value = [*value.values()]
    if not sure or not isinstance(value, list) or not value:
        return None
    array = _array(value, node) if isinstance(value[0], list) else numbers_in(value)
    if array is None:
        return None
    array = array if isinstance(value[0], list) else _unfolded(array, node)
    return _of_array(array, names, node, exchange, table)


def _array(rows: Sequence[Any], node: Node) -> Array:
    array = numbers_in(rows)
    if array is None or array.ndim != 2:
        raise LayoutError(
            "is no matrix: its rows differ in length, or hold what is no number", node.words
        )
    return array


def _of_records(node: Node, rows: Mapping[str, Mapping[str, Any]]) -> Found | None:
    keyed = [
        {axis: key for key in row if (axis := axis_of(key)) and np.ndim(row[key]) == 0}
        for row in rows.values()
    ]
    first = keyed[0]
    if len(first) < 2 or not set(first) & {"Fx", "Fy", "Fz"}:
        return None
    keys = {plain(key) for key in first.values()}
    if {"x", "y"} <= keys and not keys & (CLEAR | {"k", "m", "n"}):
        raise LayoutError(
            f"has {', '.join(map(str, first.values()))} of each thruster, which may be its "
            "wrench, or its "
            "place and angles; call them Fx to Tz, or x, y, z and dx, dy, dz",
            node.words,
        )
    pairs = zip(rows.values(), keyed, strict=True)
    columns = numbers_in([[row.get(own.get(axis, "")) for axis in first] for row, own in pairs])
    if columns is None or any(set(own) != set(first) for own in keyed):
        raise LayoutError(f"expected numbers {', '.join(first)} of each thruster", node.words)
    named = {key: {**row} for key, row in rows.items()}
    return Found(node, named, tuple(first), columns.T, "a row per thruster")


def _names(node: Node, n: int) -> list[str]:
    """Names of a matrix's thrusters from the nearest mapping around it that has some."""
    for _, scope in node.scopes:
        key, names, _ = lookup(scope, labels.NAMES)
        if isinstance(names, list) and all(isinstance(each, str | int) for each in names):
            if len({*map(str, names)}) != n or len(names) != n:
                raise LayoutError(f"holds {len(names)} names, expected {n}, each another one", key)
            return [*map(str, names)]
    return [f"thruster{i + 1}" for i in range(n)]


def _unfolded(array: Array, node: Node) -> Array:
    """A matrix in one list, row by row, of as many columns as there are names, or as is said."""
    for _, scope in node.scopes:
        names, n, rows = (
            lookup(scope, words)[1]
            for words in (labels.NAMES, f"cols columns {labels.COUNT}", "rows")
        )
        n = len(names) if isinstance(names, list) else n
        fits = isinstance(n, int) and n > 0 and array.size % n == 0
        if fits and (rows is None or isinstance(rows, list) or rows == array.size // n):
            return array.reshape(-1, n)
    shapes = ", ".join(f"{k} rows of {array.size // k}" for k in range(2, 7) if array.size % k == 0)
    raise LayoutError(
        f"is {array.size} numbers in one list, which may be {shapes or 'of any shape'}; write a "
        "list "
        "per axis, or the names of the thrusters beside it",
        node.words,
    )


def _of_array(array: Array, names: list[str], node: Node, exchange: Exchange, table: bool) -> Found:
    """A matrix whose rows have no labels of their own; keys beside it may name the axes."""
    said = next(
        (value for _, scope in node.scopes if (value := lookup(scope, labels.ROWS_OF)[1])), None
    )
    axes = (
        tuple(axis for each in said if (axis := axis_of(each))) if isinstance(said, list) else AXES
    )
    if isinstance(said, list) and len({*axes}) < len(said):
        raise LayoutError(f"names its rows {said!r:.80}, expected such as Fx, Fy, Tz", node.words)
    by_axes = len(array) == len(axes) and not names
    across = array.shape[1] == len(axes)
    if not by_axes and not across:
        raise LayoutError(
            f"is {len(array)} rows of {array.shape[1]} numbers, expected six rows, or beside them "
            "`axes` with a name for each (Fx, Fy, Tz), or rows with labels",
            node.words,
        )
    if names or exchange.rows or len(axes) < 6:
        across = across and (not by_axes or exchange.rows == "thrusters")
    elif across:
        unit = by_axes and (is_unit(array[:3]) or not table), is_unit(array[:, :3].T)
        if unit[0] == unit[1] and (table or not by_axes):
            raise LayoutError(
                f"is {len(array)} rows of 6 numbers without labels, which may be axes, a row per "
                "thruster "
                "(--rows axes, --rows thrusters), or the inverse; label them Fx, Fy, Fz, Tx, Ty, "
                "Tz",
                node.words,
            )
        across = unit[1] and not unit[0]
    matrix, kind = (array.T, "thrusters") if across else (array, "axes")
    names = names or _names(node, matrix.shape[1])
    order = f"its rows taken for {kind}, in the order {', '.join(axes)}"
    return Found(node, {name: {} for name in names}, axes, matrix, order)


def is_unit(forces: Array) -> bool:
    """Whether columns (3, n) have length 1."""
    return bool((np.abs(np.linalg.norm(forces, axis=0) - 1.0) < UNIT).all())
