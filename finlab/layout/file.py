"""Layout files, version 1: YAML for people, JSON accepted. Shaft angles in degrees, the rest SI and radians.

Every error names the file and the key, such as
`layouts/x.yaml: fins[2].limits.amplitude_rad: minimum 0.6 is above maximum 0.05; swap them`.
`layout.schema.json` beside this module is made of the same declarations.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, to_builtins

from finlab.errors import LayoutError
from finlab.files.plain_values import yaml_text
from finlab.files.schema import checked, shown
from finlab.layout.body import Body, Hull
from finlab.layout.checked import form, given
from finlab.layout.fin import Fin, FinModelSpec, Limits, Model
from finlab.layout.interaction import Interaction, Jet
from finlab.layout.layout import MAX_FINS, Layout
from finlab.layout.servo import Servo
from finlab.whole_file import write_whole

FORMAT = "finlab-layout"
VERSION = 1


class Frame(Struct, forbid_unknown_fields=True):
    """The only frame there is: x forward, y left, z up; a file may leave it out but not contradict it."""

    convention: Literal["FLU"] = "FLU"
    origin: Literal["center_of_gravity"] = "center_of_gravity"


FRAME = to_builtins(Frame())
"""The frame, as a file says it."""

LIMITS, SERVO = form(Limits), form(Servo)
BODY = form(Body, hull=form(Hull))
INTERACTION = form(Interaction, jets=list[form(Jet)])  # type: ignore[misc]
FIN = form(
    Fin,
    {"position": "position_m", "mounting_angle": "mounting_angle_deg"},
    mounting_angle=Annotated[float, Meta(ge=-360.0, le=360.0)],
    limits=LIMITS,
    model=Model,
    servo=SERVO,
)
LAYOUT = form(
    Layout,
    format=Literal["finlab-layout"],
    version=Literal[1],
    fins=Annotated[list[FIN], Meta(min_length=1, max_length=MAX_FINS)],  # type: ignore[valid-type]
    body=BODY,
    interaction=INTERACTION,
    frame=Frame | None,
)
"""A layout file."""


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
        check_version(data, FORMAT, VERSION)
        file = checked(data, LAYOUT)
        fins = []
        for i, fin in enumerate(file.fins):
            with under(f"fins[{i}]"):
                fins.append(fin_of(fin, math.radians(fin.mounting_angle), folder))
        return layout_of(file, fins, folder)


def fin_of(part: Any, mounting_angle: float, folder: Path | None) -> Fin:
    """Returns the fin in a part of a layout or graph file; relative paths start at a folder."""
    name = part.name
    with under("limits"):
        limits = Limits(**given(part.limits)) if part.limits else Limits()
    model = given(part.model) if part.model else {}
    if "path" in model:
        model["path"] = _absolute(model["path"], folder)
    kind = type(part.model).__struct_config__.tag if part.model else "drag"
    servo = Servo(**given(part.servo)) if part.servo else Servo()
    return Fin(name, part.position, mounting_angle, limits, FinModelSpec(kind, tuple(model.items())), servo)


def layout_of(part: Any, fins: list[Fin], folder: Path | None) -> Layout:
    """Returns the layout of fins, with all that a file says beside them."""
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
    return Layout(part.name, tuple(fins), part.description or "", body, interaction)


@contextmanager
def under(key: str = "", source: str = "") -> Iterator[None]:
    """Puts `key` before the keys of layout errors raised inside, and `source`, their file, before that."""
    try:
        yield
    except LayoutError as error:
        raise error.under(key, source) from None


def check_version(data: Any, form: str, version: int) -> None:
    """Refuses files of another format or version, in which unknown keys are not the news."""
    if not isinstance(data, Mapping):
        raise LayoutError(f"expected keys and values, got {shown(data)}")
    if data.get("format", form) != form:
        raise LayoutError(f"expected {form}, got {shown(data['format'])}", "format")
    found = data.get("version", version)
    if type(found) is not int or found != version:
        raise LayoutError(f"this finlab reads version {version}, got {shown(found)}", "version")


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


def _fin_to_dict(fin: Fin) -> dict[str, Any]:
    data = {
        "name": fin.name,
        "position_m": list(fin.position),
        # Degrees from radians carry a rounding error of 1e-14; twelve digits give back what people wrote.
        "mounting_angle_deg": round(math.degrees(fin.mounting_angle), 12),
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
