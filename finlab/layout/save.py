"""Writing of layouts: as the plain values of a layout file, and into a file.

The inverse of `finlab.layout.load`.
"""

import json
import math
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

from finlab.actuators.fin.fin_model import FinModelSpec
from finlab.axes import AXES
from finlab.files import yaml_text
from finlab.files.schema import Checked
from finlab.layout.layout import Layout
from finlab.layout.load import FORMAT, FRAME, VERSION
from finlab.whole_file import write_whole


def layout_to_dict(layout: Layout) -> dict[str, Any]:
    """Returns the layout as the plain values of a layout file; `parse_layout` gives the same layout
    back."""
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION, "name": layout.name}
    if layout.description:
        data["description"] = layout.description
    data["frame"] = dict(FRAME)
    if layout.axes != AXES:
        data["axes"] = list(layout.axes)
    data["actuators"] = plain(layout.actuators)
    for name in ("body", "interaction"):
        value = getattr(layout, name)
        if value is not None:
            data[name] = plain(value)
    if layout.power_w is not None:
        data["power_w"] = layout.power_w
    if layout.buses:
        buses = {}
        for bus in layout.buses:
            buses[bus.name] = {"power_w": bus.power_w, "actuators": list(bus.actuators)}
        data["buses"] = buses
    if layout.mirror_pairs:
        data["mirror_pairs"] = [list(pair) for pair in layout.mirror_pairs]
    return data


def save_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a layout file; an existing file is replaced at once, never in part.

    Args:
        layout: the robot.
        path: the file: JSON if its name ends in `.json`, else YAML.

    Raises:
        LayoutError: the file cannot be written.
    """
    data = layout_to_dict(layout)
    is_json = Path(path).suffix.lower() == ".json"
    content = json.dumps(data, indent=2) + "\n" if is_json else yaml_text(data)
    write_whole(path, content)


def plain(value: Any) -> Any:
    """Returns an object of a layout as the plain values of a file, without those that are the
    defaults."""
    if isinstance(value, FinModelSpec):
        return {"type": value.type, **dict(value.parameters)}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if not isinstance(value, Checked):
        return value
    keys = dict(value.KEYS)
    for name, (key, _) in value.DEGREES.items():
        keys[name] = key
    data = {}
    for field in fields(value):
        if field.name in value.UNSAID:
            continue
        field_value = getattr(value, field.name)
        if field_value == field.default and field.name not in value.WRITTEN:
            continue
        if field.name in value.DEGREES:
            field_value = degrees_of(field_value)
        data[keys.get(field.name, field.name)] = plain(field_value)
    # Name and type come first in a file.
    first = {}
    if "name" in data:
        first["name"] = data.pop("name")
    if value.type:
        first["type"] = value.type
    return {**first, **data}


def degrees_of(value: Any) -> Any:
    """Returns degrees such that reading them gives the same radians, bit for bit.

    They are rounded to twelve digits, as a person would have written them, where that does.

    Args:
        value: a number or a tuple of numbers [rad].
    """
    if isinstance(value, tuple):
        return tuple(map(degrees_of, value))
    exact = math.degrees(value)
    rounded = round(exact, 12)
    above = math.nextafter(exact, math.inf)
    below = math.nextafter(exact, -math.inf)
    for angle in (rounded, exact, above, below):
        if math.radians(angle) == value:
            return angle
    return rounded
