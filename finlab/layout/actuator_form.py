"""Thrusters, azimuths and rudders as parts of a file: forms that are read, and plain values that are written.

What holds degrees in a file is kept in radians; a table of thrust in a CSV file becomes rows.
"""

import math
import os
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from finlab.errors import LayoutError
from finlab.layout.azimuth import Azimuth, Tilt
from finlab.layout.checked import form, given
from finlab.layout.rudder import Rudder
from finlab.layout.thrust_model import MAX_ROWS, PowerLaw, PowerTable, Row, ThrustModel
from finlab.layout.thruster import Thruster

OTHERS: tuple[type[Thruster | Azimuth | Rudder], ...] = (Thruster, Azimuth, Tilt, Rudder)
"""The types of actuator that are no fins."""


class TableForm(Struct, tag="table", tag_field="type", forbid_unknown_fields=True):
    """Force and power over the thruster's own command: rows, or the CSV file that has them."""

    rows: Annotated[list[Row], Meta(min_length=3, max_length=MAX_ROWS)] | None = None
    path: Annotated[str, Meta(min_length=1, max_length=4096, description="a CSV file of thrust")] | None = (
        None
    )
    unit: Annotated[str, Meta(max_length=20)] | None = None


THRUST_MODEL: Any = form(PowerLaw) | TableForm


def form_of(cls: Any, radians: bool = False, **others: Any) -> Any:
    """Returns the form of a type of actuator, with other parts beside its own: in degrees as in a layout
    file, or in radians as in a graph file, which calls the name `id`."""
    kinds: dict[str, Any] = {}
    if not radians:
        kinds = {name: kind for name, (_, kind) in getattr(cls, "DEGREES", {}).items()}
    if cls is not Rudder:
        kinds["model"] = THRUST_MODEL
    return form(cls, _keys(cls, radians), **kinds, **others)


def _keys(cls: Any, radians: bool) -> dict[str, str]:
    """Fields -> their keys in a file, where the two differ."""
    angles = {name: key for name, (key, _) in getattr(cls, "DEGREES", {}).items()}
    if radians:
        angles = {name: key.replace("_deg", "_rad") for name, key in angles.items()} | {"name": "id"}
    return {**cls.KEYS, **angles}


FORMS: dict[str, Any] = {cls.type: form_of(cls) for cls in OTHERS}
"""Type of actuator -> the part of a layout file that describes one."""


def actuator_of(
    part: Any, folder: Path | None = None, radians: bool = False, may_open: bool = True
) -> Thruster | Azimuth | Rudder:
    """Returns the actuator in a part of a file, an instance of what `form_of` makes.

    Args:
        part: the part.
        folder: where relative paths start; the working directory when None.
        radians: whether angles are in radians, as in a graph file.
        may_open: whether a CSV file that the part names may be opened.

    Raises:
        LayoutError: something does not fit; the message names the key.
    """
    cls: Any = next(cls for cls in OTHERS if cls.type == type(part).__struct_config__.tag)
    own = {field.name for field in fields(cls)}
    told = {name: value for name, value in given(part).items() if name in own}
    for name in getattr(cls, "DEGREES", {}):
        if name in told and not radians:
            value = told[name]
            told[name] = math.radians(value) if isinstance(value, float) else tuple(map(math.radians, value))
    if "model" in told:
        try:
            told["model"] = _model_of(told["model"], folder, may_open)
        except LayoutError as error:
            raise error.under("model") from None
    actuator: Thruster | Azimuth | Rudder = cls(**told)
    return actuator


def _model_of(part: Any, folder: Path | None, may_open: bool) -> ThrustModel:
    if not isinstance(part, TableForm):
        return PowerLaw(**given(part))
    if (part.rows is None) == (part.path is None):
        raise LayoutError("give either rows, or the path of a CSV file, not both or neither", "rows")
    if part.path is not None:
        if not may_open:
            raise LayoutError("names a file, which is not opened here; write its rows", "path")
        return PowerTable.read(os.path.normpath((folder or Path.cwd()) / part.path), part.unit or "")
    return PowerTable(tuple(part.rows or ()), part.unit or "")


def actuator_to_dict(actuator: Thruster | Azimuth | Rudder, radians: bool = False) -> dict[str, Any]:
    """Returns the plain values of an actuator in a file; `actuator_of` gives the same one back."""
    degrees = {} if radians else getattr(actuator, "DEGREES", {})
    keys = _keys(type(actuator), radians)
    data: dict[str, Any] = {keys.get("name", "name"): actuator.name, "type": actuator.type}
    for field in fields(actuator):
        value = getattr(actuator, field.name)
        if field.name == "name" or (field.default is not MISSING and value == field.default):
            continue
        if field.name in degrees:
            value = degrees_of(value)
        data[keys.get(field.name, field.name)] = value
        if field.name == "model":
            data["model"] = _model_to_dict(value)
        elif isinstance(value, tuple):
            data[keys.get(field.name, field.name)] = list(value)
    return data


def degrees_of(value: Any) -> Any:
    """Returns degrees of radians [rad], one or a tuple: twelve digits give back what people wrote; where they
    do not, more are taken, so that reading gives the same radians."""
    if isinstance(value, tuple):
        return tuple(map(degrees_of, value))
    exact = math.degrees(value)
    near = (round(exact, 12), exact, math.nextafter(exact, math.inf), math.nextafter(exact, -math.inf))
    return next((angle for angle in near if math.radians(angle) == value), near[0])


def _model_to_dict(model: ThrustModel) -> dict[str, Any]:
    told = {
        field.name: getattr(model, field.name)
        for field in fields(model)
        if getattr(model, field.name) != field.default
    }
    if isinstance(model, PowerTable):
        told["rows"] = [list(row) for row in model.rows]
    return {"type": model.type, **told}
