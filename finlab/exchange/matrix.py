"""Allocation matrices: the wrench of each thruster per unit of its command, from plain values and to text."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.labels import axis_of, lookup, plain
from finlab.exchange.limits import Ends, limits_in
from finlab.exchange.walk import Node, nodes, numbers_in
from finlab.files.plain_values import yaml_text
from finlab.layout import Layout, own_effectiveness
from finlab.layout.wrench_axes import AXES, Axis

UNIT = 0.05
"""A column whose force is this close to 1 holds the wrench per newton."""
WORDS = "tam tcm allocation allocator alloc mixer mixing mix effectiveness"
"""Words of a key that holds an allocation matrix."""
BESIDE = "matrix thruster thrusters thrust force forces b t configuration config control motor motors"
"""Words that may stand beside `matrix` in such a key."""
OTHER = "mass inertia damping drag added coriolis covariance weight weights gain gains rotation "
OTHER += "inverse inv pinv pseudo pseudoinverse"
"""Words of a key that holds another matrix."""
CLEAR = {"fx", "fy", "fz", "tx", "ty", "tz", "mx", "my", "mz"}
"""Labels that are those of a wrench under any key."""


class Matrix(NamedTuple):
    """A matrix in plain values."""

    node: Node
    rows: dict[Axis, Array]
    """Each axis that it holds, a number per thruster."""
    names: list[str]
    """Names of the thrusters in it; none where it has none."""
    order: str
    """How it was read, as a note says it."""
    ends: list[Ends | None] | None = None
    """Limits of the commands that stand in its rows."""
    left: str = ""
    """Keys of its rows that were not read."""


def matrices(data: Any, exchange: Exchange, table: bool) -> list[Matrix]:
    """Returns all allocation matrices in plain values, or in a `table` whose six rows nothing names.

    Raises:
        LayoutError: the rows of one are not clear.
    """
    return [matrix for node in nodes(data) if (matrix := _matrix(node, exchange, table)) is not None]


def key_words(key: str) -> set[str]:
    """Returns the words of a key, `thruster_matrix` or `thrusterMatrix`."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", key[:100])}


def is_allocation(node: Node) -> bool:
    """Whether a node's key is that of an allocation matrix."""
    words = key_words(node.key)
    around = {word for key in node.path[-3:] for word in key_words(key)}
    if not node.path or node.path[-1].startswith("["):
        return False
    known = bool(words & {*WORDS.split()}) or ("matrix" in words and words <= {*BESIDE.split()})
    return known and not around & {*OTHER.split()}


def _matrix(node: Node, exchange: Exchange, table: bool) -> Matrix | None:
    value, sure, names = node.value, is_allocation(node), []
    if isinstance(value, Mapping):
        labelled = {
            axis: row for key, row in value.items() if (axis := axis_of(key)) and isinstance(row, list)
        }
        if len(labelled) > 1 and (sure or len({plain(key) for key in value} & CLEAR) > 1):
            return _labelled(node, labelled)
        if value and all(isinstance(row, Mapping) for row in value.values()):
            return _of_records(node, {str(key): row for key, row in value.items()}, exchange)
        if not sure or not value:
            return None
        flat = lookup(value, "data")[1]
        if isinstance(flat, list):
            shape = [lookup(value, words)[1] for words in ("rows", "cols columns")]
            value = _shaped(flat, shape[0], shape[1], node)
        elif len(value) > 1 and all(isinstance(row, list) for row in value.values()):
            names, value = [*map(str, value)], [*value.values()]
        else:
            return None
    if isinstance(value, list) and value and all(isinstance(row, Mapping) for row in value):
        return _of_records(node, {f"thruster{i}": row for i, row in enumerate(value, 1)}, exchange)
    if not sure or not isinstance(value, list) or not value:
        return None
    array = numbers_in(value)
    if array is None and isinstance(value[0], list):
        raise LayoutError("is no matrix: its rows differ in length, or hold what is no number", node.words)
    if array is None or array.ndim > 2:
        return None
    if array.ndim == 1:
        array = _unfolded(array, node)
    return _of_array(array, names, node, exchange, table)


def _labelled(node: Node, labelled: Mapping[Axis, Any]) -> Matrix:
    """A matrix of a row for each axis."""
    rows: dict[Axis, Array] = {}
    for axis, row in labelled.items():
        array = numbers_in(row)
        if array is None or array.ndim != 1:
            raise LayoutError(f"row {axis} is {row!r:.60}, expected numbers alone", node.words)
        rows[axis] = array
    lengths = {len(row) for row in rows.values()}
    if len(lengths) > 1:
        counts = ", ".join(f"{axis} {len(row)}" for axis, row in rows.items())
        raise LayoutError(f"its rows differ in length: {counts}", node.words)
    return Matrix(node, rows, [], "by its labels")


def _of_records(node: Node, rows: Mapping[str, Mapping[str, Any]], exchange: Exchange) -> Matrix | None:
    """A matrix of a mapping for each thruster, by name, that holds its wrench."""
    held = [
        {axis: key for key in row if (axis := axis_of(key)) and np.ndim(row[key]) == 0}
        for row in rows.values()
    ]
    first = held[0]
    if len(first) < 2 or not set(first) & {"Fx", "Fy", "Fz"}:
        return None
    keys = {plain(key) for key in first.values()}
    if {"x", "y"} <= keys and not keys & (CLEAR | {"k", "m", "n"}):
        raise LayoutError(
            f"has {', '.join(map(str, first.values()))} of each thruster, which may be its wrench, or its "
            "place and angles; call them Fx to Tz, or x, y, z and dx, dy, dz",
            node.words,
        )
    columns = []
    for (name, row), own in zip(rows.items(), held, strict=True):
        column = numbers_in([row[key] for key in own.values()])
        if set(own) != set(first) or column is None:
            raise LayoutError(
                f"expected numbers {', '.join(first)}, as of the others", f"{node.words}.{name}"
            )
        columns.append([row[own[axis]] for axis in first])
    named = [str(lookup(row, labels.NAME)[1] or name) for name, row in rows.items()]
    ends = [limits_in(row, 1, exchange)[0] for row in rows.values()]
    wrenches = dict(zip(first, np.array(columns, np.float64).T, strict=True))
    return Matrix(node, wrenches, named, "a row per thruster", ends, labels.unknown_in(rows.values()))


def _shaped(flat: list[Any], rows: Any, columns: Any, node: Node) -> Any:
    """Numbers in one list with their shape, row by row."""
    array = numbers_in(flat)
    if array is None or not isinstance(rows, int) or array.shape != (rows * (columns or 0) or -1,):
        raise LayoutError(
            f"rows {rows} and cols {columns} do not fit {len(flat)} numbers of data", node.words
        )
    return array.reshape(rows, -1).tolist()


def _unfolded(array: Array, node: Node) -> Array:
    """A matrix in one list, row by row, of as many columns as there are names."""
    for _, scope in node.scopes:
        names, count = (lookup(scope, words)[1] for words in (labels.NAMES, labels.COUNT))
        n = len(names) if isinstance(names, list) else count
        if isinstance(n, int) and n > 0 and array.size % n == 0:
            return array.reshape(-1, n)
    shapes = ", ".join(f"{k} rows of {array.size // k}" for k in range(2, 7) if array.size % k == 0)
    raise LayoutError(
        f"is {array.size} numbers in one list, which may be {shapes or 'of any shape'}; write a list "
        "per axis, or the names of the thrusters beside it",
        node.words,
    )


def _of_array(array: Array, names: list[str], node: Node, exchange: Exchange, table: bool) -> Matrix:
    """A matrix whose rows have no labels of their own; keys beside it may name the axes."""
    said = next((value for _, scope in node.scopes if (value := lookup(scope, labels.ROWS_OF)[1])), None)
    axes = [axis_of(each) for each in said] if isinstance(said, list) else [*AXES]
    known = [axis for axis in axes if axis is not None]
    if len(set(known)) < len(axes):
        raise LayoutError(f"names its rows {said!r:.80}, expected such as Fx, Fy, Tz", node.words)
    by_axes, by_thrusters = len(array) == len(axes), array.shape[1] == len(axes)
    if not by_axes and not by_thrusters:
        raise LayoutError(
            f"is {len(array)} rows of {array.shape[1]} numbers, expected six rows, or beside them "
            "`axes` with a name for each (Fx, Fy, Tz), or rows with labels",
            node.words,
        )
    if by_axes and by_thrusters and not names and exchange.rows is None and table:
        by_axes, by_thrusters = _unit(array[:3]), _unit(array[:, :3].T)
        if by_axes == by_thrusters:
            raise LayoutError(
                f"is {len(array)} rows without labels, which may be axes or thrusters, or the inverse; label "
                "them Fx, Fy, Fz, Tx, Ty, Tz, or say --rows axes or --rows thrusters"
            )
    across = bool(names) or (exchange.rows == "thrusters" if by_axes and by_thrusters else by_thrusters)
    if across and not names and exchange.rows is None and len(axes) == 6 and not _unit(array[:, :3].T):
        raise LayoutError(
            f"is {len(array)} rows of 6 numbers without labels: a row per thruster (say --rows thrusters), "
            "or the inverse of the matrix, which is not read",
            node.words,
        )
    kind = "thrusters" if across else "axes"
    rows = dict(zip(known, array.T if across else array, strict=True))
    return Matrix(node, rows, names, f"its rows taken for {kind}, in the order {', '.join(known)}")


def _unit(forces: Array) -> bool:
    """Whether columns (3, n) have length 1."""
    return bool((np.abs(np.linalg.norm(forces, axis=0) - 1.0) < UNIT).all())


def write_matrix(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the matrix of a layout's thrusters per newton, as CSV for `.csv`, else as YAML.

    Raises:
        LayoutError: there is no thruster.
    """
    kept = exchange.thrusters_of(layout, "A matrix", "places along the lines of the forces")
    rows = own_effectiveness(kept)[:, 0].T * (TO_FRD if exchange.frame == "FRD" else 1.0) + 0.0
    names, limits = list(kept.names), np.stack([kept.lower, kept.upper], axis=1)[..., 0].tolist()
    matrix = dict(zip(AXES, rows.tolist(), strict=True))
    if suffix != ".csv":
        told = {"frame": exchange.frame or "FLU", "unit": "N", "names": names, "limits": limits}
        return yaml_text({**told, "matrix": matrix})
    table = {"axis": names, **matrix, **dict(zip(("least", "most"), zip(*limits, strict=True), strict=True))}
    lines = [",".join(map(str, [key, *row])) for key, row in table.items()]
    return "\n".join([f"# frame: {exchange.frame or 'FLU'}", *lines]) + "\n"
