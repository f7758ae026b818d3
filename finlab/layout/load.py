"""Layouts read from what a user may name: a shipped layout, a layout or graph file, a bundle.

Layout files are YAML for people, JSON accepted. Mounting angles are in degrees, the rest is SI and
radians. There is one version, 2, which holds actuators of any type under `actuators`. What holds
degrees in a file is kept in radians; paths become absolute; a table of thrust in a CSV file becomes
rows.

A file is read in three steps: text to plain values (mappings, lists, numbers), plain values to
`msgspec.Struct`s that check keys and types, here called forms, and forms to the frozen dataclasses
of a `Layout`. A form is made of the dataclass that its part of the file stands for.

Every error names the file and the key, such as `x.yaml: actuators[2].limits.amplitude_rad of fin
'bow': minimum 0.6 is above maximum 0.05; swap them`. `layout.schema.json` beside this module is
made of the same declarations.
"""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
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
from finlab.files.schema import Checked, Name, Part, checked, form, is_class, shown
from finlab.layout.layout import MAX_ACTUATORS, Bus, Layout, MirrorPair

FORMAT = "finlab-layout"
"""Value of the key `format` in a layout file."""
VERSION = 2
"""Version of layout files; a reader knows exactly one."""
VERSION_1_REFUSED = (
    "version 1, with fins:, is no longer read; write version: 2, actuators: in place of fins:, "
    "and type: fin in each of them"
)
"""Message for files of fins, as they were written before there was a release."""
MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""
EXPECTED_LAYOUT_FILE = "a layout file (.yaml or .json)"
"""What messages say was expected of a file that cannot be read."""
LAYOUT_SUFFIXES = (".yaml", ".yml", ".json")
"""Ends of the names of layout files."""


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (JSON); a bundle is a folder or zip
    archive made by `finlab export`. A bare name is never looked up in the current folder while a
    layout of that name is shipped; write `./A` for a file called `A` there. Relative paths inside a
    layout file (a force table, a hull mesh) are taken from the file's own folder.

    Args:
        layout: name of a shipped layout, or path of a file or bundle; a `Path` is always a path.

    Raises:
        LayoutError: the file cannot be read or is not a valid layout; the message names file and
            key.
        DataError: the bundle cannot be read, or was changed.
    """
    return load_layout_and_lost(layout)[0]


def load_layout_and_lost(layout: str | os.PathLike[str]) -> tuple[Layout, tuple[str, ...]]:
    """Returns a layout, and the actuators that its file says are lost.

    Args:
        layout: as for `load_layout`.

    Returns:
        The layout with all its actuators, and the names of those that a bundle marks as lost; none
        of a layout or graph file.

    Raises:
        LayoutError: as for `load_layout`.
        DataError: as for `load_layout`.
    """
    file = layout_path(layout)
    source = str(layout)
    if file.suffix not in LAYOUT_SUFFIXES or os.path.isdir(file):
        from finlab.bundle_files import is_bundle, read_bundle_files
        from finlab.layout.bundled_robot import robot_of

        if is_bundle(file):
            robot = robot_of(read_bundle_files(file), source, parse_layout)
            return robot.layout, robot.lost
    content = read_text(file, MAX_BYTES, EXPECTED_LAYOUT_FILE, LayoutError)
    return parse_layout_text(content, file.suffix, source, file.resolve().parent), ()


def parse_layout_text(
    text: str, suffix: str, source: str, folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout in the text of a layout or graph file.

    Args:
        text: content of the file.
        suffix: end of the file's name, which says whether it is JSON or YAML.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.
        may_open: as for `parse_layout`.

    Raises:
        LayoutError: it is no JSON or YAML, or no layout.
    """
    parse = parse_json if suffix.lower() == ".json" else parse_yaml
    data = parse(text, source, LayoutError)
    if is_graph_data(data):
        from finlab.layout.graph_file import layout_data_in_graph

        with layout_errors_at(source=source):
            data = layout_data_in_graph(data)
    return parse_layout(data, source, folder, may_open=may_open)


def is_graph_data(data: Any) -> bool:
    """Returns whether plain values are those of a layout graph file."""
    graph = data.get("graph") if isinstance(data, dict) else None
    return isinstance(graph, dict) and graph.get("format") == "finlab-graph"


def layout_path(layout: str | os.PathLike[str]) -> Path:
    """Returns the path that a user means.

    Args:
        layout: text may be the name of a shipped layout; a `Path` is always a path.

    Raises:
        LayoutError: there is neither a shipped layout nor anything else of this name.
    """
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


Z_DOWN = ("FRD", "NED")
"""Other names of frames in files, of which it is told how they become FLU."""
FRAME = to_builtins(Frame())
"""The frame, as a file says it."""

_ACTUATOR_PATH = re.compile(r"actuators\[(\d+)\]")
"""Where the path of a key of an actuator begins; its group is the index."""
_ACTUATOR_COUNT = Meta(min_length=1, max_length=MAX_ACTUATORS)
"""How many actuators a layout file may list."""


def layout_form() -> Any:
    """Returns the form of all layout files, of which the JSON Schema is made."""
    return _layout_form(tuple(KINDS.values()), True, _interactions(None))


def layout_form_for(data: Mapping[str, Any]) -> Any:
    """Returns a form that is enough for one layout file.

    It has the kinds of actuator and the interaction that the file names, and says the same of them
    as `layout_form`. What the file does not name is not imported.

    Args:
        data: plain values of the file.
    """
    interaction = data.get("interaction")
    interactions = () if interaction is None else _interactions(_type_of(interaction))
    kinds = _kinds_in(data.get("actuators"))
    return _layout_form(kinds, data.get("body") is not None, interactions)


def _type_of(part: Any) -> Any:
    """The value under the key `type` of a part of a file; None where it has no keys."""
    return part.get("type") if isinstance(part, Mapping) else None


def _kinds_in(parts: Any) -> tuple[type[Actuator], ...]:
    """The kinds of the actuators in a file. All kinds where one of them has none that is known, so
    that the message lists all."""
    names = [_type_of(part) for part in parts] if isinstance(parts, list | tuple) else []
    if not names or not all(isinstance(name, str) and name in KINDS for name in names):
        return tuple(KINDS.values())
    return tuple(KINDS[name] for name in dict.fromkeys(names))


def _interactions(name: Any) -> tuple[Any, ...]:
    """The class of an interaction by the type that a file gives. All classes where that is no known
    one, so that the message lists all."""
    from finlab.interaction import INTERACTIONS

    names = (name,) if isinstance(name, str) and name in INTERACTIONS else tuple(INTERACTIONS)
    return tuple(resolve_name(INTERACTIONS[name]) for name in names)


@cache
def _layout_form(
    kinds: tuple[type[Actuator], ...], has_body: bool, interactions: tuple[Any, ...]
) -> Any:
    """The form of layout files.

    Args:
        kinds: classes of the actuators that they may list.
        has_body: whether they may have a body.
        interactions: classes of the interactions that they may have.
    """
    actuator: Any = actuator_form(kinds)
    body: Any = NoneType
    if has_body:
        from finlab.layout.body import Body

        body = part_form(Body)
    return form(
        Layout,
        {},
        format=Literal["finlab-layout"],
        version=Literal[2],
        actuators=Annotated[list[actuator], _ACTUATOR_COUNT],
        body=body,
        interaction=_union([part_form(interaction) for interaction in interactions]),
        buses=dict[Name, form(Bus, {}, name=None)],  # type: ignore[misc]
        frame=Frame,
        optional=["frame", "interaction"],
    )


@cache
def actuator_form(kinds: tuple[type[Actuator], ...]) -> Any:
    """Returns the form of an actuator, one of several kinds."""
    return _union([part_form(kind) for kind in kinds])


@cache
def part_form(cls: type[Checked]) -> Any:
    """Returns the form of the part of a file that a class stands for.

    Its angles are in degrees, and the parts in it have forms of their own.
    """
    keys = {}
    kinds = {}
    for name, (key, kind) in cls.DEGREES.items():
        keys[name] = key
        kinds[name] = kind
    hints = get_type_hints(cls)
    for field in fields(cls):
        field_form = _form_of_field(hints[field.name])
        if field_form is not None:
            kinds[field.name] = field_form
    kinds |= dict.fromkeys(cls.UNSAID)
    return form(cls, {**cls.KEYS, **keys}, **kinds)


def _form_of_field(hint: Any) -> Any:
    """The form of what a field holds, by its type, where that is a part of its own in a file, or
    one of several; None of plain values."""
    classes = [cls for cls in get_args(hint) or (hint,) if cls is not NoneType]
    if not all(is_class(cls) and issubclass(cls, Part | Checked) for cls in classes):
        return None
    forms = []
    for cls in classes:
        forms.append(cls.file_form() if issubclass(cls, Part) else part_form(cls))
    return _union(forms)


def _union(kinds: list[Any]) -> Any:
    """The union of several types; that of null where there is none."""
    return reduce(or_, kinds) if kinds else NoneType


@dataclass(frozen=True)
class PartReader:
    """Turns checked parts of a file, instances of forms, into what they stand for."""

    folder: Path | None = None
    """Where relative paths start; the working directory when None."""
    may_open: bool = True
    """Whether a CSV file of thrust that a part names may be opened."""

    def value(self, part: Any) -> Any:
        """Returns what a part stands for.

        Args:
            part: an instance of a form, a list of them, or a plain value.

        Raises:
            LayoutError: something does not fit; the message names the key in the part.
        """
        if isinstance(part, list | tuple):
            items = []
            for i, item in enumerate(part):
                with layout_errors_at(f"[{i}]"):
                    items.append(self.value(item))
            return tuple(items)
        if not isinstance(part, Struct):
            return part
        values = self._field_values(part)
        cls: Any = vars(type(part))["stands_for"]
        if issubclass(cls, Part):
            return cls.from_file(str(part.__struct_config__.tag), values, self.may_open)
        for name in set(cls.DEGREES) & set(values):
            values[name] = _radians(values[name])
        try:
            return cls(**values)
        except LayoutError as error:
            key = cls.file_key(error.key)
            raise LayoutError(error.problem, key, error.source, error.actuator) from None

    def _field_values(self, part: Struct) -> dict[str, Any]:
        """Values by field of a form, without those that the file leaves out; paths are absolute."""
        values = {}
        for field in structs.fields(part):
            value = getattr(part, field.name)
            if value is not None:
                with layout_errors_at(field.encode_name):
                    values[field.name] = self.value(value)
        for key in {"path", "mesh"} & set(values):
            values[key] = os.path.normpath((self.folder or Path.cwd()) / values[key])
        return values


def _radians(degrees: Any) -> Any:
    """Radians of degrees, a number or a tuple of such."""
    if isinstance(degrees, tuple):
        return tuple(map(_radians, degrees))
    return math.radians(degrees)


def parse_layout(
    data: Any, source: str = "layout", folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout that plain values, as read from a file, describe.

    Args:
        data: mappings, lists, numbers and text, as in a layout file.
        source: what to call it in error messages.
        folder: where relative paths start; the working directory when None.
        may_open: whether tables of thrust that it names may be opened; those of fins, and meshes,
            are not.

    Raises:
        LayoutError: something is missing, unknown or out of range.
    """
    with layout_errors_at(source=source), naming_actuators(data):
        _check_version(data)
        file = checked(data, layout_form_for(data))
        reader = PartReader(folder, may_open)
        values = {}
        for name in ("actuators", "body", "interaction"):
            with layout_errors_at(name):
                values[name] = reader.value(getattr(file, name))
        actuators = _with_slipstreams(values["actuators"])
        return Layout(
            name=file.name,
            actuators=actuators,
            description=file.description or "",
            body=values["body"],
            axes=tuple(file.axes or AXES),
            interaction=values["interaction"],
            power_w=file.power_w,
            buses=_buses(file.buses or {}, actuators),
            mirror_pairs=_mirror_pairs(file.mirror_pairs or (), actuators),
        )


def _with_slipstreams(actuators: tuple[Actuator, ...]) -> tuple[Actuator, ...]:
    """The actuators of a file, each propeller and the rudder in its slipstream as one."""
    types = {actuator.type for actuator in actuators}
    if not types >= {"thruster", "rudder"}:
        return actuators
    from finlab.layout.slipstream import joined

    return joined(actuators)


def _buses(buses: Mapping[str, Any], actuators: Sequence[Actuator]) -> tuple[Bus, ...]:
    """The buses of a file, without parts of actuators: a rudder in a slipstream takes no power."""
    parts = {part for actuator in actuators for part in actuator.parts}
    result = []
    for name, bus in buses.items():
        fed = tuple(actuator for actuator in bus.actuators if actuator not in parts)
        if fed:
            with layout_errors_at("buses"):
                result.append(Bus(name, bus.power_w, fed))
    return tuple(result)


def _mirror_pairs(
    pairs: Sequence[MirrorPair], actuators: Sequence[Actuator]
) -> tuple[MirrorPair, ...]:
    """The mirror pairs of a file, with an actuator in the place of its parts; each pair once."""
    holders = {}
    for actuator in actuators:
        for part in actuator.parts:
            holders[part] = actuator.name
    if not holders:
        return tuple(pairs)
    result: dict[frozenset[str], MirrorPair] = {}
    for first, second in pairs:
        pair = holders.get(first, first), holders.get(second, second)
        result.setdefault(frozenset(pair), pair)
    return tuple(result.values())


@contextmanager
def naming_actuators(data: Any) -> Iterator[None]:
    """Adds to layout errors that are raised inside the type and name of the actuator that they are
    about.

    Args:
        data: plain values of the layout file that is read inside.
    """
    try:
        yield
    except LayoutError as error:
        actuator = _actuator_at(error.key, data)
        if not isinstance(actuator, Mapping) or not isinstance(actuator.get("name"), str):
            raise
        kind = actuator.get("type")
        is_known = isinstance(kind, str) and kind in KINDS
        type_name = kind if is_known else "actuator"
        raise error.for_actuator(f"{type_name} {actuator['name']!r:.66}") from None


def _actuator_at(key: str, data: Any) -> Any:
    """Plain values of the actuator to which a key of a file belongs; None of any other key."""
    match = _ACTUATOR_PATH.match(key)
    if match is None:
        return None
    try:
        return data["actuators"][int(match[1])]
    except (KeyError, IndexError, TypeError):
        return None


def _check_version(data: Any) -> None:
    """Refuses files of another format or version, before their unknown keys are. Raises
    LayoutError."""
    if not isinstance(data, Mapping):
        raise LayoutError(
            f"expected a file of keys and values, got {shown(data)}; finlab layout convert reads "
            "those of other programs"
        )
    if data.get("format", FORMAT) != FORMAT:
        raise LayoutError(f"expected {FORMAT}, got {shown(data['format'])}", "format")
    frame = data.get("frame")
    if isinstance(frame, Mapping) and frame.get("convention") in Z_DOWN:
        raise LayoutError(
            f"expected FLU, got {shown(frame['convention'])}; y points left and z up: change "
            "the sign of y and z of places, axes and shafts, and of mounting angles",
            "frame.convention",
        )
    version = data.get("version", VERSION)
    is_int = type(version) is int
    if (is_int and version == 1) or ("fins" in data and "actuators" not in data):
        raise LayoutError(VERSION_1_REFUSED, "version")
    if not is_int or version != VERSION:
        raise LayoutError(f"this finlab reads version {VERSION}, got {shown(version)}", "version")
