"""Layout files, version 1: YAML for people, JSON accepted. Shaft angles in degrees, the rest SI and radians.

Every error names the file and the key, such as
`layouts/x.yaml: fins[2].limits.amplitude_rad: minimum 0.6 is above maximum 0.05; swap them`.
"""

import json
import math
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from finlab.errors import LayoutError
from finlab.layout.body import BODY_KEYS, HULL_KEYS, Body, Hull
from finlab.layout.fin import Fin, FinModelSpec, Limits
from finlab.layout.interaction import Interaction, Jet
from finlab.layout.layout import MAX_FINS, Layout
from finlab.layout.rules import mapping, number, shown, text, under
from finlab.layout.servo import SERVO_KEYS, Servo
from finlab.whole_file import write_whole

FORMAT = "finlab-layout"
VERSION = 1
FRAME = {"convention": "FLU", "origin": "center_of_gravity"}
"""The only frame there is; a file may leave it out but not contradict it."""

_LIMIT_FIELDS = {
    "amplitude_rad": "amplitude",
    "frequency_hz": "frequency",
    "zero_direction_rad": "zero_direction",
}


def parse_layout(data: Any, source: str = "layout", folder: Path | None = None) -> Layout:
    """Returns the layout that plain values (as read from a file) describe.

    Args:
        data: mappings, lists, numbers and text, as in a layout file.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.

    Raises:
        LayoutError: something is missing, unknown or out of range.
    """
    with under(source=source):
        return _layout(data, Path.cwd() if folder is None else folder)


def layout_to_dict(layout: Layout) -> dict[str, Any]:
    """Returns the layout as the plain values of a layout file; `parse_layout` gives the same layout back."""
    data: dict[str, Any] = {"format": FORMAT, "version": VERSION, "name": layout.name}
    if layout.description:
        data["description"] = layout.description
    data["frame"] = dict(FRAME)
    data["fins"] = [_fin_to_dict(fin) for fin in layout.fins]
    if layout.body is not None:
        data["body"] = _plain(asdict(layout.body))
    if layout.interaction is not None:
        data["interaction"] = _plain(asdict(layout.interaction))
        del data["interaction"]["velocity"]
    return data


def save_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a layout file, JSON if the name ends in `.json`, else YAML; an existing file is replaced whole.

    Raises:
        LayoutError: the file cannot be written.
    """
    data = layout_to_dict(layout)
    if Path(path).suffix.lower() == ".json":
        content = json.dumps(data, indent=2) + "\n"
    else:
        from finlab.layout.yaml_file import yaml_text  # a robot's computer writes JSON and may lack PyYAML

        content = yaml_text(data)
    write_whole(path, content)


def _layout(data: Any, folder: Path) -> Layout:
    keys = ("format", "version", "name", "description", "frame", "fins", "body", "interaction")
    # Format and version first: in a file of another kind or version, unknown keys are not the news.
    if isinstance(data, dict) and "format" in data and data["format"] != FORMAT:
        raise LayoutError(f"expected {FORMAT}, got {shown(data['format'])}", "format")
    if isinstance(data, dict) and "version" in data:
        version = data["version"]
        if isinstance(version, bool) or version != VERSION:
            raise LayoutError(f"this finlab reads version {VERSION}, got {shown(version)}", "version")
    data = mapping(data, "", keys, required=("format", "version", "name", "fins"))
    if "frame" in data:
        frame = mapping(data["frame"], "frame", tuple(FRAME))
        for key, value in frame.items():
            if value != FRAME[key]:
                raise LayoutError(f"expected {FRAME[key]}, got {shown(value)}", f"frame.{key}")
    fins = data["fins"]
    if not isinstance(fins, list):
        raise LayoutError(f"expected a list of fins, got {shown(fins)}", "fins")
    if not 1 <= len(fins) <= MAX_FINS:
        raise LayoutError(f"expected 1 to {MAX_FINS} fins, got {len(fins)}", "fins")
    parsed = []
    for i, fin in enumerate(fins):
        with under(f"fins[{i}]"):
            parsed.append(_fin(fin, folder))
    with under("body"):
        body = None if data.get("body") is None else _body(data["body"], folder)
    with under("interaction"):
        interaction = None if data.get("interaction") is None else _interaction(data["interaction"])
    description = "" if data.get("description") is None else data["description"]
    return Layout(data["name"], tuple(parsed), description, body, interaction)


def _fin(data: Any, folder: Path) -> Fin:
    keys = ("name", "position_m", "mounting_angle_deg", "limits", "model", "servo")
    data = mapping(data, "", keys, required=("name", "position_m", "mounting_angle_deg"))
    degrees = number(data["mounting_angle_deg"], "mounting_angle_deg", -360.0, 360.0)
    with under("limits"):
        given = mapping({} if data.get("limits") is None else data["limits"], "", tuple(_LIMIT_FIELDS))
        limits = Limits(**{_LIMIT_FIELDS[key]: value for key, value in given.items()})
    with under("model"):
        model = _model({"type": "drag"} if data.get("model") is None else data["model"], folder)
    with under("servo"):
        driven = mapping({} if data.get("servo") is None else data["servo"], "", tuple(SERVO_KEYS))
        servo = Servo(**{SERVO_KEYS[key]: value for key, value in driven.items()})
    return Fin(data["name"], data["position_m"], math.radians(degrees), limits, model, servo)


def _model(data: Any, folder: Path) -> FinModelSpec:
    if not isinstance(data, dict):
        raise LayoutError(f"expected keys and values such as {{type: drag}}, got {shown(data)}")
    if "type" not in data:
        raise LayoutError("required key is missing", "type")
    parameters = {text(key, "", 200): value for key, value in data.items() if key != "type"}
    spec = FinModelSpec(text(data["type"], "type", 200), tuple(parameters.items()))
    located = tuple((k, _absolute(str(v), folder) if k == "path" else v) for k, v in spec.parameters)
    return replace(spec, parameters=located)


def _body(data: Any, folder: Path) -> Body:
    data = dict(mapping(data, "", BODY_KEYS))
    if data.get("hull") is not None:
        with under("hull"):
            hull = dict(mapping(data["hull"], "", HULL_KEYS))
            if hull.get("mesh") is not None:
                hull["mesh"] = _absolute(text(hull["mesh"], "mesh", 4096), folder)
            data["hull"] = Hull(**hull)
    return Body(**data)


def _interaction(data: Any) -> Interaction:
    data = dict(mapping(data, "", ("jets", "half_thrust_n", "narrowness", "inflow")))
    jets = [] if data.get("jets") is None else data["jets"]
    if not isinstance(jets, list):
        raise LayoutError(f"expected a list of jets, got {shown(jets)}", "jets")
    keys, parsed = ("source", "target", "share"), []
    for i, jet in enumerate(jets):
        with under(f"jets[{i}]"):
            parsed.append(Jet(**mapping(jet, "", keys, required=keys)))
    return Interaction(**{**data, "jets": tuple(parsed)})


def _absolute(path: str, folder: Path) -> str:
    return os.path.normpath(folder / path)


def _fin_to_dict(fin: Fin) -> dict[str, Any]:
    limits = {key: list(getattr(fin.limits, field)) for key, field in _LIMIT_FIELDS.items()}
    data = {
        "name": fin.name,
        "position_m": list(fin.position),
        # Degrees from radians carry a rounding error of 1e-14; twelve digits give back what people wrote.
        "mounting_angle_deg": round(math.degrees(fin.mounting_angle), 12),
        "limits": limits,
        "model": {"type": fin.model.type, **dict(fin.model.parameters)},
    }
    own = {key: getattr(fin.servo, field) for key, field in SERVO_KEYS.items()}
    usual = Servo()
    if servo := {key: value for key, value in own.items() if value != getattr(usual, SERVO_KEYS[key])}:
        data["servo"] = servo
    return data


def _plain(value: Any) -> Any:
    """Lists for tuples, and mappings without what is None."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    return [_plain(item) for item in value] if isinstance(value, tuple) else value
