"""Finds the thrusters in plain values: by position and direction, or by wrench.

Files of others name things as they like, so every mapping and list is looked at as a candidate;
exactly one of them must be thrusters. `plain_robot` makes a layout of what is found.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES, Axis
from finlab.errors import LayoutError, layout_errors_at
from finlab.exchange import labels, poses
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import Node, axis_of, listed, lookup, nodes, numbers_in, plain
from finlab.exchange.poses import UNIT_TOLERANCE, Record
from finlab.exchange.questions import QuestionError, which_rows
from finlab.files.csv_table import LENGTHS

ALLOCATION_WORDS = {
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
MATRIX_WORDS = {
    *("matrix", "thruster", "thrusters", "thrust", "force", "forces", "b", "t"),
    *("configuration", "config", "control", "motor", "motors"),
}
"""A key that holds `matrix` and no other words than these names an allocation matrix, too."""
THRUSTER_WORDS = {"thruster", "thrusters", "motor", "motors", "propeller", "propellers"}
"""Words of a key that names thrusters, where other devices have places and directions, too."""
OTHER_MATRIX_WORDS = {
    *("mass", "inertia", "damping", "drag", "added", "coriolis", "covariance", "weight"),
    *("weights", "gain", "gains", "rotation", "inverse", "inv", "pinv", "pseudo", "pseudoinverse"),
}
"""Words of a key, or of one around it, that holds another matrix."""
WRENCH_LABELS = {"fx", "fy", "fz", "tx", "ty", "tz", "mx", "my", "mz"}
"""Labels that are those of a wrench under any key; `x` or `roll` are so in a matrix alone."""


class ThrusterRecords(NamedTuple):
    """The thrusters of a file, by position and direction or by wrench."""

    node: Node
    """Where they stand in the file."""
    records: dict[str, Record]
    """Each thruster by its name, or by its index such as `[2]`."""
    axes: tuple[Axis, ...] = ()
    """Axes of the rows of `columns`; empty for thrusters by position and direction."""
    columns: Array = np.zeros((0, 0))
    """Wrenches per command (axes, n) [N, N m]."""
    order: str = ""
    """How a note says that the rows of the matrix were read."""


def find_thrusters(data: Any, exchange: Exchange, is_table: bool) -> ThrusterRecords:
    """Returns the thrusters in plain values.

    Positions and directions go before a matrix, since they say more.

    Args:
        data: the plain values.
        exchange: how to read rows that may be read in two ways; gets the notes.
        is_table: whether they come from a table, where nothing names a matrix of six rows.

    Raises:
        LayoutError: there are none, or several, or they may be read in two ways.
    """
    by_position = _candidates(data, lambda node: _by_position(node, exchange))
    candidates = by_position or _candidates(data, lambda node: _by_wrench(node, exchange, is_table))
    named = [candidate for candidate in candidates if names_thrusters(candidate.node)]
    if len(candidates) > 1 and len(named) == 1:
        others = [candidate.node.words for candidate in candidates if candidate is not named[0]]
        exchange.note(
            f"Places beside those of {named[0].node.words} are left out: {listed(others)}."
        )
        candidates = named
    if len(candidates) == 1:
        return candidates[0]
    if len(candidates) > 1:
        what = "thrusters by place and direction" if by_position else "a matrix"
        keys = ", ".join(candidate.node.words for candidate in candidates[:6])
        raise LayoutError(f"holds {what} more than once, at {keys}; leave one in the file")
    lists = _number_lists(data)
    hint = ""
    if lists:
        shown = ", ".join(lists[:8])
        hint = f"; its lists of numbers, {shown}, have no key that says so"
    raise LayoutError(
        "has no matrix, expected six rows of numbers (Fx, Fy, Fz, Tx, Ty, Tz) under a key such as "
        f"`tam` or `allocation_matrix`, or a position and a direction of each thruster{hint}"
    )


def names_thrusters(node: Node) -> bool:
    """Whether a node's own key says that thrusters stand there."""
    return bool({plain(word) for word in re.split(r"[^A-Za-z]+", node.key[:100])} & THRUSTER_WORDS)


def _candidates(data: Any, read: Callable[[Node], ThrusterRecords | None]) -> list[ThrusterRecords]:
    """What a reader makes of all nodes, without those that hold no thrusters."""
    results = [read(node) for node in nodes(data)]
    return [result for result in results if result is not None]


def _number_lists(data: Any) -> list[str]:
    """Lists of at least six numbers with their shapes, for the error."""
    lists = []
    for node in nodes(data):
        array = numbers_in(node.value) if node.path else None
        if array is not None and array.size > 5:
            lists.append(f"{node.words} {array.shape}")
    return lists


def _records_below(value: Any) -> dict[str, Mapping[str, Any]]:
    """The mappings right below a mapping or list, by their keys or indices."""
    if isinstance(value, list):
        value = {f"[{i}]": item for i, item in enumerate(value)}
    if not isinstance(value, Mapping):
        return {}
    return {str(key): item for key, item in value.items() if isinstance(item, Mapping)}


def _by_position(node: Node, exchange: Exchange) -> ThrusterRecords | None:
    """Thrusters by position and direction: mappings below a node, or lists of all in one."""
    if labels.names_other_device(node.path):
        return None
    records = {}
    for key, record in _records_below(node.value).items():
        if not labels.names_other_device((key,)) and not labels.is_key_of(key, poses.POSE):
            with layout_errors_at(f"{node.words}.{key}"):
                records[key] = poses.split(record)
    poses.name_unit_orientations(records.values(), exchange)
    has_position = {key: poses.has_position(record) for key, record in records.items()}
    has_direction = {key: poses.has_direction(record) for key, record in records.items()}
    if not any(has_position[key] and has_direction[key] for key in records):
        in_lists = _from_lists(node, exchange)
        return ThrusterRecords(node, in_lists) if in_lists else None
    for key in records:
        if has_position[key] != has_direction[key]:
            lacks = "direction" if has_position[key] else "position"
            raise LayoutError(
                f"has no {lacks}, and others beside it have one", f"{node.words}.{key}"
            )
    thrusters = {key: record for key, record in records.items() if has_position[key]}
    if len(thrusters) == 1:
        _check_symmetry(node, *thrusters)
    return ThrusterRecords(node, thrusters)


def _check_symmetry(node: Node, only: str) -> None:
    """Raises a LayoutError where one thruster has a place, and several beside it have a name
    alone: they follow from it by a symmetry that the program knows."""
    siblings = node.value.items() if isinstance(node.value, Mapping) else ()
    for key, value in siblings:
        is_list = isinstance(value, Mapping | list) and len(value) > 1 and not _records_below(value)
        if key != only and is_list and names_thrusters(Node((str(key),), value, ())):
            raise LayoutError(
                f"has a place and a direction of {only} alone, and {len(value)} {key} beside it, "
                "which follow from it by a symmetry; write the place and direction of each",
                node.words,
            )


def _from_lists(node: Node, exchange: Exchange) -> dict[str, Record]:
    """The thrusters of a mapping that holds all positions in one list and all directions in
    another; empty where it does not."""
    value = node.value if isinstance(node.value, Mapping) else {}
    position_key, position_value, meters, names_unit = lookup(value, labels.POSITION, LENGTHS)
    direction_key, direction_value, *_ = lookup(value, labels.DIRECTION)
    positions = numbers_in(position_value)
    axes = numbers_in(direction_value)
    if axes is None or positions is None:
        return {}
    if axes.size < 6 or axes.size % 3 or axes.ndim > 2:
        return {}
    n = axes.size // 3
    where = f"{node.words}.{direction_key}"
    if positions.size != axes.size:
        raise LayoutError(
            f"holds {positions.size} numbers, and {direction_key} {axes.size}",
            f"{node.words}.{position_key}",
        )
    names = lookup(value, labels.NAMES).value
    count = lookup(value, labels.COUNT).value
    if axes.ndim == 1 and n != (len(names) if isinstance(names, list) else count):
        raise LayoutError(
            f"holds {axes.size} numbers without a shape; write a list of 3 for each, or count: {n}",
            where,
        )
    by_thruster = axes.shape == (n, 3)
    if axes.ndim == 1 or n == 3:
        # Both orders have the right shape: directions of length 1 tell which it is.
        unit_by_thruster = is_unit(axes.reshape(n, 3).T)
        unit_by_axis = is_unit(axes.reshape(3, n))
        if unit_by_thruster == unit_by_axis and not exchange.rows:
            why = "may stand thruster by thruster, or all x before all y"
            raise QuestionError(
                f"{why}; say --rows thrusters or --rows axes",
                where,
                questions=(which_rows(f"Numbers of {where} {why}."),),
            )
        by_thruster = exchange.rows == "thrusters" if exchange.rows else unit_by_thruster
        order = "thruster by thruster" if by_thruster else "all x, all y, all z"
        exchange.note(f"{where} is read {order}.")
    positions = positions * meters
    if by_thruster:
        positions = positions.reshape(n, 3)
        axes = axes.reshape(n, 3)
    else:
        positions = positions.reshape(3, n).T
        axes = axes.reshape(3, n).T
    key_of_position = "position_m" if names_unit else "position"
    return {
        name: {key_of_position: position, "direction": axis}
        for name, position, axis in zip(
            _names(node, n), positions.tolist(), axes.tolist(), strict=True
        )
    }


def is_allocation(node: Node) -> bool:
    """Whether a node's key names an allocation matrix, and none of the keys around another."""
    words_of_keys = [
        {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", key[:100])}
        for key in ("", *node.path[-3:])
    ]
    words = words_of_keys[-1]
    if not words & ALLOCATION_WORDS and not ("matrix" in words and words <= MATRIX_WORDS):
        return False
    return not set.union(*words_of_keys) & OTHER_MATRIX_WORDS


def _by_wrench(node: Node, exchange: Exchange, is_table: bool) -> ThrusterRecords | None:
    """Thrusters by their wrenches: a mapping for each, or a matrix whose key or rows say that it is
    one."""
    value = node.value
    is_named_allocation = is_allocation(node)
    names: list[str] = []
    records = _records_below(value)
    if records and len(records) == len(value):
        return _of_wrench_records(node, records)
    if isinstance(value, Mapping):
        rows: dict[Axis, list[Any]] = {}
        for key, row in value.items():
            axis = axis_of(key)
            if axis and isinstance(row, list):
                rows[axis] = row
        n_wrench_labels = len({plain(key) for key in value} & WRENCH_LABELS)
        if len(rows) > 1 and (is_named_allocation or n_wrench_labels > 1):
            matrix = _matrix([*rows.values()], node)
            unnamed = {name: Record() for name in _names(node, matrix.shape[1])}
            return ThrusterRecords(node, unnamed, tuple(rows), matrix, "by its labels")
        flat = lookup(value, "data").value
        if is_named_allocation and isinstance(flat, list):
            value = flat
        elif len(value) > 1 and all(isinstance(row, list) for row in value.values()):
            names = [*map(str, value)]
            value = [*value.values()]
    if not is_named_allocation or not isinstance(value, list) or not value:
        return None
    if isinstance(value[0], list):
        array = _matrix(value, node)
    else:
        numbers = numbers_in(value)
        if numbers is None:
            return None
        array = _reshape(numbers, node)
    return _of_matrix(array, names, node, exchange, is_table)


def _matrix(rows: Sequence[Any], node: Node) -> Array:
    """Rows as an array of two dimensions; an error where they are none."""
    array = numbers_in(rows)
    if array is None or array.ndim != 2:
        raise LayoutError(
            "is no matrix: its rows differ in length, or hold what is no number", node.words
        )
    return array


def _of_wrench_records(
    node: Node, records: Mapping[str, Mapping[str, Any]]
) -> ThrusterRecords | None:
    """Thrusters with a mapping of each wrench by axes; None where the mappings are no wrenches."""
    if labels.names_other_device(node.path):
        return None
    keys_by_axis = [_axis_keys(record) for record in records.values()]
    axes = tuple(keys_by_axis[0])
    if len(axes) < 2 or not set(axes) & {"Fx", "Fy", "Fz"}:
        return None
    keys = keys_by_axis[0].values()
    words = {plain(key) for key in keys}
    if {"x", "y"} <= words and not words & (WRENCH_LABELS | {"k", "m", "n"}):
        raise LayoutError(
            f"has {', '.join(map(str, keys))} of each thruster, which may be its wrench, or its "
            "place and angles; call them Fx to Tz, or x, y, z and dx, dy, dz",
            node.words,
        )
    rows = []
    for record, key_of_axis in zip(records.values(), keys_by_axis, strict=True):
        rows.append([record.get(key_of_axis.get(axis, "")) for axis in axes])
    wrenches = numbers_in(rows)
    if wrenches is None or any(set(key_of_axis) != set(axes) for key_of_axis in keys_by_axis):
        raise LayoutError(f"expected numbers {', '.join(axes)} of each thruster", node.words)
    copies = {key: {**record} for key, record in records.items()}
    return ThrusterRecords(node, copies, axes, wrenches.T, "a row per thruster")


def _axis_keys(record: Mapping[str, Any]) -> dict[Axis, str]:
    """The keys of a record that hold one number for an axis, by that axis."""
    keys: dict[Axis, str] = {}
    for key, value in record.items():
        axis = axis_of(key)
        if axis and np.ndim(value) == 0:
            keys[axis] = key
    return keys


def _names(node: Node, n: int) -> list[str]:
    """Names of a matrix's thrusters from the nearest mapping around it that has some."""
    for _, scope in node.scopes:
        key, names, *_ = lookup(scope, labels.NAMES)
        if isinstance(names, list) and all(isinstance(name, str | int) for name in names):
            if len({*map(str, names)}) != n or len(names) != n:
                raise LayoutError(f"holds {len(names)} names, expected {n}, each another one", key)
            return [*map(str, names)]
    return [f"thruster{i + 1}" for i in range(n)]


def _reshape(numbers: Array, node: Node) -> Array:
    """A matrix from one list of its numbers, row by row; keys around it say how many columns."""
    for _, scope in node.scopes:
        names = lookup(scope, labels.NAMES).value
        rows = lookup(scope, "rows").value
        columns = lookup(scope, f"cols columns {labels.COUNT}").value
        n = len(names) if isinstance(names, list) else columns
        fits = isinstance(n, int) and n > 0 and numbers.size % n == 0
        if fits and (rows is None or isinstance(rows, list) or rows == numbers.size // n):
            return numbers.reshape(-1, n)
    shapes = ", ".join(
        f"{rows} rows of {numbers.size // rows}" for rows in range(2, 7) if numbers.size % rows == 0
    )
    raise LayoutError(
        f"is {numbers.size} numbers in one list, which may be {shapes or 'of any shape'}; write a "
        "list per axis, or the names of the thrusters beside it",
        node.words,
    )


def _of_matrix(
    array: Array, names: list[str], node: Node, exchange: Exchange, is_table: bool
) -> ThrusterRecords:
    """Thrusters of a matrix whose rows have no labels of axes; keys around it may name the axes.

    Args:
        array: the matrix as the file has it.
        names: labels of its rows that are thrusters; empty where they have none.
        node: where it stands in the file.
        exchange: what the rows are where that is unclear.
        is_table: whether nothing but its shape says what it is.
    """
    axes = _axes_of_rows(node)
    may_be_axes = len(array) == len(axes) and not names
    may_be_thrusters = array.shape[1] == len(axes)
    if not may_be_axes and not may_be_thrusters:
        raise LayoutError(
            f"is {len(array)} rows of {array.shape[1]} numbers, expected six rows, or beside them "
            "`axes` with a name for each (Fx, Fy, Tz), or rows with labels",
            node.words,
        )
    if names or exchange.rows or len(axes) < 6:
        by_thruster = may_be_thrusters and (not may_be_axes or exchange.rows == "thrusters")
    elif may_be_thrusters:
        # A matrix per newton has forces of length 1, in its columns or in its rows.
        unit_columns = may_be_axes and (is_unit(array[:3]) or not is_table)
        unit_rows = is_unit(array[:, :3].T)
        if unit_columns == unit_rows and (is_table or not may_be_axes):
            why = f"{len(array)} rows of 6 numbers have no labels, and may be either or an inverse."
            questions = (which_rows(why, may_be_axes),)
            raise QuestionError(
                f"is {len(array)} rows of 6 numbers without labels, which may be axes, a row per "
                "thruster (--rows axes, --rows thrusters), or the inverse; label them Fx, Fy, Fz, "
                "Tx, Ty, Tz",
                node.words,
                questions=questions,
            )
        by_thruster = unit_rows and not unit_columns
    else:
        by_thruster = False
    matrix = array.T if by_thruster else array
    names = names or _names(node, matrix.shape[1])
    kind = "thrusters" if by_thruster else "axes"
    order = f"its rows taken for {kind}, in the order {', '.join(axes)}"
    return ThrusterRecords(node, {name: {} for name in names}, axes, matrix, order)


def _axes_of_rows(node: Node) -> tuple[Axis, ...]:
    """The axes of a matrix's rows by the nearest key that names them; all six where none does."""
    stated: Any = None
    for _, scope in node.scopes:
        value = lookup(scope, labels.ROW_LABELS).value
        if value:
            stated = value
            break
    if not isinstance(stated, list):
        return AXES
    axes = tuple(axis for axis in map(axis_of, stated) if axis)
    if len({*axes}) < len(stated):
        raise LayoutError(f"names its rows {stated!r:.80}, expected such as Fx, Fy, Tz", node.words)
    return axes


def is_unit(forces: Array) -> bool:
    """Whether the columns of an array (3, n) have length 1."""
    return bool((np.abs(np.linalg.norm(forces, axis=0) - 1.0) < UNIT_TOLERANCE).all())
