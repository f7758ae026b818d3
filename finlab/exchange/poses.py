"""Position and direction of a thruster, from the forms in which files of others give them.

Files say it by two vectors, by components with a key each (`x`, `x-dir`, `dx`), by a pose of six
numbers, by roll, pitch and yaw, by a quaternion, or by heading and pitch. `split` brings the record
of a thruster into one form, and `position_of` and `direction_of` read it.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import labels
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import axis_of, lookup, numbers_in, plain
from finlab.exchange.questions import QuestionError, which_length
from finlab.files.csv_table import LENGTHS, TURNS

UNIT_TOLERANCE = 0.05
"""A vector whose length is this close to 1 is a direction, or a force per newton."""
SAME_LENGTH = 1e-3
"""As `UNIT_TOLERANCE`, where nothing but its length tells a direction from angles."""
MAX_PLACE = 20.0
"""Largest coordinate that is taken for metres where no unit is named [m]."""
Record = dict[str, Any]
"""What a file says of one thruster, by its own keys."""
_PLACE_WORDS = "{0} p{0} pos{0} {0}pos position{0} {0}position {0}coordinate"
"""Keys of a component of a position; of x `x`, `px`, `posx` and so on."""
_DIRECTION_WORDS = (
    "d{0} a{0} n{0} u{0} dir{0} {0}dir f{0} direction{0} {0}direction axis{0} {0}axis vector{0} "
    "{0}vector"
)
"""Keys of a component of a direction."""
SIGN_OF = "sign of "
"""What goes before a key of a direction that holds a sign or a sense of turning."""
POSE = "pose poses transform xyzrpy placeandangles"
"""Keys of a position with angles."""
_HEADING = "heading azimuth azimuthangle headingangle"
_ELEVATION = "pitch elevation elevationangle pitchangle"
_SPINS = {"clockwise", "counterclockwise", "anticlockwise", "cw", "ccw"}
"""Words of the sense in which a propeller turns, which is no direction of a force."""


def split(record: Mapping[str, Any]) -> Record:
    """Returns what a file says of a thruster with its pose as `position` beside `direction`, `rpy`,
    `quaternion` or `heading_pitch`; what tells no pose stays as it is.

    Raises:
        LayoutError: a pose has as many numbers as none has.
    """
    joined = _without_pose({**record})
    key, value, *_ = lookup(joined, labels.DIRECTION)
    if key and (np.ndim(value) == 0 and (_is_sign(value) or plain(value) in _SPINS)):
        joined[SIGN_OF + key] = joined.pop(key)
    _join(joined, "direction", _DIRECTION_WORDS)
    has_direction = bool(lookup(joined, labels.DIRECTION).key)
    has_heading = bool(lookup(joined, _HEADING, TURNS).key)
    has_torques = any(axis_of(key) in ("Tx", "Ty", "Tz") for key in joined)
    if has_direction or has_heading or not has_torques:  # else x to yaw may be those of a wrench
        _join(joined, "position", _PLACE_WORDS)
    if has_position(joined) and not has_direction:
        _join_angles(joined)
    _name_orientation(joined)
    return joined


def _without_pose(record: Record) -> Record:
    """A record whose pose of six numbers, or of a mapping, stands in keys of its own."""
    key, value, unit, names_unit = lookup(record, POSE, TURNS)
    if not key:
        return record
    if isinstance(value, Mapping):
        inner = {str(name): entry for name, entry in value.items()}
        _join(inner, "position", _PLACE_WORDS)
        _join_angles(inner)
        return {**{k: v for k, v in record.items() if k != key}, **inner}
    pose = numbers_in(value)
    if pose is None or pose.shape != (6,):
        count = "no list of numbers" if pose is None else f"{pose.size} numbers"
        raise LayoutError(
            f"is {count}, expected six: x, y, z, roll, pitch and yaw; write others as `position` "
            "and `rpy`, or `quaternion` (x, y, z, w)",
            key,
        )
    rest = {k: v for k, v in record.items() if k != key}
    angles = {"rpy_rad" if names_unit else "rpy": (pose[3:] * unit).tolist()}
    return {**rest, "position": pose[:3].tolist(), **angles}


def _join(record: Record, vector: str, words: str) -> None:
    """Makes one vector of the components of a record, in metres where their unit is named; one
    without z lies in the plane."""
    entries = [lookup(record, words.format(axis), LENGTHS) for axis in "xyz"]
    if not (entries[0].key and entries[1].key) or lookup(record, vector).key:
        return
    if any(np.ndim(entry.value) for entry in entries):
        return
    values = [0.0 if entry.value is None else entry.value for entry in entries]
    has_unit = entries[0].names_unit
    if has_unit and all(isinstance(value, int | float) for value in values):
        values = [value * entry.unit for value, entry in zip(values, entries, strict=True)]
    for entry in entries:
        record.pop(entry.key, None)
    record[f"{vector}_m" if has_unit else vector] = values


def _join_angles(record: Record) -> None:
    """Makes `rpy` or `heading_pitch` of the angles of a record that stand in keys of their own."""
    rolls = {word: lookup(record, word, TURNS) for word in ("roll", "pitch", "yaw")}
    if rolls["yaw"].key and (rolls["pitch"].key or rolls["roll"].key):
        _join_turns(record, "rpy", list(rolls.values()))
        return
    heading = lookup(record, _HEADING, TURNS)
    if heading.key:
        _join_turns(record, "heading_pitch", [heading, lookup(record, _ELEVATION, TURNS)])


def _join_turns(record: Record, name: str, entries: list[labels.Entry]) -> None:
    """Makes one list of angles, in radians where the first that is there names its unit."""
    present = [entry for entry in entries if entry.key]
    values = [0.0 if entry.value is None else entry.value for entry in entries]
    if not all(isinstance(value, int | float) for value in values):
        return
    has_unit = any(entry.names_unit for entry in present)
    turned = [value * entry.unit for value, entry in zip(values, entries, strict=True)]
    for entry in present:
        record.pop(entry.key, None)
    record[f"{name}_rad" if has_unit else name] = turned if has_unit else values


def _name_orientation(record: Record) -> None:
    """Gives an orientation whose own keys tell what it is its name: angles or a quaternion."""
    key, value, unit, names_unit = lookup(record, labels.AMBIGUOUS, TURNS)
    if not key or not isinstance(value, Mapping):
        return
    names = {plain(name): entry for name, entry in value.items()}
    if {"w", "x", "y", "z"} <= set(names):
        record["quaternion"] = [names[name] for name in "xyzw"]
    elif {"roll", "pitch", "yaw"} <= set(names):
        angles = [names[name] for name in ("roll", "pitch", "yaw")]
        if names_unit and all(isinstance(angle, int | float) for angle in angles):
            record["rpy_rad"] = [angle * unit for angle in angles]
        else:
            record["rpy"] = angles
    else:
        return
    record.pop(key)


def name_unit_orientations(records: Iterable[Record], exchange: Exchange) -> None:
    """Calls `orientation` of all thrusters `direction` where each has length 1, and they do not
    just point along the axes: no angles of several thrusters are so."""
    entries = [(record, lookup(record, labels.AMBIGUOUS)) for record in records]
    present = [(record, entry) for record, entry in entries if entry.key]
    vectors = [numbers_in(entry.value) for _, entry in present]
    known = [vector for vector in vectors if vector is not None and vector.shape == (3,)]
    if not present or len(known) < len(present):
        return
    is_unit = all(abs(float(np.linalg.norm(vector)) - 1.0) < SAME_LENGTH for vector in known)
    leans = any(np.count_nonzero(vector) > 1 for vector in known)
    if not is_unit or not leans:
        return
    exchange.note(f"{present[0][1].key} has length 1 throughout, and is read as a direction.")
    for record, entry in present:
        record["direction"] = record.pop(entry.key)


def has_position(record: Record) -> bool:
    """Whether a record says where its thruster sits."""
    return may_be_vector(lookup(record, labels.POSITION, LENGTHS).value)


def has_direction(record: Record) -> bool:
    """Whether a record says where its thruster points; an error where that may be angles, too.

    Raises:
        LayoutError: what it says may be read in two ways.
    """
    is_said = any(
        may_be_vector(lookup(record, words, TURNS).value)
        for words in (labels.DIRECTION, labels.ANGLES, labels.HEADING_PITCH, labels.QUATERNION)
    )
    key, value, *_ = lookup(record, labels.AMBIGUOUS)
    if key and not is_said and may_be_vector(value) and has_position(record):
        raise LayoutError(
            "may be a direction, or roll, pitch and yaw; call it `direction`, or `rpy` in radians",
            key,
        )
    return is_said


def may_be_vector(value: Any) -> bool:
    """Whether a value may be a vector of one thruster: a mapping, a text or a short list."""
    if isinstance(value, Mapping | str):
        return True
    if not isinstance(value, list) or len(value) >= 6:
        return False
    return not any(isinstance(item, list) for item in value)


def position_of(key: str, record: Record, meters: float | None) -> Array:
    """Returns the position (3,) of a thruster in the file's frame [m].

    Args:
        key: the thruster's key, for an error.
        record: the thruster, as `split` returns it.
        meters: what 1 stands for where its key names no unit [m]; None where nobody has said.

    Raises:
        LayoutError: it is no vector, or too far away for metres that nobody has named.
    """
    position_key, value, unit, names_unit = lookup(record, labels.POSITION, LENGTHS)
    position = vector_in(value, f"{key}.{position_key}")
    if names_unit or meters is not None:
        return position * (unit if names_unit else meters or 1.0)
    if np.abs(position).max() > MAX_PLACE:
        reach = float(np.abs(position).max())
        raise QuestionError(
            f"reaches {reach:g}: which unit is that? name it in the key (position_mm, position_m), "
            "or say --length mm, cm or m",
            f"{key}.{position_key}",
            questions=(which_length(reach),),
        )
    return position


def direction_of(key: str, record: Record, is_frd: bool, exchange: Exchange) -> Array:
    """Returns the direction (3,) of a thruster's force in the file's frame, of length 1.

    Args:
        key: the thruster's key, for an error.
        record: the thruster, as `split` returns it.
        is_frd: whether the file has y to the right and z down.
        exchange: gets the notes.

    Raises:
        LayoutError: it is no vector, has no length, or is of an unknown unit.
    """
    direction_key, value, *_ = lookup(record, labels.DIRECTION)
    where = f"{key}.{direction_key}"
    if direction_key:
        axis = vector_in(value, where)
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise LayoutError("has no length", where)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            exchange.note(f"{where} has length {length:g}; its direction alone is read.")
        return axis / length
    heading = lookup(record, labels.HEADING_PITCH, TURNS)
    if heading.key:
        return _by_heading(heading, f"{key}.{heading.key}", is_frd, exchange)
    angle_key, value, *_ = lookup(record, labels.QUATERNION)
    if angle_key:
        quaternion = numbers_in(value)
        if quaternion is None or quaternion.shape != (4,) or not quaternion.any():
            raise LayoutError("expected x, y, z, w of a quaternion", f"{key}.{angle_key}")
        rotation = Rotation.from_quat(quaternion)
    else:
        angle_key, value, unit, _ = lookup(record, labels.ANGLES, TURNS)
        angles = vector_in(value, f"{key}.{angle_key}") * unit
        if np.abs(angles).max() > 2 * np.pi:
            raise LayoutError(
                "is more than a turn; are these degrees? call it rpy_deg, or a pose pose_deg",
                f"{key}.{angle_key}",
            )
        rotation = Rotation.from_euler("xyz", angles)
    exchange.note(f"{angle_key} turns the axis x of a thruster, along which it pushes.")
    return np.asarray(rotation.apply([1.0, 0.0, 0.0]))


def _by_heading(entry: labels.Entry, where: str, is_frd: bool, exchange: Exchange) -> Array:
    """The direction (3,) at a heading from x towards y, and a pitch upwards."""
    angles = numbers_in(entry.value)
    if angles is None or angles.shape != (2,):
        raise LayoutError(f"is {entry.value!r:.60}, expected heading and pitch", where)
    unit = entry.unit
    if not entry.names_unit:
        unit = exchange.angle_unit or 1.0
        if exchange.angle_unit is None and angles.any():
            raise LayoutError(
                f"is {entry.value!r:.60}, in degrees or radians? name the unit in the key "
                "(heading_pitch_deg, heading_pitch_rad)",
                where,
            )
    heading, pitch = angles * unit
    up = -1.0 if is_frd else 1.0
    exchange.note(
        f"{where.rpartition('.')[2]} turns a thrust from x towards y by its heading, and up by its "
        "pitch."
    )
    across = np.cos(pitch)
    return np.array([across * np.cos(heading), across * np.sin(heading), up * np.sin(pitch)])


def vector_in(value: Any, key: str) -> Array:
    """Returns the vector (3,) in a list, a text or a mapping of x, y and z.

    Args:
        value: the vector.
        key: its key, for an error.

    Raises:
        LayoutError: it is no vector.
    """
    components = [value.get(axis) for axis in "xyz"] if isinstance(value, Mapping) else value
    array = numbers_in(components)
    if array is None or array.shape != (3,):
        raise LayoutError(f"is {value!r:.60}, expected three numbers", key)
    return array


def note_reversed(records: Mapping[str, Record], exchange: Exchange) -> None:
    """Says which thrusters are called reversed: files mean the motor's sense by it, or the force's.

    Args:
        records: the thrusters by name, as `split` returns them.
        exchange: gets the note.
    """
    keys: dict[str, None] = {}
    names: dict[str, None] = {}
    for name, record in records.items():
        for key, value in record.items():
            is_word = labels.is_key_of(key, labels.REVERSED)
            is_signed = key.startswith(SIGN_OF) and plain(value) not in _SPINS
            is_thrust = plain(key) == "thrust" and _is_sign(value)
            if (is_word or is_signed or is_thrust) and _is_negative(value, is_word):
                keys[key.removeprefix(SIGN_OF)] = None
                names[name] = None
    if names:
        exchange.note(
            f"{', '.join(keys)} of {labels.listed(names)} is not applied: the direction is as "
            "drawn",
            "where it says that a positive command pushes the other way, and not that the motor "
            "is wired so, turn the sign of `axis`",
            field="axis",
            actuators=[*names],
        )


def _is_sign(value: Any) -> bool:
    return not isinstance(value, bool) and value in (1, -1, "1", "-1", "+1")


def _is_negative(value: Any, is_word: bool) -> bool:
    """Whether a value says that something is reversed: -1, or of a word such as `flipped` true."""
    if isinstance(value, bool) or plain(value) in ("true", "yes", "false", "no"):
        return is_word and (value is True or plain(value) in ("true", "yes"))
    return str(value).strip() == "-1"
