"""Words of others for axes, frames, places and limits, and all places in plain values that they
name."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES, Axis
from finlab.errors import LayoutError
from finlab.files.csv_table import FORCES, LENGTHS, TURNS

Frame = Literal["FLU", "FRD"]
FRAMES: dict[Frame, str] = {"FLU": "x forward, y left, z up", "FRD": "x forward, y right, z down"}
_FRAME_WORDS: dict[Frame, set[str]] = {
    "FLU": {"flu", "enu", "nwu", "rep103", "rep"},
    "FRD": {"frd", "ned", "sname", "fsd"},
}
_SIDES: dict[Frame, set[str]] = {
    "FLU": {"left", "port", "up"},
    "FRD": {"right", "starboard", "down"},
}
FRAME_KEYS = (
    "frame bodyframe convention coordinateframe coordinatesystem referenceframe axesconvention "
)
FRAME_KEYS += "frameid"
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
NAMES = "names thrusters thrusternames joints jointnames motors actuators"
COUNT = "count n num number nthrusters numthrusters numberofthrusters thrustercount"
POSITION = (
    "position positions pos xyz location locations place placement leverarm r coordinates origin"
)
DIRECTION = "direction directions dir axis axes forcedirection forcedirections thrustdirection "
DIRECTION += "thrustdirections thrustaxis thrustvector unitvector vector"
ANGLES = "rpy euler eulerangles rollpitchyaw"
UNCLEAR = "orientation orientations attitude rotation"
ROWS_OF = "axes dof dofs rows rownames axisnames degreesoffreedom controlledaxes"
CENTER = "centerofmass centreofmass centerofgravity centreofgravity cog com cg"
PAIR = (
    "bounds limits range forcelimits thrustlimits forcebounds thrustbounds thrustrange forcerange"
)
LEAST = (
    "least min lower minimum minforce minthrust forcemin thrustmin lowerlimit lowerbound fmin tmin"
)
MOST = (
    "most max upper maximum maxforce maxthrust forcemax thrustmax upperlimit upperbound fmax tmax"
)
LIMIT_KEYS = f"{PAIR} {LEAST} {MOST} {COUNT} {ROWS_OF}"
ROW = f"{NAME} {POSITION} {DIRECTION} {ANGLES} {LIMIT_KEYS} x y z "
ROW += "px py pz posx posy posz dx dy dz ax ay az nx ny nz ux uy uz dirx diry dirz"
"""Keys of a thruster that are read."""
LONGEST_LIST, MAX_NODES = 300, 30_000
"""Most characters of a list of keys, and most values that are looked at."""
Path = tuple[str, ...]


def plain(label: object) -> str:
    """Returns a label's letters and digits in lower case, without a unit in brackets."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[(\[]", str(label), maxsplit=1)[0].lower())


def axis_of(label: object) -> Axis | None:
    """Returns the axis that a label names, such as `Fx`, `rz` or `surge`; None for others."""
    return _AXES.get(plain(label))


def lookup(
    values: Mapping[str, Any], words: str, units: Mapping[str, float] | None = None
) -> tuple[str, Any, float]:
    """Returns the first key of a mapping that is one of some words, its value and the size of its
    unit, which may end the key (`position_mm`) or stand behind it in brackets; an empty key where
    there is none."""
    known = words.split()
    for key, value in values.items():
        label = str(key)[:100]
        size = 1.0
        unit = re.search(r"[_ (\[]+([a-z]+)[)\]]?$", label, re.IGNORECASE) if units else None
        if unit and units and unit[1].lower() in units:
            label = label[: unit.start()]
            size = units[unit[1].lower()]
        word = plain(label)
        if word in known or word.removeprefix("thruster").removeprefix("s") in known:
            return str(key), value, size
    return "", None, 1.0


def unknown_in(rows: Iterable[Mapping[str, Any]]) -> str:
    """Returns the keys of thrusters that are not read, with commas between."""
    keys = dict.fromkeys(str(key) for row in rows for key in row)
    units = {**LENGTHS, **FORCES, **TURNS}
    return ", ".join(
        key for key in keys if not axis_of(key) and not lookup({key: 0}, ROW, units)[0]
    )[:300]


def frame_in(text: str) -> Frame | None:
    """Returns the frame that a text names by words such as NED, FLU, `y right`; None where it names
    none, or a left-handed one."""
    words = set(re.findall(r"[a-z]+(?:103)?", text[:2000].lower()))
    for known in (_FRAME_WORDS, _SIDES):
        named: list[Frame] = [frame for frame, of_it in known.items() if words & of_it]
        if named:
            return named[0] if len(named) == 1 else None
    return None


def frame_said(
    scopes: Iterable[Mapping[str, Any]], comments: Iterable[str]
) -> tuple[Frame | None, str]:
    """Returns the frame that mappings, the innermost first, or else comments name, and where it
    says so. Raises LayoutError: a frame is named by a word that is not known."""
    for key, value, _ in (lookup(scope, FRAME_KEYS) for scope in scopes):
        text = " ".join(map(str, value.values())) if isinstance(value, Mapping) else str(value)
        if frame := frame_in(text):
            return frame, f"{key} {text}"
        if key and plain(key) != "frameid":
            words = "FLU, ENU or REP-103 (y left, z up), or FRD, NED or SNAME (y right, z down)"
            raise LayoutError(
                f"is {text!r:.60}, expected {words}; or leave it out, and say --frame", key
            )
    for comment in comments:
        if re.search(r"\b(?:FLU|FRD|NED|ENU|SNAME|frame)\b", comment) and (
            frame := frame_in(comment)
        ):
            return frame, "its comment"
    return None, ""


class Node(NamedTuple):
    """A value in plain values, the keys that lead to it, and the mappings around it with their
    paths, the innermost first; a mapping itself is the first."""

    path: Path
    value: Any
    scopes: tuple[tuple[Path, Mapping[str, Any]], ...]

    @property
    def key(self) -> str:
        """Its last key, without places in lists."""
        return next((key for key in reversed(self.path) if not key.startswith("[")), "")

    @property
    def words(self) -> str:
        """Its keys as a sentence has them."""
        return (".".join(self.path).replace(".[", "[") or "the file")[:100]


def nodes(data: Any) -> Iterator[Node]:
    """Yields all mappings, lists and values in plain values, outer ones first, but no numbers in
    lists. Raises LayoutError: there are too many."""
    waiting: list[Node] = [Node((), data, ())]
    count = 0
    while waiting:
        path, value, scopes = node = waiting.pop()
        count += len(value) if isinstance(value, Mapping | list) else 0
        if count > MAX_NODES:
            raise LayoutError(f"has more than {MAX_NODES:,} entries, too many to be read")
        inner: Iterable[tuple[str, Any]] = ()
        if isinstance(value, Mapping):
            scopes = ((path, value), *scopes)
            inner = value.items()
            node = Node(path, value, scopes)
        elif isinstance(value, list):
            inner = (
                (f"[{i}]", each) for i, each in enumerate(value) if isinstance(each, Mapping | list)
            )
        yield node
        waiting += [Node((*path, key), each, scopes) for key, each in [*inner][::-1]]


def unread(data: Any, used: set[Path]) -> str:
    """Returns the keys of values that lie below none that were used, with commas between."""
    values = (node for node in nodes(data) if not isinstance(node.value, Mapping))
    named = [node for node in values if not (node.path and node.path[-1].startswith("["))]
    left = [
        node.words
        for node in named
        if not any(node.path[:i] in used for i in range(len(node.path) + 1))
    ]
    return listed(left) if left else ""


def listed(names: Iterable[str]) -> str:
    """Returns names as a sentence has them, the first of many."""
    text = ", ".join(names) or "none"
    return text if len(text) <= LONGEST_LIST else f"{text[:LONGEST_LIST].rpartition(',')[0]}, ..."


def numbers_in(values: Any) -> Array | None:
    """Returns nested numbers, or text that stands for them, as an array of their shape; None where
    some are no numbers, or as large as 1e9."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return array if array.size and (np.abs(array) < 1e9).all() else None
