"""Layouts written: as the plain values of a layout file, and into one."""

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
    others = {name: getattr(layout, name) for name in ("body", "interaction")}
    return data | {name: plain(part) for name, part in others.items() if part is not None}


def save_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a layout file, JSON if the name ends in `.json`, else YAML; an existing file is
    replaced whole. Raises LayoutError: the file cannot be written."""
    data = layout_to_dict(layout)
    is_json = Path(path).suffix.lower() == ".json"
    write_whole(path, json.dumps(data, indent=2) + "\n" if is_json else yaml_text(data))


def plain(value: Any) -> Any:
    """Returns the plain values of a part of a layout file; what is as usual is left out."""
    if isinstance(value, FinModelSpec):
        return {"type": value.type, **dict(value.parameters)}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if not isinstance(value, Checked):
        return value
    keys = {**value.KEYS, **{name: key for name, (key, _) in value.DEGREES.items()}}
    data = {}
    for field in fields(value):
        if field.name in value.UNSAID:
            continue
        own = getattr(value, field.name)
        if own != field.default or field.name in value.WRITTEN:
            own = degrees_of(own) if field.name in value.DEGREES else own
            data[keys.get(field.name, field.name)] = plain(own)
    name = {"name": data.pop("name")} if "name" in data else {}
    return {**name, **({"type": value.type} if value.type else {}), **data}


def degrees_of(value: Any) -> Any:
    """Returns degrees of radians [rad], one or a tuple: twelve digits give back what people wrote;
    where they do not, more are taken, so that reading gives the same radians."""
    if isinstance(value, tuple):
        return tuple(map(degrees_of, value))
    exact = math.degrees(value)
    near = (
        round(exact, 12),
        exact,
        math.nextafter(exact, math.inf),
        math.nextafter(exact, -math.inf),
    )
    return next((angle for angle in near if math.radians(angle) == value), near[0])
