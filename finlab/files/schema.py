"""Plain values checked against types, with one sentence for whatever does not fit, and the place of
it.

The annotations of a frozen dataclass say what its fields may be. One declaration serves three:
construction in code is checked by it, files are read by it, and the published JSON Schemas are made
of it.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeVar, cast, get_args, get_type_hints

import msgspec
from msgspec import Meta, inspect

from finlab.errors import FinlabError, LayoutError

Checkable = TypeVar("Checkable")
"""A type that plain values are checked against."""

_PLACE = re.compile(r"(?s)(.*) - at `(?:key` in `)?\$(.*)`")
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]|\[(\.\.\.)\]")
_TYPES = {"float": "a number", "int": "a whole number", "str": "text", "bool": "true or false"}
_TYPES |= {"array": "a list", "object": "keys and values", "null": "null"}
_BOUNDS = {">=": "at least", "<=": "at most", ">": "more than", "<": "less than"}


def shown(value: Any) -> str:
    """Returns a short text of a value for a sentence, whatever its size."""
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def checked(
    values: Any,
    kind: type[Checkable],
    error: type[FinlabError] = LayoutError,
    source: str = "",
    key: str = "",
) -> Checkable:
    """Returns plain values, such as those of a file, in a type: a `msgspec.Struct`, or any that
    msgspec knows.

    Arrays count as lists. Raises FinlabError of the kind `error`: the sentence says where, by the
    `source` of all, unless its reader adds that, and the `key` of these in it, what was expected,
    and what was got."""
    try:
        values = msgspec.to_builtins(values, enc_hook=_plain)
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as problem:
        said = str(problem)
        place = ""
    except (RecursionError, TypeError, ValueError, OverflowError):
        said = "Expected `object`"
        place = ""
    if parts := _PLACE.fullmatch(said):
        said = parts[1]
        place = parts[2]
    sentence, inner = _sentence(said, place, values, kind)
    place = ".".join(part for part in (place.lstrip("."), inner) if part)
    if key and place:
        place = key + ("" if place.startswith("[") else ".") + place
    raise error.at(source, sentence, place or key)


def _plain(value: Any) -> Any:
    """An array as a list, anything else that no file holds as text."""
    return value.tolist() if hasattr(value, "tolist") else repr(value)


def _sentence(said: str, place: str, values: Any, kind: Any) -> tuple[str, str]:
    """What is wrong, and the key below `place` that it is about, if any."""
    value, known = _at(place, values, inspect.type_info(kind))
    if parts := re.fullmatch(r"Object missing required field `(.*)`", said):
        return "required key is missing", parts[1]
    if parts := re.fullmatch(r"(?s)Object contains unknown field `(.*)`", said):
        name = parts[1] if parts[1].isprintable() and len(parts[1]) <= 40 else shown(parts[1])
        return f"unknown key, expected one of {', '.join(_keys(known))}", name
    if parts := re.fullmatch(r"Expected `(\w+)` of length (>=|<=)? ?(\d+)(?:, got \d+)?", said):
        unit = "characters" if parts[1] == "str" else "values"
        few = getattr(known, "min_length", None)
        many = getattr(known, "max_length", None)
        if few is None or many is None:
            few = many = int(parts[3])
        number = f"{few} to {many}" if few < many else f"{many}"
        return f"expected {_TYPES[parts[1]]} of {number} {unit}, got {len(value)}", ""
    if said.startswith("Expected `str` matching regex"):
        return f"expected text on one line, without spaces around it, got {shown(value)}", ""
    least = getattr(known, "ge", None)
    most = getattr(known, "le", None)
    if re.fullmatch(r"Expected `\w+` [<>]=? \S+|Number out of range", said) and None not in (
        least,
        most,
    ):
        return f"must lie within {least:g} .. {most:g}, got {shown(value)}", ""
    if parts := re.fullmatch(r"Expected `\w+` ([<>]=?) (\S+)", said):
        return (
            f"expected a number of {_BOUNDS[parts[1]]} {float(parts[2]):g}, got {shown(value)}",
            "",
        )
    if parts := re.fullmatch(r"Expected `([\w| ]+)`(, got .*)?", said):
        wanted = " or ".join(
            _TYPES.get(name, name) for name in parts[1].split(" | ") if name != "null"
        )
        return f"expected {wanted}, got {shown(value)}", ""
    if choices := _choices(known):
        return (
            f"expected {'one of ' * (len(choices) > 1)}{', '.join(choices)}, got {shown(value)}",
            "",
        )
    return f"{said[:1].lower()}{said[1:]}, got {shown(value)}", ""


def _at(place: str, value: Any, known: Any) -> tuple[Any, Any]:
    """The value at a place, and what msgspec knows of its type; None where that is not known."""
    for name, index, _ in _STEP.findall(place):
        known = _step_into(_one(known, value), name, index)
        if name:
            value = value.get(name) if isinstance(value, Mapping) else None
        else:
            fits = isinstance(value, Sequence) and index and int(index) < len(value)
            value = value[int(index)] if fits else None
    return value, _one(known, value)


def _step_into(known: Any, name: str, index: str) -> Any:
    if isinstance(known, inspect.StructType):
        return next((field.type for field in known.fields if field.encode_name == name), None)
    if isinstance(known, inspect.UnionType) and name == getattr(known.types[0], "tag_field", None):
        return known
    if isinstance(known, inspect.TupleType) and index:
        return known.item_types[int(index)]
    return getattr(known, "value_type", None) or getattr(known, "item_type", None)


def _one(known: Any, value: Any) -> Any:
    """A type without what describes it, without null, and of several structures the one that is
    meant."""
    if isinstance(known, inspect.Metadata):
        return _one(known.type, value)
    if isinstance(known, inspect.UnionType):
        kinds = [
            _one(kind, value) for kind in known.types if not isinstance(kind, inspect.NoneType)
        ]
        tag = (
            value.get(getattr(kinds[0], "tag_field", None)) if isinstance(value, Mapping) else None
        )
        meant = [kind for kind in kinds if tag is not None and getattr(kind, "tag", None) == tag]
        return (
            meant[0] if meant else kinds[0] if len(kinds) == 1 else inspect.UnionType(tuple(kinds))
        )
    return known


def _keys(known: Any) -> list[str]:
    return (
        [field.encode_name for field in known.fields]
        if isinstance(known, inspect.StructType)
        else []
    )


def _choices(known: Any) -> list[str]:
    """The values that a type leaves to choose from, or the kinds of structure."""
    if isinstance(known, inspect.LiteralType):
        return [str(value) for value in known.values]
    kinds: Any = known.types if isinstance(known, inspect.UnionType) else ()
    return [str(kind.tag) for kind in kinds]


Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^\S(.*\S)?$")]
"""A name: one line, without spaces around it."""


class Checked:
    """Base of frozen dataclasses that are checked on construction, by their annotations. Raises
    LayoutError: a value is none of its type, or out of bounds; the message names the argument. A
    reader of files puts the key in its place: see `file_key`."""

    __dataclass_fields__: ClassVar[dict[str, Any]]
    KEYS: ClassVar[Mapping[str, str]] = {}
    """Fields -> their keys in a file, where the two differ."""
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {}
    """Fields in radians -> their keys and types in a file, in degrees."""
    WRITTEN: ClassVar[Collection[str]] = ()
    """Fields that a file is given even where they are as usual."""
    UNSAID: ClassVar[Collection[str]] = ()
    """Fields that no file has."""
    type: ClassVar[str] = ""
    """What a file calls it under the key `type`, where it may hold one of several."""

    def __post_init__(self) -> None:
        names, kind = _plain_fields(cast(Any, type(self)))
        values = checked({name: getattr(self, name) for name in names}, kind)
        for name in names:
            value = getattr(values, name)
            lines = _LINES if name == "description" else {}
            if isinstance(value, str) and not value.translate(lines).isprintable():
                raise LayoutError(f"must hold printable characters only, got {shown(value)}", name)
            object.__setattr__(self, name, value)

    @classmethod
    def file_key(cls, argument: str) -> str:
        """Returns what a file calls an argument, or a place in one: `force_n[1]` for `force[1]`."""
        keys = {**cls.KEYS, **{name: key for name, (key, _) in cls.DEGREES.items()}}
        name = argument.partition(".")[0].partition("[")[0]
        return keys.get(name, name) + argument[len(name) :]


class Part(ABC):
    """What a part of a file stands for whose keys are not the fields of its class."""

    @classmethod
    @abstractmethod
    def file_form(cls) -> Any:
        """Returns the form of the part: a `msgspec.Struct` whose `stands_for` is this class, or
        several."""

    @classmethod
    @abstractmethod
    def from_file(cls, tag: str, values: dict[str, Any], may_open: bool) -> Self:
        """Returns what a part stands for. Raises LayoutError: something does not fit.

        Args:
            tag: which of several forms it has.
            values: what the part says, by field of the form; paths are absolute.
            may_open: whether files that the part names may be opened.
        """


_LINES = {ord("\n"): " ", ord("\t"): " "}


@cache
def _plain_fields(cls: Any) -> tuple[list[str], Any]:
    """Fields of a dataclass that hold plain values, and the form of these."""
    hints = get_type_hints(cls, include_extras=True)
    names = [field.name for field in fields(cls) if not _holds_checked(hints[field.name])]
    return names, msgspec.defstruct(cls.__name__, [(name, hints[name]) for name in names])


def _holds_checked(kind: Any) -> bool:
    """Whether a type is, or contains, one that is checked on its own."""
    parts = get_args(kind)
    return (
        any(map(_holds_checked, parts))
        if parts
        else isinstance(kind, type) and issubclass(kind, Checked)
    )


def form(
    cls: type,
    keys: Mapping[str, str] | None = None,
    /,
    called: str = "",
    required: Collection[str] = (),
    optional: Collection[str] = (),
    tag: tuple[str, str | int] | tuple[()] | None = None,
    **kinds: Any,
) -> Any:
    """Returns the `msgspec.Struct` of the part of a file that a dataclass stands for.

    Args:
        cls: the dataclass; what has a default there may be left out of the file, or be null.
        keys: fields -> keys in the file; `cls.KEYS` when None.
        called: what the part is called in a schema; the dataclass's name when empty.
        required: fields that the file must have although they have a default.
        optional: those of `kinds` that the file may leave out, beside the fields that have a
        default.
        tag: a key and its value, by which the part is known among others in the same place; the key
            `type` where the class has a `type` when None.
        kinds: types of fields that are different in the file, and of those that are there alone;
            None for a field that no file has.
    """
    annotated = get_type_hints(cls, include_extras=True)
    hints = {**{field.name: annotated[field.name] for field in fields(cls)}, **kinds}
    usual = {field.name for field in fields(cls) if field.default is not MISSING}
    free = (usual - set(required)) | set(optional)
    parts = [
        (name, kind | None, None) if name in free else (name, kind)
        for name, kind in hints.items()
        if kind is not None
    ]
    parts.sort(key=len)
    rename = cls.KEYS if keys is None and issubclass(cls, Checked) else dict(keys or {})
    about: dict[str, Any] = {"__doc__": _summary(cls), "stands_for": cls}
    if tag is None and issubclass(cls, Checked) and cls.type:
        tag = ("type", cls.type)
    key, value = tag or (None, None)
    return msgspec.defstruct(
        called or cls.__name__,
        parts,
        rename=rename,
        forbid_unknown_fields=True,
        namespace=about,
        tag_field=key,
        tag=value,
    )


def _summary(cls: type) -> str:
    """The first paragraph of a class's docstring on one line, for the schema; without the sentence
    that its values are checked, which is of no use to who writes a file."""
    paragraph = (cls.__doc__ or "").split("\n\n")[0]
    words = " ".join(paragraph.split())
    return words.replace(" Checked on construction.", "")


def given(part: Any) -> dict[str, Any]:
    """Returns the fields of a part of a file that are there."""
    return {
        name: value for name in part.__struct_fields__ if (value := getattr(part, name)) is not None
    }
