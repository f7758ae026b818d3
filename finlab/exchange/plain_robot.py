"""Layouts of thrusters from plain values of YAML, JSON or a table, and allocation matrices as text.

`records` finds the thrusters; here they get positions, axes, limits and the frame of the layout.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.exchange import labels, poses
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.exchange.labels import (
    FRAMES,
    Path,
    is_key_of,
    lookup,
    nodes,
    numbers_in,
    stated_frame,
    unread,
)
from finlab.exchange.poses import Record
from finlab.exchange.questions import which_frame
from finlab.exchange.records import ThrusterRecords, find_thrusters, is_unit
from finlab.files import yaml_text
from finlab.files.csv_table import FORCES, LENGTHS, TURNS
from finlab.layout import MAX_ACTUATORS, Layout, Thruster, own_effectiveness

VISIBLE = 1e-3
"""Distance from the middle [m], and part of a direction, from which on sides differ."""
LimitPair = tuple[float, float]
"""Least and most [N], or least and most command."""


def read_plain(
    data: Any, name: str, exchange: Exchange, comments: Sequence[str] = (), table: bool = False
) -> Layout:
    """Returns the layout of the thrusters in plain values.

    Args:
        data: mappings, lists, numbers and texts of a file.
        name: the layout's name.
        exchange: defaults for what the file does not say; gets the notes.
        comments: the file's comments, which may name the frame.
        table: whether the values come from a table, whose rows nothing but labels names.

    Raises:
        LayoutError: there are no thrusters, or several sets of them, or they may be read in two
            ways.
    """
    thrusters = find_thrusters(data, exchange, table)
    n = len(thrusters.records)
    if n > MAX_ACTUATORS:
        what = "columns" if thrusters.axes else "thrusters"
        raise LayoutError(f"expected up to {MAX_ACTUATORS} {what}, got {n}", thrusters.node.words)
    frame = _frame(thrusters, exchange, comments)
    used = {thrusters.node.path}
    build = _of_columns if thrusters.axes else _of_positions
    actuators = build(thrusters, data, frame == "FRD", used, exchange)
    if frame is None:
        exchange.note(
            f"It names no frame: {FRAMES['FLU']} (FLU) is taken",
            "--frame FRD for the other",
            question=which_frame("The file names none.", _meanings(actuators)),
        )
    for depth, (path, scope) in enumerate(thrusters.node.scopes):
        # Limits count where they stand with the thrusters, or right around them.
        limit_keys = labels.LIMIT_KEYS if depth < 2 else ""
        words = f"{labels.FRAME_KEYS} {labels.NAMES} {limit_keys}"
        used |= {(*path, key) for key in scope if is_key_of(key, words, FORCES)}
    records = {_thruster_name(key, record): record for key, record in thrusters.records.items()}
    poses.note_reversed(records, exchange)
    unknown_keys = labels.unknown_in(thrusters.records.values())
    if unknown_keys:
        exchange.note(f"Not read of each thruster: {unknown_keys}.")
    unread_keys = unread(data, used)
    if unread_keys:
        exchange.note(f"Not read: {unread_keys}.")
    axes = tuple(axis for axis in AXES if axis in thrusters.axes or not thrusters.axes)
    return Layout(name, actuators, axes=axes)


def _frame(
    thrusters: ThrusterRecords, exchange: Exchange, comments: Sequence[str]
) -> labels.Frame | None:
    """The frame that the user or the file names, by which words a note says; None where neither
    does."""
    if exchange.frame is None:
        frame, where = stated_frame(_scopes(thrusters), comments)
        if frame:
            turned = "" if frame == "FLU" else f", and was turned to {FRAMES['FLU']}"
            exchange.note(f"Its frame is {FRAMES[frame]} ({where}){turned}.")
        return frame
    with suppress(LayoutError):  # a word for it that is not known does not count
        frame, where = stated_frame(_scopes(thrusters), comments)
        if frame and frame != exchange.frame:
            exchange.note(f"It says {where}; {exchange.frame} was taken in its stead.")
    return exchange.frame


def _scopes(thrusters: ThrusterRecords) -> list[Mapping[str, Any]]:
    """The mappings around the thrusters, the innermost first."""
    return [scope for _, scope in thrusters.node.scopes]


def _meanings(actuators: Sequence[Thruster]) -> tuple[str, str]:
    """What y left and z up, and what y right and z down would make of thrusters that were read in
    the former."""
    aside = max(actuators, key=lambda thruster: abs(thruster.position[1]))
    upright = max(actuators, key=lambda thruster: abs(thruster.axis[2]))
    y = aside.position[1]
    z = upright.axis[2]
    meanings = []
    for sign in (1.0, -1.0):
        words = []
        if abs(y) > VISIBLE:
            words.append(f"{aside.name} sits at the {'left' if sign * y > 0.0 else 'right'}")
        if abs(z) > VISIBLE:
            words.append(f"{upright.name} pushes {'up' if sign * z > 0.0 else 'down'}")
        meanings.append(", ".join(words))
    flu, frd = meanings
    return flu, frd


def _of_positions(
    thrusters: ThrusterRecords, data: Any, is_frd: bool, used: set[Path], exchange: Exchange
) -> tuple[Thruster, ...]:
    """Thrusters by position and direction; adds the paths of what it reads to `used`."""
    meters = _length_unit(thrusters, used, exchange)
    places = [poses.position_of(key, record, meters) for key, record in thrusters.records.items()]
    center = np.zeros(3)
    if exchange.origin == "gravity":
        center = _center(thrusters, data, meters, used, exchange)
    exchange.note(f"{thrusters.node.words} was read: places in m, directions, limits in N.")
    sign = TO_FRD[:3, 0] if is_frd else np.ones(3)
    limits = _limits(thrusters, data, used, exchange)
    _settle_angles(thrusters, exchange)
    actuators = []
    for (key, record), place, force in zip(thrusters.records.items(), places, limits, strict=True):
        position = place - center
        axis = poses.direction_of(key, record, is_frd, exchange)
        name = _thruster_name(key, record)
        actuators.append(exchange.thruster(name, position * sign, axis * sign, force))
    return tuple(actuators)


def _length_unit(thrusters: ThrusterRecords, used: set[Path], exchange: Exchange) -> float | None:
    """What a length of 1 stands for where its own key does not say [m]; None where nobody has
    said."""
    if exchange.length is not None:
        return LENGTHS[exchange.length]
    for path, scope in thrusters.node.scopes:
        key, value, *_ = lookup(scope, labels.UNIT)
        word = str(value).lower().strip()
        if key and labels.LENGTH_WORDS.get(word):
            used.add((*path, key))
            exchange.note(f"Lengths are in {word} ({key}).")
            return labels.LENGTH_WORDS[word]
    return None


def _center(
    thrusters: ThrusterRecords, data: Any, meters: float | None, used: set[Path], exchange: Exchange
) -> Array:
    """The centre of gravity (3,) in the file's frame [m], in the unit of the positions where its
    own key names none; 0 where the file has none."""
    position_units = {
        lookup(record, labels.POSITION, LENGTHS).unit for record in thrusters.records.values()
    }
    center = np.zeros(3)
    for node in nodes(data):
        if not is_key_of(node.key, labels.CENTER, LENGTHS):
            continue
        value = node.value
        components = [value.get(axis) for axis in "xyz"] if isinstance(value, Mapping) else value
        point = numbers_in(components)
        if point is None or point.shape != (3,):
            continue
        entry = lookup({node.key: None}, labels.CENTER, LENGTHS)
        unit = meters or (min(position_units) if len(position_units) == 1 else 1.0)
        center = point * (entry.unit if entry.names_unit else unit)
        used.add(node.path)
        x, y, z = center
        exchange.note(f"The origin is at {node.words}, {x:g} {y:g} {z:g} m.")
    return center


def _settle_angles(thrusters: ThrusterRecords, exchange: Exchange) -> None:
    """Takes headings for degrees where one of them is more than a turn in radians."""
    largest = 0.0
    for record in thrusters.records.values():
        angles = numbers_in(lookup(record, labels.HEADING_PITCH).value)
        if angles is not None:
            largest = max(largest, float(np.abs(angles).max()))
    if largest > 2.0 * np.pi:
        exchange.angle_unit = TURNS["deg"]
        exchange.note(f"Headings reach {largest:g}, and are read in degrees.")


def _thruster_name(key: str, record: Record) -> str:
    """A thruster's name: that in its record, else its key, else its number from 1."""
    name = str(lookup(record, labels.NAME).value or "").strip()
    if name and not name.isdecimal():
        return name
    return f"thruster{int(key[1:-1]) + 1}" if key.startswith("[") else key


def _of_columns(
    thrusters: ThrusterRecords, data: Any, is_frd: bool, used: set[Path], exchange: Exchange
) -> tuple[Thruster, ...]:
    """Thrusters by the columns of a matrix; adds the paths of what it reads to `used`."""
    columns = np.zeros((6, len(thrusters.records)))
    columns[[AXES.index(axis) for axis in thrusters.axes]] = thrusters.columns
    per_newton = is_unit(columns[:3])
    unit = "N and N m" if per_newton else "N and N m at a command of 1"
    exchange.note(f"{thrusters.node.words} was read, {thrusters.order}, in {unit}.")
    missing = ", ".join(axis for axis in AXES if axis not in thrusters.axes)
    if missing:
        exchange.note(f"It has no row {missing}: 0 is taken there, and not commanded (`axes`).")
    limits = _limits(thrusters, data, used, exchange)
    if not any(limits) and not per_newton:
        exchange.note(
            "It has no limits: commands are taken to go from -1 to 1",
            "--force LEAST MOST for others",
            field="force",
        )
        limits = [(-1.0, 1.0)] * len(limits)
    columns = columns * (TO_FRD if is_frd else 1.0)
    actuators = []
    for (key, record), column, pair in zip(
        thrusters.records.items(), columns.T, limits, strict=True
    ):
        actuators.append(exchange.thruster_of_column(_thruster_name(key, record), column, pair))
    return tuple(actuators)


def _limits(
    thrusters: ThrusterRecords, data: Any, used: set[Path], exchange: Exchange
) -> list[LimitPair | None]:
    """The limits of each thruster: those of its record, of the two mappings around all, or of any
    mapping in the file that has its name; None where there are none."""
    names = [_thruster_name(key, record) for key, record in thrusters.records.items()]
    limits = [_limits_in(record, 1, exchange)[0] for record in thrusters.records.values()]
    for _, scope in thrusters.node.scopes[:2]:
        shared = _limits_in(scope, len(names), exchange)
        limits = [pair or default for pair, default in zip(limits, shared, strict=True)]
    if any(limits):
        return limits
    by_name: dict[str, LimitPair] = {}
    for node in nodes(data):
        if not isinstance(node.value, Mapping):
            continue
        name_key, name, *_ = lookup(node.value, labels.NAME)
        if not name_key:
            name = node.key
        if isinstance(name, str) and name in names:
            pair = _limits_in(node.value, 1, exchange)[0]
            if pair:
                by_name[name] = pair
                used.add(node.path)
    without = ", ".join(name for name in names if name not in by_name)
    if by_name and without:
        exchange.note(f"It has no limits of {without}.")
    return [by_name.get(name) for name in names]


def _limits_in(values: Mapping[str, Any], n: int, exchange: Exchange) -> list[LimitPair | None]:
    """The limits of each of n thrusters in a mapping [N, or of a command]; None where it has none.

    One pair, or one number of each, is for all. A most alone is for both ways.
    """
    key, value, newtons, _ = lookup(values, labels.LIMITS, FORCES)
    if key and value is not None:
        pairs = numbers_in(value)
        if pairs is None or pairs.shape not in ((2,), (n, 2), (2, n)):
            raise LayoutError(f"expected least and most, or both of each of {n} thrusters", key)
        if pairs.shape not in ((n, 2), (2,)):
            pairs = pairs.T
        pairs = np.broadcast_to(pairs, (n, 2)) * newtons
        return [(low, high) for low, high in pairs.tolist()]
    low_key, low_value, low_newtons, _ = lookup(values, labels.LOWER_LIMIT, FORCES)
    high_key, high_value, high_newtons, _ = lookup(values, labels.UPPER_LIMIT, FORCES)
    if high_value is None:
        return [None] * n
    high = numbers_in(high_value)
    low = numbers_in(low_value if low_value is not None else high_value)
    if high is None or low is None or not {high.size, low.size} <= {1, n}:
        raise LayoutError(
            f"expected a number, or one for each of {n} thrusters", f"{low_key} {high_key}"
        )
    if low_value is None:
        exchange.note(
            f"{high_key} says nothing of reverse: as much is taken for it.", field="force"
        )
        low = -low
        low_newtons = high_newtons
    lows = np.broadcast_to(low.ravel() * low_newtons, n)
    highs = np.broadcast_to(high.ravel() * high_newtons, n)
    return [*zip(lows.tolist(), highs.tolist(), strict=True)]


def write_matrix(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the effectiveness matrix of a layout's thrusters, per newton, as text.

    Args:
        layout: the layout to write.
        exchange: the frame of the matrix; gets the notes.
        suffix: `.csv` for a table; YAML for all others.

    Raises:
        LayoutError: there is no thruster.
    """
    form = "A matrix"
    thrusters = exchange.thrusters_of(layout, form, "places along the lines of the forces")
    frame = exchange.frame or "FLU"
    sign = TO_FRD if frame == "FRD" else 1.0
    rows = own_effectiveness(thrusters)[:, 0].T * sign + 0.0  # (6, n); + 0.0 makes -0.0 to 0.0
    names = list(thrusters.names)
    matrix = dict(zip(AXES, rows.tolist(), strict=True))
    low = thrusters.lower[:, 0].tolist()
    high = thrusters.upper[:, 0].tolist()
    if suffix != ".csv":
        limits = [list(pair) for pair in zip(low, high, strict=True)]
        return yaml_text(
            {"frame": frame, "unit": "N", "names": names, "limits": limits, "matrix": matrix}
        )
    table = {"axis": names, **matrix, "least": low, "most": high}
    lines = [f"# frame: {frame}"]
    for label, cells in table.items():
        lines.append(",".join(map(str, [label, *cells])))
    return "\n".join(lines) + "\n"
