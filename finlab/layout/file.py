"""Layout files: YAML for people, JSON accepted. Mounting angles in degrees, the rest SI and radians.

Version 2 holds actuators of any type under `actuators`; version 1 holds fins with horizontal shafts under
`fins`, and robots of such fins are written as version 1.

Every error names the file and the key, such as
`layouts/x.yaml: fins[2].limits.amplitude_rad: minimum 0.6 is above maximum 0.05; swap them`.
`layout.schema.json` beside this module is made of the same declarations.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal, Union

from msgspec import Meta, Struct, to_builtins

from finlab.errors import LayoutError
from finlab.files.plain_values import yaml_text
from finlab.files.schema import checked, shown
from finlab.layout.actuator import Actuator
from finlab.layout.actuator_form import FORMS, degrees_of
from finlab.layout.actuator_form import actuator_of as other_actuator_of
from finlab.layout.actuator_form import actuator_to_dict as other_actuator_to_dict
from finlab.layout.body import Body, Hull
from finlab.layout.checked import form, given
from finlab.layout.fin import Fin, FinModelSpec, Limits, Model
from finlab.layout.interaction import Interaction, Jet
from finlab.layout.layout import MAX_ACTUATORS, Layout
from finlab.layout.servo import Servo
from finlab.whole_file import write_whole

FORMAT = "finlab-layout"
VERSIONS = {1: "fins", 2: "actuators"}
"""Versions of layout files that are read, and the key of the actuators in each."""


class Frame(Struct, forbid_unknown_fields=True):
    """The only frame there is: x forward, y left, z up; a file may leave it out but not contradict it."""

    convention: Literal["FLU"] = "FLU"
    origin: Literal["center_of_gravity"] = "center_of_gravity"


FRAME = to_builtins(Frame())
"""The frame, as a file says it."""

LIMITS, SERVO = form(Limits), form(Servo)
BODY = form(Body, hull=form(Hull))
INTERACTION = form(Interaction, jets=list[form(Jet)])  # type: ignore[misc]
POSITION, ANGLE = {"position": "position_m"}, {"mounting_angle": "mounting_angle_deg"}
_OF_A_FIN: dict[str, Any] = {
    "mounting_angle": Annotated[float, Meta(ge=-360.0, le=360.0)],
    "limits": LIMITS,
    "model": Model,
    "servo": SERVO,
}
FIN = form(
    Fin,
    POSITION | ANGLE,
    called="HorizontalFin",
    tag=(),
    required=["mounting_angle"],
    shaft=None,
    zero=None,
    **_OF_A_FIN,
)
ACTUATOR: Any = Union[form(Fin, POSITION | ANGLE, **_OF_A_FIN), *FORMS.values()]  # noqa: UP007
_OF_A_LAYOUT: dict[str, Any] = {
    "format": Literal["finlab-layout"],
    "body": BODY,
    "interaction": INTERACTION,
    "frame": Frame,
    "optional": ["frame"],
}
_COUNT = Meta(min_length=1, max_length=MAX_ACTUATORS)
LAYOUT_OF_FINS = form(
    Layout,
    {},
    called="LayoutOfFins",
    tag=("version", 1),
    actuators=None,
    fins=Annotated[list[FIN], _COUNT],  # type: ignore[valid-type]
    **_OF_A_LAYOUT,
)
LAYOUT = form(
    Layout,
    {},
    tag=("version", 2),
    actuators=Annotated[list[ACTUATOR], _COUNT],
    **_OF_A_LAYOUT,
)
ANY_LAYOUT: Any = LAYOUT_OF_FINS | LAYOUT
"""A layout file: version 1, which holds horizontal fins, or version 2."""


def parse_layout(
    data: Any, source: str = "layout", folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout that plain values (as read from a file) describe.

    Args:
        data: mappings, lists, numbers and text, as in a layout file.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.
        may_open: whether tables of thrust that it names may be opened; those of fins, and meshes, are not.

    Raises:
        LayoutError: something is missing, unknown or out of range.
    """
    with under(source=source):
        check_version(data, FORMAT, *VERSIONS)
        file = checked(data, ANY_LAYOUT)
        key = VERSIONS[data["version"]]
        parts = []
        for i, part in enumerate(getattr(file, key)):
            with under(f"{key}[{i}]"):
                parts.append(actuator_of(part, folder, may_open))
        try:
            return layout_of(file, parts, folder)
        except LayoutError as error:
            raise LayoutError(error.problem, error.key.replace("actuators[", f"{key}[")) from None


def actuator_of(part: Any, folder: Path | None, may_open: bool) -> Actuator:
    """Returns the actuator in a part of a layout file; relative paths start at a folder."""
    if type(part) in FORMS.values():
        return other_actuator_of(part, folder, may_open=may_open)
    angle = part.mounting_angle
    return fin_of(part, None if angle is None else math.radians(angle), folder)


def fin_of(part: Any, mounting_angle: float | None, folder: Path | None) -> Fin:
    """Returns the fin in a part of a layout or graph file; relative paths start at a folder."""
    with under("limits"):
        limits = Limits(**given(part.limits)) if part.limits else Limits()
    model = given(part.model) if part.model else {}
    if "path" in model:
        model["path"] = _absolute(model["path"], folder)
    kind = type(part.model).__struct_config__.tag if part.model else "drag"
    servo = Servo(**given(part.servo)) if part.servo else Servo()
    spec = FinModelSpec(kind, tuple(model.items()))
    shaft, zero = getattr(part, "shaft", None), getattr(part, "zero", None)
    return Fin(part.name, part.position, mounting_angle, limits, spec, servo, shaft, zero)


def layout_of(part: Any, actuators: Sequence[Actuator], folder: Path | None) -> Layout:
    """Returns the layout of actuators, with all that a file says beside them."""
    body = interaction = None
    if part.body:
        told = given(part.body)
        with under("body.hull"):
            if "hull" in told:
                hull = given(told["hull"])
                if "mesh" in hull:
                    hull["mesh"] = _absolute(hull["mesh"], folder)
                told["hull"] = Hull(**hull)
        body = Body(**told)
    if part.interaction:
        told = given(part.interaction)
        jets = []
        for i, jet in enumerate(told.get("jets", ())):
            with under(f"interaction.jets[{i}]"):
                jets.append(Jet(**given(jet)))
        with under("interaction"):
            interaction = Interaction(**{**told, "jets": tuple(jets)})
    return Layout(part.name, tuple(actuators), part.description or "", body, interaction)


@contextmanager
def under(key: str = "", source: str = "") -> Iterator[None]:
    """Puts `key` before the keys of layout errors raised inside, and `source`, their file, before that."""
    try:
        yield
    except LayoutError as error:
        raise error.under(key, source) from None


def check_version(data: Any, form: str, *versions: int) -> None:
    """Refuses files of another format or version, in which unknown keys are not the news."""
    if not isinstance(data, Mapping):
        raise LayoutError(f"expected keys and values, got {shown(data)}")
    if data.get("format", form) != form:
        raise LayoutError(f"expected {form}, got {shown(data['format'])}", "format")
    found = data.get("version", versions[0])
    if type(found) is not int or found not in versions:
        known = " and ".join(map(str, versions))
        raise LayoutError(f"this finlab reads version {known}, got {shown(found)}", "version")


def layout_to_dict(layout: Layout) -> dict[str, Any]:
    """Returns the layout as the plain values of a layout file; `parse_layout` gives the same layout back."""
    horizontal = all(isinstance(part, Fin) and part.mounting_angle is not None for part in layout.actuators)
    version = 1 if horizontal else 2
    data: dict[str, Any] = {"format": FORMAT, "version": version, "name": layout.name}
    if layout.description:
        data["description"] = layout.description
    data["frame"] = dict(FRAME)
    if horizontal:
        data["fins"] = [fin_to_dict(fin) for fin in layout.fins]
    else:
        data["actuators"] = [_actuator_to_dict(part) for part in layout.actuators]
    if layout.body is not None:
        data["body"] = _plain(asdict(layout.body))
    if layout.interaction is not None:
        data["interaction"] = _plain(asdict(layout.interaction))
    return data


def save_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a layout file, JSON if the name ends in `.json`, else YAML; an existing file is replaced whole.

    Raises:
        LayoutError: the file cannot be written.
    """
    data = layout_to_dict(layout)
    is_json = Path(path).suffix.lower() == ".json"
    write_whole(path, json.dumps(data, indent=2) + "\n" if is_json else yaml_text(data))


def _absolute(path: str, folder: Path | None) -> str:
    return os.path.normpath((folder or Path.cwd()) / path)


def _actuator_to_dict(part: Actuator) -> dict[str, Any]:
    if not isinstance(part, Fin):
        return other_actuator_to_dict(part)
    data = fin_to_dict(part)
    return {"name": data.pop("name"), "type": part.type, **data}


def fin_to_dict(fin: Fin) -> dict[str, Any]:
    """Returns the plain values of a fin in a file, without its type."""
    if fin.mounting_angle is not None:
        direction: dict[str, Any] = {"mounting_angle_deg": degrees_of(fin.mounting_angle)}
    else:
        direction = {"shaft": list(fin.shaft or ()), "zero": list(fin.zero or ())}
    data = {
        "name": fin.name,
        "position_m": list(fin.position),
        **direction,
        "limits": {key: list(getattr(fin.limits, name)) for name, key in Limits.KEYS.items()},
        "model": {"type": fin.model.type, **dict(fin.model.parameters)},
    }
    servo, usual = asdict(fin.servo), asdict(Servo())
    own = {key: servo[name] for name, key in Servo.KEYS.items() if servo[name] != usual[name]}
    return data | ({"servo": own} if own else {})


def _plain(value: Any) -> Any:
    """Lists for tuples, and mappings without what is None."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    return [_plain(item) for item in value] if isinstance(value, tuple) else value
