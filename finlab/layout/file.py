"""Layout files: YAML for people, JSON accepted. Mounting angles in degrees, the rest SI and radians.

Version 2 holds actuators of any type under `actuators`; version 1 holds fins with horizontal shafts under
`fins`, and robots of such fins are written as version 1.

Every error names the file and the key, such as
`layouts/x.yaml: fins[2].limits.amplitude_rad: minimum 0.6 is above maximum 0.05; swap them`.
`layout.schema.json` beside this module is made of the same declarations.
"""

import json
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, to_builtins

from finlab.actuators.actuator import Actuator
from finlab.actuators.kinds import KINDS
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.files.plain_values import yaml_text
from finlab.files.schema import checked, form, shown
from finlab.layout.file_form import BODY, HORIZONTAL_FIN, INTERACTION, Reader, actuator_form, plain, under
from finlab.layout.layout import MAX_ACTUATORS, Layout
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

_OF_A_LAYOUT: dict[str, Any] = {
    "format": Literal["finlab-layout"],
    "body": BODY,
    "frame": Frame,
    "optional": ["frame", "interaction"],
}
_COUNT = Meta(min_length=1, max_length=MAX_ACTUATORS)
LAYOUT_OF_FINS = form(
    Layout,
    {},
    called="LayoutOfFins",
    tag=("version", 1),
    actuators=None,
    axes=None,
    interaction=None,
    fins=Annotated[list[HORIZONTAL_FIN], _COUNT],
    **_OF_A_LAYOUT,
)


def layout_form() -> Any:
    """Returns the form of a layout file: version 1, which holds horizontal fins, or version 2."""
    return _layout_form(tuple(KINDS.values()))


@cache
def _layout_form(kinds: tuple[type[Actuator], ...]) -> Any:
    kind: Any = list[actuator_form(kinds)]  # type: ignore[misc]
    parts = Annotated[kind, _COUNT]
    keys = {"actuators": parts, "interaction": INTERACTION, **_OF_A_LAYOUT}
    return LAYOUT_OF_FINS | form(Layout, {}, tag=("version", 2), **keys)


def parse_layout(
    data: Any, source: str = "layout", folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout that plain values (as read from a file) describe. Raises LayoutError: something is
    missing, unknown or out of range.

    Args:
        data: mappings, lists, numbers and text, as in a layout file.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.
        may_open: whether tables of thrust that it names may be opened; those of fins, and meshes, are not.
    """
    with under(source=source):
        check_version(data, FORMAT, *VERSIONS)
        file = checked(data, layout_form())
        key = VERSIONS[data["version"]]
        reader = Reader(folder, may_open)
        values = {}
        for name in (key, "body", "interaction"):
            with under(name):
                values[name] = reader.value(getattr(file, name, None))
        axes = getattr(file, "axes", None) or AXES
        try:
            about = file.description or "", values["body"], tuple(axes), values["interaction"]
            return Layout(file.name, values[key], *about)
        except LayoutError as error:
            raise LayoutError(error.problem, error.key.replace("actuators[", f"{key}[")) from None


def check_version(data: Any, form: str, *versions: int) -> None:
    """Refuses files of another format or version, in which unknown keys are not the news."""
    if not isinstance(data, Mapping):
        other = "finlab layout convert reads those of other programs"
        raise LayoutError(f"expected a file of keys and values, got {shown(data)}; {other}")
    if data.get("format", form) != form:
        raise LayoutError(f"expected {form}, got {shown(data['format'])}", "format")
    version = data.get("version", versions[0])
    if type(version) is not int or version not in versions:
        known = " and ".join(map(str, versions))
        raise LayoutError(f"this finlab reads version {known}, got {shown(version)}", "version")


def layout_to_dict(layout: Layout) -> dict[str, Any]:
    """Returns the layout as the plain values of a layout file; `parse_layout` gives the same layout back."""
    horizontal = layout.is_of_fins and all(fin.mounting_angle is not None for fin in layout.fins)
    horizontal &= layout.axes == AXES and layout.interaction is None
    version = 1 if horizontal else 2
    data: dict[str, Any] = {"format": FORMAT, "version": version, "name": layout.name}
    if layout.description:
        data["description"] = layout.description
    data["frame"] = dict(FRAME)
    if layout.axes != AXES:
        data["axes"] = list(layout.axes)
    parts = plain(layout.actuators)
    if horizontal:
        data["fins"] = [{key: value for key, value in part.items() if key != "type"} for part in parts]
    else:
        data["actuators"] = parts
    others = {name: getattr(layout, name) for name in ("body", "interaction")}
    return data | {name: plain(part) for name, part in others.items() if part is not None}


def save_layout(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a layout file, JSON if the name ends in `.json`, else YAML; an existing file is replaced whole.
    Raises LayoutError: the file cannot be written."""
    data = layout_to_dict(layout)
    is_json = Path(path).suffix.lower() == ".json"
    write_whole(path, json.dumps(data, indent=2) + "\n" if is_json else yaml_text(data))
