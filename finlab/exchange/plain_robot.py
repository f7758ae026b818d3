"""Robots of thrusters in plain values, of YAML, JSON or a table, and matrices as text."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.labels import FRAMES, Path, frame_said, lookup, nodes, numbers_in, unread
from finlab.exchange.records import UNIT, Found, Row, found_in, is_unit
from finlab.files import yaml_text
from finlab.files.csv_table import FORCES, LENGTHS, TURNS
from finlab.layout import MAX_ACTUATORS, Layout, Thruster, own_effectiveness

Ends = tuple[float, float]
Parts = tuple[Thruster, ...]


def read_plain(
    data: Any, name: str, exchange: Exchange, comments: Sequence[str] = (), table: bool = False
) -> Layout:
    """Returns the layout, called `name`, of the thrusters in plain values.

    `comments` of the file may name the frame; a `table` has rows that nothing but their labels
    names. Raises LayoutError: none are there, or several times, or they may be read in two ways."""
    held = found_in(data, exchange, table)
    if len(held.rows) > MAX_ACTUATORS:
        what = "columns" if held.axes else "thrusters"
        raise LayoutError(
            f"expected up to {MAX_ACTUATORS} {what}, got {len(held.rows)}", held.node.words
        )
    frd = _frd(held, exchange, comments)
    used = {held.node.path}
    parts = (_of_matrix if held.axes else _of_places)(held, data, frd, used, exchange)
    for k, (path, scope) in enumerate(held.node.scopes):
        words = f"{labels.FRAME_KEYS} {labels.NAMES} {labels.LIMIT_KEYS if k < 2 else ''}"
        used |= {(*path, key) for key in scope if lookup({key: 0}, words, FORCES)[0]}
    if left := labels.unknown_in(held.rows.values()):
        exchange.note(f"Not read of each thruster: {left}.")
    if keys := unread(data, used):
        exchange.note(f"Not read: {keys}.")
    return Layout(
        name, parts, axes=tuple(axis for axis in AXES if axis in held.axes or not held.axes)
    )


def _frd(held: Found, exchange: Exchange, comments: Sequence[str]) -> bool:
    """Whether the file is in x forward, y right, z down; the note says why."""
    frame, where = frame_said([scope for _, scope in held.node.scopes], comments)
    if exchange.frame and frame and exchange.frame != frame:
        exchange.note(f"It says {where}; --frame {exchange.frame} was taken in its stead.")
    elif exchange.frame is None and frame:
        exchange.note(f"Its frame is {FRAMES[frame]} ({where}).")
    elif exchange.frame is None:
        exchange.note(
            f"It names no frame: {FRAMES['FLU']} (FLU) is taken; --frame FRD for the other."
        )
    return (exchange.frame or frame) == "FRD"


def _of_places(
    held: Found, data: Any, frd: bool, used: set[Path], exchange: Exchange
) -> tuple[Thruster, ...]:
    center = np.zeros(3)
    for each in nodes(data) if exchange.origin == "gravity" else ():
        at = numbers_in(each.value) if lookup({each.key: 0}, labels.CENTER)[0] else None
        if at is not None and at.shape == (3,):
            center = at
            used.add(each.path)
            exchange.note(f"The origin is at {each.words}, {at[0]:g} {at[1]:g} {at[2]:g} m.")
    exchange.note(f"{held.node.words} was read: places in m, directions, limits in N.")
    sign = TO_FRD[:3, 0] if frd else np.ones(3)
    parts = []
    for (key, row), ends in zip(held.rows.items(), _ends(held, data, used, exchange), strict=True):
        place_key, place, size = lookup(row, labels.POSITION, LENGTHS)
        at = _three(place, f"{key}.{place_key}") * size - center
        axis = _direction(key, row, exchange)
        parts.append(exchange.thruster(_name(key, row), at * sign, axis * sign, ends))
    return tuple(parts)


def _name(key: str, row: Row) -> str:
    """A thruster's name: its own, else its key, else its number."""
    name = str(lookup(row, labels.NAME)[1] or "").strip()
    key = f"thruster{int(key[1:-1]) + 1}" if key.startswith("[") else key
    return key if not name or name.isdecimal() else name


def _direction(key: str, row: Row, exchange: Exchange) -> Array:
    axis_key, value, _ = lookup(row, labels.DIRECTION)
    if axis_key:
        axis = _three(value, f"{key}.{axis_key}")
    else:
        axis_key, value, size = lookup(row, labels.ANGLES, TURNS)
        turn = _three(value, f"{key}.{axis_key}") * size
        if np.abs(turn).max() > 2 * np.pi:
            raise LayoutError(
                "is more than a turn; are these degrees? call it rpy_deg", f"{key}.{axis_key}"
            )
        exchange.note(f"{axis_key} turns the axis x of a thruster, along which it pushes.")
        axis = Rotation.from_euler("xyz", turn).apply([1.0, 0.0, 0.0])
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise LayoutError("has no length", f"{key}.{axis_key}")
    if abs(length - 1.0) > UNIT:
        exchange.note(f"{key}.{axis_key} has length {length:g}; its direction alone is read.")
    return axis / length


def _three(value: Any, what: str) -> Array:
    array = numbers_in([value.get(axis) for axis in "xyz"] if isinstance(value, Mapping) else value)
    if array is None or array.shape != (3,):
        raise LayoutError(f"is {value!r:.60}, expected three numbers", what)
    return array


def _of_matrix(
    held: Found, data: Any, frd: bool, used: set[Path], exchange: Exchange
) -> tuple[Thruster, ...]:
    columns = np.zeros((6, len(held.rows)))
    columns[[AXES.index(axis) for axis in held.axes]] = held.columns
    per_newton = is_unit(columns[:3])
    unit = "N and N m" if per_newton else "N and N m at a command of 1"
    exchange.note(f"{held.node.words} was read, {held.order}, in {unit}.")
    if missing := ", ".join(axis for axis in AXES if axis not in held.axes):
        exchange.note(f"It has no row {missing}: 0 is taken there, and not commanded (`axes`).")
    ends = _ends(held, data, used, exchange)
    if not any(ends) and not per_newton:
        exchange.note(
            "It has no limits: commands are taken to go from -1 to 1 (--force LEAST MOST)."
        )
        ends = [(-1.0, 1.0)] * len(ends)
    columns = columns * (TO_FRD if frd else 1.0)
    names = [_name(key, row) for key, row in held.rows.items()]
    return tuple(exchange.of_column(*each) for each in zip(names, columns.T, ends, strict=True))


def _ends(held: Found, data: Any, used: set[Path], exchange: Exchange) -> list[Ends | None]:
    """Least and most of each thruster: its own, those around, or in any mapping that names it."""
    keys = [_name(key, row) for key, row in held.rows.items()]
    ends = [_limits_in(row, 1, exchange)[0] for row in held.rows.values()]
    for _, scope in held.node.scopes[:2]:
        shared = _limits_in(scope, len(keys), exchange)
        ends = [own or other for own, other in zip(ends, shared, strict=True)]
    if any(ends):
        return ends
    known: dict[str, Ends] = {}
    for each in nodes(data):
        if isinstance(each.value, Mapping):
            key, named, _ = lookup(each.value, labels.NAME)
            named = named if key else each.key
            if (
                isinstance(named, str)
                and named in keys
                and (pair := _limits_in(each.value, 1, exchange)[0])
            ):
                known[named] = pair
                used.add(each.path)
    if known and (without := ", ".join(key for key in keys if key not in known)):
        exchange.note(f"It has no limits of {without}.")
    return [known.get(key) for key in keys]


def _limits_in(values: Mapping[str, Any], n: int, exchange: Exchange) -> list[Ends | None]:
    """Least and most [N, or of a command] of each of n thrusters in a mapping; None where unsaid.
    One pair, or one number of each, is for all. A most alone is for both ways."""
    key, pair, size = lookup(values, labels.PAIR, FORCES)
    ends = numbers_in(pair)
    if key and pair is not None:
        if ends is None or ends.shape not in ((2,), (n, 2), (2, n)):
            raise LayoutError(f"expected least and most, or both of each of {n} thrusters", key)
        ends = np.broadcast_to(ends if ends.shape in ((n, 2), (2,)) else ends.T, (n, 2)) * size
        return [(low, high) for low, high in ends.tolist()]
    low_key, low, low_size = lookup(values, labels.LEAST, FORCES)
    high_key, high, high_size = lookup(values, labels.MOST, FORCES)
    if high is None:
        return [None] * n
    most = numbers_in(high)
    least = numbers_in(low if low is not None else high)
    if most is None or least is None or not {most.size, least.size} <= {1, n}:
        raise LayoutError(
            f"expected a number, or one for each of {n} thrusters", f"{low_key} {high_key}"
        )
    if low is None:
        exchange.note(f"{high_key} says nothing of reverse: as much is taken for it.")
        least = -least
        low_size = high_size
    lows = np.broadcast_to(least.ravel() * low_size, n)
    highs = np.broadcast_to(most.ravel() * high_size, n)
    return [*zip(lows.tolist(), highs.tolist(), strict=True)]


def write_matrix(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the matrix of a layout's thrusters per newton, as CSV for `.csv`, else as YAML.
    Raises LayoutError: there is no thruster."""
    kept = exchange.thrusters_of(layout, "A matrix", "places along the lines of the forces")
    rows = own_effectiveness(kept)[:, 0].T * (TO_FRD if exchange.frame == "FRD" else 1.0) + 0.0
    names = list(kept.names)
    limits = np.stack([kept.lower, kept.upper], axis=1)[..., 0].tolist()
    matrix = dict(zip(AXES, rows.tolist(), strict=True))
    if suffix != ".csv":
        head = {"frame": exchange.frame or "FLU", "unit": "N", "names": names, "limits": limits}
        return yaml_text({**head, "matrix": matrix})
    table = {
        "axis": names,
        **matrix,
        **dict(zip(("least", "most"), zip(*limits, strict=True), strict=True)),
    }
    lines = [",".join(map(str, [key, *row])) for key, row in table.items()]
    return "\n".join([f"# frame: {exchange.frame or 'FLU'}", *lines]) + "\n"
