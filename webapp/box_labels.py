"""Labels of boxes by the fields that they hold, for sentences that lead to one and for errors about
one."""

import math
import re
from typing import Any

from finlab.actuators.kinds import KINDS
from finlab.errors import FinlabError, LayoutError
from webapp.panels.body_boxes import NUMBERS, VECTORS
from webapp.panels.inspectors import Box, inspector_of

PLACES = {
    "position": "Position [m]",
    "axis": "Axis",
    "zero": "Zero",
    "model": "Model",
    "name": "Name",
    "description": "About",
}
"""Field of an actuator or of the robot -> label of its box, where no inspector names it."""
_INDEX = re.compile(r"\[(\d+)\]$")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def box_label(field: str, kind: str = "") -> str:
    """Returns the label of the box that holds a field; empty where there is none.

    Args:
        field: of an actuator, or of the body, with or without `body.` before it.
        kind: type of the actuator, such as `thruster`; any of them when empty.
    """
    box = _box_of(field, kind)
    if box is not None:
        return box.label
    key = field.removeprefix("body.")
    if key in NUMBERS:
        return NUMBERS[key].label
    if key in VECTORS:
        return VECTORS[key][0].label
    return PLACES.get(key, "")


def _box_of(field: str, kind: str) -> Box | None:
    """The box of an actuator's field in the inspector of its kind."""
    kinds = [KINDS[kind]] if kind in KINDS else [*KINDS.values()]
    for each in kinds:
        inspector = inspector_of(each)
        for box in (*inspector.limits, *inspector.law):
            if box.key == field:
                return box
    return None


def in_boxes(error: FinlabError) -> str:
    """Returns an error with the label of the box that it is about in place of the field's name; one
    about a file keeps the keys of the file."""
    if not isinstance(error, LayoutError) or error.source or not error.key:
        return str(error)
    match = _INDEX.search(error.key)
    field = error.key[: match.start()] if match else error.key
    kind = error.actuator.partition(" ")[0]
    label = box_label(field, kind)
    if not label:
        return str(error)
    problem = error.problem
    box = _box_of(field, kind)
    if box is not None and box.degrees:
        problem = _NUMBER.sub(_degrees, problem)
    whose = f" of {error.actuator}" if error.actuator else ""
    return f"{label}{whose}: {problem}"


def _degrees(match: Any) -> str:
    """A number of radians in degrees."""
    return f"{math.degrees(float(match[0])):.4g}"
