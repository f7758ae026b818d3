"""Robots of thrusters in plain values, of YAML, JSON or a table: by places and directions, or by a matrix."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.labels import FRAMES, frame_said, lookup
from finlab.exchange.limits import Ends, limits_in
from finlab.exchange.matrix import UNIT, Matrix, matrices
from finlab.exchange.per_thruster import Row, lists_in, records_in, thruster_of
from finlab.exchange.walk import Node, Path, nodes, numbers_in, unread
from finlab.layout import MAX_ACTUATORS, Layout
from finlab.layout.wrench_axes import AXES

Comments = Sequence[str]


def read_plain(
    data: Any, name: str, exchange: Exchange, comments: Comments = (), table: bool = False
) -> Layout:
    """Returns the layout, called `name`, of the thrusters in plain values.

    Places and directions go before a matrix, since they tell more. `comments` of the file may name the frame;
    a `table` has rows that nothing but their labels names.

    Raises:
        LayoutError: neither is there, or several, or one that may be read in two ways.
    """
    placed = [(node, rows) for node in nodes(data) if (rows := records_in(node) or lists_in(node, exchange))]
    if placed:
        node = _only([node for node, _ in placed], "thrusters by place and direction")
        return _of_rows(node, placed[0][1], data, name, exchange, comments)
    held = matrices(data, exchange, table)
    if not held:
        raise LayoutError(_nothing(data))
    _only([matrix.node for matrix in held], "a matrix")
    return _of_matrix(held[0], data, name, exchange, comments)


def _only(found: list[Node], what: str) -> Node:
    if len(found) > 1:
        keys = ", ".join(node.words for node in found[:6])
        raise LayoutError(f"holds {what} more than once, at {keys}; leave one in the file")
    return found[0]


def _nothing(data: Any) -> str:
    """What a file holds in which nothing was found."""
    shaped = (
        (node, numbers_in(node.value)) for node in nodes(data) if isinstance(node.value, list) and node.path
    )
    lists = [f"{node.words} {array.shape}" for node, array in shaped if array is not None and array.size > 5]
    seen = f"; its lists of numbers, {', '.join(lists[:8])}, have no key that says so" if lists else ""
    return (
        "has no matrix, expected six rows of numbers (Fx, Fy, Fz, Tx, Ty, Tz) under a key such as `tam` or "
        f"`allocation_matrix`, or a position and a direction of each thruster{seen}"
    )


def _frd(node: Node, exchange: Exchange, comments: Comments) -> bool:
    """Whether the file is in x forward, y right, z down; the note says why."""
    frame, where = frame_said([scope for _, scope in node.scopes], comments)
    if exchange.frame and frame and exchange.frame != frame:
        exchange.note(f"It says {where}; --frame {exchange.frame} was taken in its stead.")
    elif exchange.frame is None and frame:
        exchange.note(f"Its frame is {FRAMES[frame]} ({where}).")
    elif exchange.frame is None:
        exchange.note(f"It names no frame: {FRAMES['FLU']} (FLU) is taken; --frame FRD for the other.")
    return (exchange.frame or frame) == "FRD"


def _of_rows(
    node: Node, rows: dict[str, Row], data: Any, name: str, exchange: Exchange, comments: Comments
) -> Layout:
    """The layout of thrusters by place and direction."""
    frd, center, used = _frd(node, exchange, comments), np.zeros(3), {node.path}
    for each in nodes(data) if exchange.origin == "gravity" else ():
        at = (
            numbers_in(each.value)
            if isinstance(each.value, list) and lookup({each.key: 0}, labels.CENTER)[0]
            else None
        )
        if at is not None and at.shape == (3,):
            center = at
            used.add(each.path)
            exchange.note(f"The origin is at {each.words}, {at[0]:g} {at[1]:g} {at[2]:g} m.")
    exchange.note(f"{node.words} was read: places in m, directions, limits in N.")
    if len(rows) > MAX_ACTUATORS:
        raise LayoutError(f"expected up to {MAX_ACTUATORS} thrusters, got {len(rows)}", node.words)
    shared = next((pair for _, scope in node.scopes[:2] if (pair := limits_in(scope, 1, exchange)[0])), None)
    parts = []
    for key, row in rows.items():
        own = row if shared is None or limits_in(row, 1, exchange)[0] else {**row, "limits": list(shared)}
        parts.append(thruster_of(key, own, frd, center, exchange))
    _say_unread(data, used, node, exchange, labels.unknown_in(rows.values()))
    return Layout(name, tuple(parts))


def _of_matrix(matrix: Matrix, data: Any, name: str, exchange: Exchange, comments: Comments) -> Layout:
    """The layout of the columns of a matrix."""
    node, n = matrix.node, len(next(iter(matrix.rows.values())))
    if n > MAX_ACTUATORS:
        raise LayoutError(f"expected up to {MAX_ACTUATORS} columns, got {n}")
    columns = np.stack([matrix.rows.get(axis, np.zeros(n)) for axis in AXES])
    unit = "N and N m" if _per_newton(columns) else "N and N m at a command of 1"
    exchange.note(f"{matrix.node.words} was read, {matrix.order}, in {unit}.")
    if _frd(node, exchange, comments):
        columns = columns * TO_FRD
    used = {matrix.node.path}
    names = matrix.names or _names(node, n, used)
    ends = matrix.ends or _ends(data, node, names, used, exchange)
    if not any(ends) and not _per_newton(columns):
        exchange.note("It has no limits: commands are taken to go from -1 to 1 (--force LEAST MOST).")
        ends = [(-1.0, 1.0)] * n
    missing = [axis for axis in AXES if axis not in matrix.rows]
    if missing:
        exchange.note(f"It has no row {', '.join(missing)}: 0 is taken there, and not commanded (`axes`).")
    _say_unread(data, used, node, exchange, matrix.left)
    parts = tuple(exchange.of_column(*each) for each in zip(names, columns.T, ends, strict=True))
    return Layout(name, parts, axes=tuple(axis for axis in AXES if axis in matrix.rows))


def _per_newton(columns: Array) -> bool:
    return bool((np.abs(np.linalg.norm(columns[:3], axis=0) - 1.0) <= UNIT).all())


def _names(node: Node, n: int, used: set[Path]) -> list[str]:
    """Names of a matrix's thrusters from the nearest mapping around it that has some."""
    for path, scope in node.scopes:
        key, names, _ = lookup(scope, labels.NAMES)
        if isinstance(names, list) and all(isinstance(each, str | int) for each in names):
            if len(names) != n:
                raise LayoutError(
                    f"expected a name, and least and most command, for each of {n} columns", key or "names"
                )
            used.add((*path, key))
            return [*map(str, names)]
    return [f"thruster{i + 1}" for i in range(n)]


def _ends(data: Any, node: Node, names: list[str], used: set[Path], exchange: Exchange) -> list[Ends | None]:
    """Limits of a matrix's thrusters: around it, or in any mapping that names one of them."""
    for _, scope in node.scopes[:2]:
        ends = limits_in(scope, len(names), exchange)
        if any(ends):
            return ends
    known: dict[str, Ends] = {}
    for each in nodes(data):
        if isinstance(each.value, Mapping):
            key, named, _ = lookup(each.value, labels.NAME)
            named = named if key else each.key
            pair = (
                limits_in(each.value, 1, exchange)[0] if isinstance(named, str) and named in names else None
            )
            if pair is not None:
                known[named] = pair
                used.add(each.path)
    without = [name for name in names if name not in known]
    if known and without:
        exchange.note(f"It has no limits of {', '.join(without)}.")
    return [known.get(name) for name in names]


def _say_unread(data: Any, used: set[Path], node: Node, exchange: Exchange, left: str) -> None:
    """A note on the keys that were not read."""
    around = [(path, scope, labels.FRAME_KEYS) for path, scope in node.scopes]
    around += [(path, scope, labels.LIMIT_KEYS) for path, scope in node.scopes[:2]]
    for path, scope, words in around:
        used |= {(*path, key) for key in scope if lookup({key: 0}, words, labels.FORCES)[0]}
    if left:
        exchange.note(f"Not read of each thruster: {left}.")
    keys = unread(data, used)
    if keys:
        exchange.note(f"Not read: {keys}.")
