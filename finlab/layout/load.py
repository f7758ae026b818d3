"""Layouts read from what a user may name: a shipped layout, a layout or graph file, a bundle.

Layout files are YAML for people, JSON accepted. Mounting angles are in degrees, the rest is SI and
radians. There is one version, 2, which holds actuators of any type under `actuators`. What holds
degrees in a file is kept in radians; paths become absolute; a table of thrust in a CSV file becomes
rows.

Every error names the file and the key, such as `x.yaml: actuators[2].limits.amplitude_rad of fin
'bow': minimum 0.6 is above maximum 0.05; swap them`. `layout.schema.json` beside this module is
made of the same declarations.
"""

import math
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cache, reduce
from operator import or_
from pathlib import Path
from pkgutil import resolve_name
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_type_hints

from msgspec import Meta, Struct, structs, to_builtins

from finlab.actuators.actuator import Actuator
from finlab.actuators.kinds import KINDS
from finlab.assets import shipped_layouts
from finlab.axes import AXES
from finlab.errors import LayoutError, layout_errors_at
from finlab.files import parse_json, parse_yaml
from finlab.files.guarded import read_text
from finlab.files.schema import Checked, Part, checked, form, shown
from finlab.layout.layout import MAX_ACTUATORS, Layout

FORMAT = "finlab-layout"
VERSION = 2
"""Version of layout files; a reader knows exactly one."""
OF_VERSION_1 = (
    "version 1, with fins:, is no longer read; write version: 2, actuators: in place of fins:, "
    "and type: fin in each of them"
)
"""What a file of fins, as they were written before there was a release, is refused with."""
MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""
A_LAYOUT = "a layout file (.yaml or .json)"
LAYOUT_SUFFIXES = (".yaml", ".yml", ".json")


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (JSON); a bundle is a folder or zip
    archive made by `finlab export`. A bare name is never looked up in the current folder while a
    layout of that name is shipped; write `./A` for a file called `A` there. Relative paths inside a
    layout file (a force table, a hull mesh) are taken from the file's own folder.

    Raises LayoutError: the file cannot be read or is not a valid layout; the message names file and
    key; DataError: the bundle cannot be read, or was changed.
    """
    return layout_and_lost(layout)[0]


def layout_and_lost(layout: str | os.PathLike[str]) -> tuple[Layout, tuple[str, ...]]:
    """Returns a layout as `load_layout` opens it, with its errors, and the names of the actuators
    that a bundle marks as lost; none of a file."""
    file = layout_path(layout)
    source = str(layout)
    if file.suffix not in LAYOUT_SUFFIXES or os.path.isdir(file):
        from finlab.bundle_files import is_bundle, read_bundle_files
        from finlab.layout.bundled_robot import robot_of

        if is_bundle(file):
            robot = robot_of(read_bundle_files(file), source, parse_layout)
            return robot.layout, robot.lost
    content = read_text(file, MAX_BYTES, A_LAYOUT, LayoutError)
    return layout_in(content, file.suffix, source, file.resolve().parent), ()


def layout_in(
    text: str, suffix: str, source: str, folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout in the text of a file whose name ends in `suffix`; the rest as for
    `parse_layout`. Raises LayoutError: it is no JSON or YAML, or no layout."""
    parse = parse_json if suffix.lower() == ".json" else parse_yaml
    data = parse(text, source, LayoutError)
    if is_graph(data):
        from finlab.layout.graph_file import layout_in_graph

        with layout_errors_at(source=source):
            data = layout_in_graph(data)
    return parse_layout(data, source, folder, may_open=may_open)


def is_graph(data: Any) -> bool:
    """Whether plain values are those of a layout graph file."""
    about = data.get("graph") if isinstance(data, dict) else None
    return isinstance(about, dict) and about.get("format") == "finlab-graph"


def layout_path(layout: str | os.PathLike[str]) -> Path:
    """Returns the path that a user means: text may be the name of a shipped layout, a `Path` is
    always a path. Raises LayoutError: there is neither a shipped layout nor anything else of this
    name."""
    if not isinstance(layout, str):
        return Path(layout)
    shipped = shipped_layouts()
    if layout in shipped:
        return shipped[layout]
    path = Path(layout)
    try:
        if path.exists():
            return path
    except (OSError, ValueError) as error:  # a name that is too long, or holds a NUL byte
        reason = getattr(error, "strerror", None) or error
        raise LayoutError(f"layout {layout[:80]!r} cannot be a path: {reason}") from error
    raise LayoutError(
        f"layout {layout!r} is neither a file nor a shipped layout; shipped are "
        f"{', '.join(shipped) or 'none'}"
    )


class Frame(Struct, forbid_unknown_fields=True):
    """The only frame there is: x forward, y left, z up; a file may leave it out but not contradict
    it."""

    convention: Literal["FLU"] = "FLU"
    origin: Literal["center_of_gravity"] = "center_of_gravity"


FRAME = to_builtins(Frame())
"""The frame, as a file says it."""

_PLACE = re.compile(r"actuators\[(\d+)\]")
_COUNT = Meta(min_length=1, max_length=MAX_ACTUATORS)


def layout_form() -> Any:
    """Returns the form of a layout file."""
    return _layout_form(tuple(KINDS.values()), True, _interactions(None))


def form_for(data: Mapping[str, Any]) -> Any:
    """Returns the form of a layout file with what its plain values name alone: its kinds of
    actuator, its interaction. It says the same of these values as that of all layout files, and
    what they do not name is not imported."""
    interaction = data.get("interaction")
    interactions = () if interaction is None else _interactions(_type_of(interaction))
    return _layout_form(
        _kinds_among(data.get("actuators")), data.get("body") is not None, interactions
    )


def _type_of(part: Any) -> Any:
    """What a part of a file has under the key `type`, where it has keys."""
    return part.get("type") if isinstance(part, Mapping) else None


def _kinds_among(parts: Any) -> tuple[type[Actuator], ...]:
    """The kinds of the actuators in a file; all that there are, to choose from, where one is of
    none."""
    names = [_type_of(part) for part in parts] if isinstance(parts, list | tuple) else []
    if not names or not all(isinstance(name, str) and name in KINDS for name in names):
        return tuple(KINDS.values())
    return tuple(KINDS[name] for name in dict.fromkeys(names))


def _interactions(name: Any) -> tuple[Any, ...]:
    """The class of an interaction by the type that a file gives; all that there are where it is
    none."""
    from finlab.interaction import INTERACTIONS

    names = (name,) if isinstance(name, str) and name in INTERACTIONS else tuple(INTERACTIONS)
    return tuple(resolve_name(INTERACTIONS[name]) for name in names)


@cache
def _layout_form(
    kinds: tuple[type[Actuator], ...], has_body: bool, interactions: tuple[Any, ...]
) -> Any:
    """The form of a layout file with some kinds of actuator, with or without a body, and some
    interactions."""
    part: Any = actuator_form(kinds)
    body: Any = NoneType
    if has_body:
        from finlab.layout.body import Body

        body = part_form(Body)
    return form(
        Layout,
        {},
        format=Literal["finlab-layout"],
        version=Literal[2],
        actuators=Annotated[list[part], _COUNT],
        body=body,
        interaction=_union([part_form(one) for one in interactions]),
        frame=Frame,
        optional=["frame", "interaction"],
    )


@cache
def actuator_form(kinds: tuple[type[Actuator], ...]) -> Any:
    """Returns the form of an actuator, one of several kinds."""
    return _union([part_form(kind) for kind in kinds])


@cache
def part_form(cls: type[Checked]) -> Any:
    """Returns the form of the part of a file that a class stands for: its angles are in degrees,
    and its parts have forms of their own."""
    keys = {name: key for name, (key, _) in cls.DEGREES.items()}
    kinds = {name: kind for name, (_, kind) in cls.DEGREES.items()}
    hints = get_type_hints(cls)
    for field in fields(cls):
        own = _part_form(hints[field.name])
        if own is not None:
            kinds[field.name] = own
    kinds |= dict.fromkeys(cls.UNSAID)
    return form(cls, {**cls.KEYS, **keys}, **kinds)


def _part_form(hint: Any) -> Any:
    """The form of what a field holds, where that is a part of its own in a file, or one of several;
    else None."""
    parts = [part for part in get_args(hint) or (hint,) if part is not NoneType]
    if not all(isinstance(part, type) and issubclass(part, Part | Checked) for part in parts):
        return None
    return _union(
        [part.file_form() if issubclass(part, Part) else part_form(part) for part in parts]
    )


def _union(kinds: list[Any]) -> Any:
    """One of several types; nothing but null of none."""
    return reduce(or_, kinds) if kinds else NoneType


@dataclass(frozen=True)
class Reader:
    """Makes values of parts of a file."""

    folder: Path | None = None
    """Where relative paths start; the working directory when None."""
    may_open: bool = True
    """Whether a CSV file of thrust that a part names may be opened."""

    def value(self, part: Any) -> Any:
        """Returns what a part stands for, an instance of a form, a list of them, or a plain value.
        Raises LayoutError: something does not fit; the message names the key in the part."""
        if isinstance(part, list | tuple):
            items = []
            for i, item in enumerate(part):
                with layout_errors_at(f"[{i}]"):
                    items.append(self.value(item))
            return tuple(items)
        if not isinstance(part, Struct):
            return part
        values = {}
        for field in structs.fields(part):
            value = getattr(part, field.name)
            if value is not None:
                with layout_errors_at(field.encode_name):
                    values[field.name] = self.value(value)
        for key in {"path", "mesh"} & set(values):
            values[key] = os.path.normpath((self.folder or Path.cwd()) / values[key])
        cls: Any = vars(type(part))["stands_for"]
        if issubclass(cls, Part):
            return cls.from_file(str(part.__struct_config__.tag), values, self.may_open)
        for name in set(cls.DEGREES) & set(values):
            value = values[name]
            values[name] = (
                tuple(map(math.radians, value)) if isinstance(value, tuple) else math.radians(value)
            )
        try:
            return cls(**values)
        except LayoutError as error:
            key = cls.file_key(error.key)
            raise LayoutError(error.problem, key, error.source, error.actuator) from None


def parse_layout(
    data: Any, source: str = "layout", folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout that plain values (as read from a file) describe. Raises LayoutError:
    something is missing, unknown or out of range.

    Args:
        data: mappings, lists, numbers and text, as in a layout file.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.
        may_open: whether tables of thrust that it names may be opened; those of fins, and meshes,
        are not.
    """
    with layout_errors_at(source=source), naming_actuators(data):
        _check_version(data)
        file = checked(data, form_for(data))
        reader = Reader(folder, may_open)
        values = {}
        for name in ("actuators", "body", "interaction"):
            with layout_errors_at(name):
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
        raise error.with_actuator(f"{known} {part['name']!r:.66}") from None


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
