"""Layout files: YAML for people, JSON accepted. Mounting angles in degrees, the rest SI and radians.

There is one version, 2, which holds actuators of any type under `actuators`.

Every error names the file and the key, such as
`x.yaml: actuators[2].limits.amplitude_rad of fin 'bow': minimum 0.6 is above maximum 0.05; swap them`.
`layout.schema.json` beside this module is made of the same declarations.
"""

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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
from finlab.layout.file_form import BODY, INTERACTION, Reader, actuator_form, plain, under
from finlab.layout.layout import MAX_ACTUATORS, Layout
from finlab.whole_file import write_whole

FORMAT = "finlab-layout"
VERSION = 2
"""Version of layout files; a reader knows exactly one."""
OF_VERSION_1 = (
    "version 1, with fins:, is no longer read; write version: 2, actuators: in place of fins:, and type: fin "
    "in each of them"
)
"""What a file of fins, as they were written before there was a release, is refused with."""


class Frame(Struct, forbid_unknown_fields=True):
    """The only frame there is: x forward, y left, z up; a file may leave it out but not contradict it."""

    convention: Literal["FLU"] = "FLU"
    origin: Literal["center_of_gravity"] = "center_of_gravity"


FRAME = to_builtins(Frame())
"""The frame, as a file says it."""

_PLACE = re.compile(r"actuators\[(\d+)\]")
_COUNT = Meta(min_length=1, max_length=MAX_ACTUATORS)


def layout_form() -> Any:
    """Returns the form of a layout file."""
    return _layout_form(tuple(KINDS.values()))


@cache
def _layout_form(kinds: tuple[type[Actuator], ...]) -> Any:
    kind: Any = list[actuator_form(kinds)]  # type: ignore[misc]
    return form(
        Layout,
        {},
        format=Literal["finlab-layout"],
        version=Literal[2],
        actuators=Annotated[kind, _COUNT],
        body=BODY,
        interaction=INTERACTION,
        frame=Frame,
        optional=["frame", "interaction"],
    )


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
    with under(source=source), naming_actuators(data):
        _check_version(data)
        file = checked(data, layout_form())
        reader = Reader(folder, may_open)
        values = {}
        for name in ("actuators", "body", "interaction"):
            with under(name):
                values[name] = reader.value(getattr(file, name))
        return Layout(
            name=file.name,
            actuators=values["actuators"],
            description=file.description or "",
            body=values["body"],
            axes=tuple(file.axes or AXES),
            interaction=values["interaction"],
        )


@contextmanager
def naming_actuators(data: Any) -> Iterator[None]:
    """Says in layout errors raised inside which actuator of a file's values they are about."""
    try:
        yield
    except LayoutError as error:
        place = _PLACE.match(error.key)
        try:
            part = data["actuators"][int(place[1])] if place else None
        except (KeyError, IndexError, TypeError):
            part = None
        if not isinstance(part, Mapping) or not isinstance(part.get("name"), str):
            raise
        kind = part.get("type")
        known = kind if isinstance(kind, str) and kind in KINDS else "actuator"
        raise error.about(f"{known} {part['name']!r:.66}") from None


def _check_version(data: Any) -> None:
    """Refuses files of another format or version, in which unknown keys are not the news."""
    if not isinstance(data, Mapping):
        other = "finlab layout convert reads those of other programs"
        raise LayoutError(f"expected a file of keys and values, got {shown(data)}; {other}")
    if data.get("format", FORMAT) != FORMAT:
        raise LayoutError(f"expected {FORMAT}, got {shown(data['format'])}", "format")
    version = data.get("version", VERSION)
    is_int = type(version) is int
    if (is_int and version == 1) or ("fins" in data and "actuators" not in data):
        raise LayoutError(OF_VERSION_1, "version")
    if not is_int or version != VERSION:
        raise LayoutError(f"this finlab reads version {VERSION}, got {shown(version)}", "version")


def layout_to_dict(layout: Layout) -> dict[str, Any]:
    """Returns the layout as the plain values of a layout file; `parse_layout` gives the same layout back."""
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
    """Writes a layout file, JSON if the name ends in `.json`, else YAML; an existing file is replaced whole.
    Raises LayoutError: the file cannot be written."""
    data = layout_to_dict(layout)
    is_json = Path(path).suffix.lower() == ".json"
    write_whole(path, json.dumps(data, indent=2) + "\n" if is_json else yaml_text(data))
