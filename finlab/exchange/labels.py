"""The vocabulary of other people's files: labels of axes, frames, positions, directions and limits.

A label is compared by its letters and digits in lower case (`plain`), so `max_thrust [N]` and
`MaxThrust` are one. Constants hold such labels with blanks between. `nodes` walks through plain
values of YAML, JSON or a table, and `lookup` finds an entry by its label and unit; `records` and
`plain_robot` read robots by both.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES, Axis
from finlab.errors import LayoutError
from finlab.exchange.questions import QuestionError, which_frame
from finlab.files.csv_table import FORCES, LENGTHS, TURNS

Frame = Literal["FLU", "FRD"]
"""A body frame, named by the directions of x, y and z."""
FRAMES: dict[Frame, str] = {"FLU": "x forward, y left, z up", "FRD": "x forward, y right, z down"}
"""Body frames as sentences name them."""
_FRAME_NAMES: dict[Frame, set[str]] = {
    "FLU": {"flu", "enu", "nwu", "rep103", "rep"},
    "FRD": {"frd", "ned", "sname", "fsd"},
}
"""Names of frames; world frames stand for the body frame of the same handedness and z."""
_FRAME_SIDES: dict[Frame, set[str]] = {
    "FLU": {"left", "port", "up"},
    "FRD": {"right", "starboard", "down"},
}
"""Directions of y and z, asked where no frame is named."""
FRAME_KEYS = (
    "frame bodyframe convention coordinateframe coordinatesystem referenceframe axesconvention "
    "frameid"
)
"""Keys of the frame."""
_AXIS_WORDS = {
    "Fx": "fx x surge forcex xforce",
    "Fy": "fy y sway forcey yforce",
    "Fz": "fz z heave forcez zforce",
    "Tx": "tx mx rx k roll torquex momentx taux xtorque",
    "Ty": "ty my ry m pitch torquey momenty tauy ytorque",
    "Tz": "tz mz rz n yaw torquez momentz tauz ztorque",
}
_AXES: dict[str, Axis] = {word: axis for axis in AXES for word in _AXIS_WORDS[axis].split()}
NAME = "name thruster joint thrustername jointname motor actuator id label"
"""Keys of one thruster's name."""
NAMES = "names thrusters thrusternames joints jointnames motors actuators"
"""Keys of the list of all thrusters' names."""
COUNT = "count n num number nthrusters numthrusters numberofthrusters thrustercount"
"""Keys of the number of thrusters."""
POSITION = (
    "position positions pos xyz location locations place placement leverarm r coordinates origin"
)
"""Keys of a thruster's position, or of all positions."""
DIRECTION = (
    "direction directions dir axis axes forcedirection forcedirections thrustdirection "
    "thrustdirections thrustaxis thrustvector unitvector vector"
)
"""Keys of a thruster's direction, or of all directions."""
ANGLES = "rpy euler eulerangles rollpitchyaw"
"""Keys of roll, pitch and yaw of a thruster, which pushes along its x."""
HEADING_PITCH = "headingpitch headingandpitch azimuthelevation azel"
"""Keys of heading and pitch of a thruster's force."""
QUATERNION = "quaternion quat quatxyzw quaternionxyzw"
"""Keys of a quaternion x, y, z, w of a thruster, which pushes along its x."""
REVERSED = (
    "reversed reverse isreversed flipped flip isflipped inverted invert inverse isinverted "
    "polarity sign"
)
"""Keys that say that something of a thruster has the other sign."""
UNIT = "unit units lengthunit lengthunits positionunit positionunits distanceunit distanceunits"
"""Keys of the unit of lengths around the thrusters."""
LENGTH_WORDS = {
    **LENGTHS,
    **dict.fromkeys(("meter", "meters", "metre", "metres", "si"), 1.0),
    **dict.fromkeys(("centimeter", "centimeters", "centimetre", "centimetres"), 0.01),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), 1e-3),
}
"""Units of length by the words that files have for them [m]."""
OTHER_DEVICES = {
    *("camera", "cameras", "sensor", "sensors", "imu", "imus", "dvl", "lidar", "sonar", "gps"),
    *("light", "lights", "beacon", "beacons", "hydrophone", "hydrophones", "marker", "markers"),
}
"""Words of keys below which no thruster is."""
AMBIGUOUS = "orientation orientations attitude rotation"
"""Keys that may hold a direction or angles; a file with one is refused."""
_FRAME_IN_COMMENT = re.compile(
    r"\b(?:FLU|FRD|NED|ENU|SNAME|frame)\b"
    r"|\b[yY] ?(?:is|=|:|to the|->)? ?(?:left|right|port|starboard)"
)
"""A comment that names a frame, by a word or by where y points."""
ROW_LABELS = "axes dof dofs rows rownames axisnames degreesoffreedom controlledaxes"
"""Keys of the labels of a matrix's rows."""
CENTER = (
    "centerofmass centreofmass centerofgravity centreofgravity centergravity centregravity "
    "gravitycenter gravitycentre masscenter masscentre cog com cg"
)
"""Keys of the centre of gravity."""
LIMITS = (
    "bounds limits range forcelimits thrustlimits forcebounds thrustbounds thrustrange forcerange"
)
"""Keys of a pair of least and most."""
LOWER_LIMIT = (
    "least min lower minimum minforce minthrust forcemin thrustmin lowerlimit lowerbound fmin tmin"
)
"""Keys of the least force or command."""
UPPER_LIMIT = (
    "most max upper maximum maxforce maxthrust forcemax thrustmax upperlimit upperbound fmax tmax"
)
"""Keys of the most force or command."""
LIMIT_KEYS = f"{LIMITS} {LOWER_LIMIT} {UPPER_LIMIT} {COUNT} {ROW_LABELS}"
"""Keys that are read of a mapping around the thrusters."""
THRUSTER_KEYS = (
    f"{NAME} {POSITION} {DIRECTION} {ANGLES} {HEADING_PITCH} {QUATERNION} {REVERSED} {LIMIT_KEYS}"
)
"""Keys that are read of the mapping of one thruster."""
MAX_LIST_LENGTH = 300
"""Longest list of keys in a sentence [characters]."""
MAX_NODES = 30_000
"""Most values of a file that are visited."""
Path = tuple[str, ...]
"""The keys that lead to a value; an index is a key such as `[2]`."""


def plain(label: object) -> str:
    """Returns a label's letters and digits in lower case, without a unit in brackets."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[(\[]", str(label), maxsplit=1)[0].lower())


def axis_of(label: object) -> Axis | None:
    """Returns the axis that a label names, such as `Fx`, `rz` or `surge`; None for others."""
    return _AXES.get(plain(label))


class Entry(NamedTuple):
    """An entry of a mapping that was looked up by the words for it."""

    key: str
    """The key as the file has it; empty where the mapping has no such entry."""
    value: Any
    unit: float
    """What a value of 1 stands for, in SI: 0.001 of `position_mm`; 1 where no unit is named."""
    names_unit: bool = False
    """Whether the key names that unit."""


def lookup(
    values: Mapping[str, Any], words: str, units: Mapping[str, float] | None = None
) -> Entry:
    """Returns the first entry of a mapping whose key is one of some words.

    Args:
        values: the mapping.
        words: the words, plain and with blanks between; `thruster` may stand before one.
        units: units that may end the key (`position_mm`) or follow it in brackets, with their
            sizes in SI; none when None.

    Returns:
        The entry; with an empty key and the value None where there is none.
    """
    accepted = words.split()
    for key, value in values.items():
        label = str(key)[:100]
        size = 1.0
        names_unit = False
        if units:
            unit = re.search(r"[_ (\[]+([a-z]+)[)\]]?$", label, re.IGNORECASE)
            if unit and unit[1].lower() in units:
                label = label[: unit.start()]
                size = units[unit[1].lower()]
                names_unit = True
        word = plain(label)
        if word in accepted or word.removeprefix("thruster").removeprefix("s") in accepted:
            return Entry(str(key), value, size, names_unit)
    return Entry("", None, 1.0)


def is_key_of(key: str, words: str, units: Mapping[str, float] | None = None) -> bool:
    """Whether a key is one of some words, as `lookup` compares them."""
    return bool(lookup({key: None}, words, units).key)


def unknown_in(rows: Iterable[Mapping[str, Any]]) -> str:
    """Returns the keys of thrusters that are not read, with commas between."""
    units = {**LENGTHS, **FORCES, **TURNS}
    unknown: dict[str, None] = {}  # a set that keeps the order
    for row in rows:
        for key in map(str, row):
            is_known = is_key_of(key.removeprefix("sign of "), THRUSTER_KEYS, units)
            if not axis_of(key) and not is_known:
                unknown[key] = None
    return ", ".join(unknown)[:300]


def frame_in(text: str) -> Frame | None:
    """Returns the frame that a text names by words such as NED, FLU, `y right`; None where it names
    none, or a left-handed one."""
    words = set(re.findall(r"[a-z]+(?:103)?", text[:2000].lower()))
    for vocabulary in (_FRAME_NAMES, _FRAME_SIDES):
        frames: list[Frame] = [frame for frame, names in vocabulary.items() if words & names]
        if frames:
            return frames[0] if len(frames) == 1 else None
    return None


def stated_frame(
    scopes: Iterable[Mapping[str, Any]], comments: Iterable[str]
) -> tuple[Frame | None, str]:
    """Returns the frame that a file states, and the words by which it does; None where it does not.

    Args:
        scopes: the mappings around the thrusters, the innermost first.
        comments: the file's comments, which count where no mapping states a frame.

    Raises:
        LayoutError: a frame is named by a word that is not known.
    """
    for scope in scopes:
        key, value, *_ = lookup(scope, FRAME_KEYS)
        text = " ".join(map(str, value.values())) if isinstance(value, Mapping) else str(value)
        frame = frame_in(text)
        if frame:
            return frame, f"{key} {text}"
        if key and plain(key) != "frameid":  # ROS's frame_id names a link more often than a frame
            words = "FLU, ENU or REP-103 (y left, z up), or FRD, NED or SNAME (y right, z down)"
            raise QuestionError(
                f"is {text!r:.60}, expected {words}; or leave it out, and say --frame",
                key,
                questions=(which_frame(f"{key} of the file is {text!r:.60}, which names none."),),
            )
    for comment in comments:
        if _FRAME_IN_COMMENT.search(comment):
            frame = frame_in(comment)
            if frame:
                return frame, "its comment"
    return None, ""


class Node(NamedTuple):
    """A value within plain values."""

    path: Path
    value: Any
    scopes: tuple[tuple[Path, Mapping[str, Any]], ...]
    """The mappings around it with their paths, the innermost first; a mapping itself comes
    first."""

    @property
    def key(self) -> str:
        """Its last key that is no index."""
        return next((key for key in reversed(self.path) if not key.startswith("[")), "")

    @property
    def words(self) -> str:
        """Its keys as a sentence has them."""
        return (".".join(self.path).replace(".[", "[") or "the file")[:100]


def nodes(data: Any) -> Iterator[Node]:
    """Yields all mappings, lists and values of mappings, outer ones first.

    Numbers and texts in lists are no nodes: their list is one.

    Raises:
        LayoutError: there are more than MAX_NODES.
    """
    stack: list[Node] = [Node((), data, ())]
    count = 0
    while stack:
        path, value, scopes = node = stack.pop()
        count += len(value) if isinstance(value, Mapping | list) else 0
        if count > MAX_NODES:
            raise LayoutError(f"has more than {MAX_NODES:,} entries, too many to be read")
        children: list[tuple[str, Any]] = []
        if isinstance(value, Mapping):
            scopes = ((path, value), *scopes)
            children = list(value.items())
            node = Node(path, value, scopes)
        elif isinstance(value, list):
            for i, item in enumerate(value):
                if isinstance(item, Mapping | list):
                    children.append((f"[{i}]", item))
        yield node
        for key, child in reversed(children):
            stack.append(Node((*path, key), child, scopes))


def names_other_device(path: Path) -> bool:
    """Whether the keys that lead to a value name a camera or a sensor, and no thruster."""
    for key in path:
        words = {plain(word) for word in re.split(r"[^A-Za-z]+", key[:100])}
        if words & OTHER_DEVICES:
            return True
    return False


def unread(data: Any, used: set[Path]) -> str:
    """Returns the keys of values that lie below no used path, with commas between."""
    keys = []
    for node in nodes(data):
        is_item = bool(node.path) and node.path[-1].startswith("[")
        if isinstance(node.value, Mapping) or is_item:
            continue
        if not any(node.path[:i] in used for i in range(len(node.path) + 1)):
            keys.append(node.words)
    return listed(keys) if keys else ""


def listed(names: Iterable[str]) -> str:
    """Returns names as a sentence has them: with commas between, the first of many."""
    text = ", ".join(names) or "none"
    if len(text) <= MAX_LIST_LENGTH:
        return text
    return f"{text[:MAX_LIST_LENGTH].rpartition(',')[0]}, ..."


def numbers_in(values: Any) -> Array | None:
    """Returns nested numbers, or text that stands for them (`0.1 0 0`, `(0.1, 0, 0)`), as an array
    of their shape; None where some are no numbers, or as large as 1e9."""
    if isinstance(values, str):
        values = re.split(r"[\s,;]+", values[:1000].strip(" ()[]"))
        values = values[0] if len(values) == 1 else values
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return array if array.size and (np.abs(array) < 1e9).all() else None
