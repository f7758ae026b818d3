"""Checks plain values against types, with one sentence for what does not fit and where it stands.

The annotations of a frozen dataclass say what its fields may be. One declaration serves three uses:
construction in code is checked by it, files are read by it, and the published JSON Schemas are made
of it. msgspec does the checking; its messages are put into our sentences here.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    TypeVar,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec import Meta, inspect

from finlab.errors import FinlabError, LayoutError

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

Checkable = TypeVar("Checkable")
"""A type that plain values are checked against."""

_MESSAGE_AND_PATH = re.compile(r"(?s)(.*) - at `(key` in `)?\$(.*)`")
"""A message of msgspec, whether it is about a key of a mapping, and the path that it names, such as
`$.actuators[2].name`."""
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]|\[(\.\.\.)\]")
"""One step of such a path: a key, an index, or any key."""
_ANY_KEY = "[...]"
"""The step of such a path to a value of a mapping whose keys are of its own choice."""
_TYPES = {
    "float": "a number",
    "int": "a whole number",
    "str": "text",
    "bool": "true or false",
    "array": "a list",
    "object": "keys and values",
    "null": "null",
}
"""Types as msgspec names them, and as a sentence does."""
_BOUNDS = {">=": "at least", "<=": "at most", ">": "more than", "<": "less than"}
"""Comparisons as msgspec writes them, and as a sentence does."""


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
    """Returns plain values, such as those of a file, as a value of a type.

    Args:
        values: the plain values; arrays count as lists.
        kind: a `msgspec.Struct`, or any type that msgspec knows.
        error: the class of the error.
        source: the name of the file in the sentence; empty where its reader adds it.
        key: the path of these values in the file.

    Raises:
        FinlabError: of the class `error`: a value does not fit. The sentence says where, what was
            expected, and what was got.
    """
    try:
        values = msgspec.to_builtins(values, enc_hook=_plain)
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as problem:
        message = str(problem)
    except (RecursionError, TypeError, ValueError, OverflowError):
        message = "Expected `object`"
    place = _Place("", "", values, inspect.type_info(kind))
    match = _MESSAGE_AND_PATH.fullmatch(message)
    if match:
        place = _place_of(match[3], match[2] is not None, message, values, kind)
        message = match[1]
    fault = _fault(message, place)
    path = ".".join(step for step in (place.shown.lstrip("."), fault.key) if step)
    if key and path:
        path = key + ("" if path.startswith("[") else ".") + path
    raise error.in_file(source, fault.sentence, path or key)


def _plain(value: Any) -> Any:
    """An array as a list; any other value that no file holds as text."""
    return value.tolist() if hasattr(value, "tolist") else repr(value)


class _Place(NamedTuple):
    """Where in some values a message of msgspec has found a fault."""

    shown: str
    """Its path in a sentence."""
    subject: str
    """What of it is meant, where that is not the value there: `as a key in it`."""
    value: Any
    """The value that does not fit; None where it is not there."""
    type_info: Any
    """The type that it does not fit, as msgspec describes it."""


def _place_of(path: str, is_key: bool, message: str, values: Any, kind: Any) -> _Place:
    """The place of a fault.

    Args:
        path: that of the message, which names no keys of mappings whose keys are of their own
            choice.
        is_key: whether the message is about a key of the mapping there.
        message: the whole message.
        values: the plain values.
        kind: the type that they do not fit.
    """
    type_info = inspect.type_info(kind)
    shown_path = path
    at = path.find(_ANY_KEY)
    while at >= 0:
        values, key = _with_one_item(path[:at], message, values, kind)
        step = f".{key}" if key.isprintable() and len(key) <= 64 else f".{shown(key)}"
        shown_path = shown_path.replace(_ANY_KEY, step, 1)
        at = path.find(_ANY_KEY, at + len(_ANY_KEY))
    if not is_key:
        return _Place(shown_path, "", *_value_at(path, values, type_info))
    values, key = _with_one_item(path, message, values, kind)
    _, mapping_type = _value_at(path, values, type_info)
    key_type = _resolve(getattr(mapping_type, "key_type", None), key)
    return _Place(shown_path, "as a key in it, ", key, key_type)


def _with_one_item(path: str, message: str, values: Any, kind: Any) -> tuple[Any, str]:
    """The values with one item alone in the mapping at a path, of which msgspec says the same, and
    the key of that item."""
    mapping, _ = _value_at(path, values, inspect.type_info(kind))
    for key, item in mapping.items():
        alone = _with_value(path, values, {key: item})
        try:
            msgspec.convert(alone, kind)
        except msgspec.ValidationError as problem:
            if str(problem) == message:
                return alone, str(key)
    raise AssertionError(f"msgspec finds no fault in any item of {path}: {message}")


def _with_value(path: str, values: Any, value: Any) -> Any:
    """The values with another one at a path."""
    step = _STEP.match(path)
    if step is None:
        return value
    rest = path[step.end() :]
    name, index, _ = step.groups()
    if index is not None:
        items = list(values)
        items[int(index)] = _with_value(rest, items[int(index)], value)
        return items
    key = next(iter(values)) if name is None else name
    return {**values, key: _with_value(rest, values[key], value)}


class _Fault(NamedTuple):
    """A fault of a value."""

    sentence: str
    key: str = ""
    """The key below the path of the value that it is about; empty for the value itself."""


def _fault(message: str, place: _Place) -> _Fault:
    """A message of msgspec, without its path, as one of our sentences."""
    value = place.value
    type_info = place.type_info
    match = re.fullmatch(r"Object missing required field `(.*)`", message)
    if match:
        return _Fault("required key is missing", match[1])
    match = re.fullmatch(r"(?s)Object contains unknown field `(.*)`", message)
    if match:
        key = match[1]
        is_short = key.isprintable() and len(key) <= 40
        keys = ", ".join(_keys(type_info))
        return _Fault(f"unknown key, expected one of {keys}", key if is_short else shown(key))
    match = re.fullmatch(r"Expected `(\w+)` of length (>=|<=)? ?(\d+)(?:, got \d+)?", message)
    if match:
        sentence = _length_sentence(match[1], int(match[3]), value, type_info)
        return _Fault(place.subject + sentence)
    return _Fault(f"{place.subject}{_expectation(message, type_info)}, got {shown(value)}")


def _length_sentence(type_name: str, length: int, value: Any, type_info: Any) -> str:
    """The sentence for a text or list of another length; `length` is the bound that was passed."""
    unit = "characters" if type_name == "str" else "values"
    shortest = getattr(type_info, "min_length", None)
    longest = getattr(type_info, "max_length", None)
    if shortest is None or longest is None:
        shortest = length
        longest = length
    number = f"{shortest} to {longest}" if shortest < longest else f"{longest}"
    return f"expected {_TYPES[type_name]} of {number} {unit}, got {len(value)}"


def _expectation(message: str, type_info: Any) -> str:
    """What was expected of a number, a text or a choice, as a clause."""
    if message.startswith("Expected `str` matching regex"):
        return "expected text on one line, without spaces around it"
    low = getattr(type_info, "ge", None)
    high = getattr(type_info, "le", None)
    is_out_of_bounds = re.fullmatch(r"Expected `\w+` [<>]=? \S+|Number out of range", message)
    if is_out_of_bounds and low is not None and high is not None:
        return f"must lie within {low:g} .. {high:g}"
    match = re.fullmatch(r"Expected `\w+` ([<>]=?) (\S+)", message)
    if match:
        comparison, bound = match.groups()
        return f"expected a number of {_BOUNDS[comparison]} {float(bound):g}"
    match = re.fullmatch(r"Expected `([\w| ]+)`(, got .*)?", message)
    if match:
        names = [_TYPES.get(name, name) for name in match[1].split(" | ") if name != "null"]
        return f"expected {' or '.join(names)}"
    choices = _choices(type_info)
    if choices:
        one_of = "one of " if len(choices) > 1 else ""
        return f"expected {one_of}{', '.join(choices)}"
    return f"{message[:1].lower()}{message[1:]}"


def _value_at(path: str, value: Any, type_info: Any) -> tuple[Any, Any]:
    """The value at a path, and its type as msgspec describes it; None for what is not there. A
    mapping whose key the path does not name has one item."""
    for name, index, any_key in _STEP.findall(path):
        type_info = _type_below(_resolve(type_info, value), name, index)
        if name:
            value = value.get(name) if isinstance(value, Mapping) else None
        elif any_key and isinstance(value, Mapping):
            value = next(iter(value.values()))
        else:
            is_item = isinstance(value, Sequence) and index and int(index) < len(value)
            value = value[int(index)] if is_item else None
    return value, _resolve(type_info, value)


def _type_below(type_info: Any, name: str, index: str) -> Any:
    """The type of the value under a key, or at an index where the key is empty."""
    if isinstance(type_info, inspect.StructType):
        for field in type_info.fields:
            if field.encode_name == name:
                return field.type
        return None
    is_union = isinstance(type_info, inspect.UnionType)
    if is_union and name == getattr(type_info.types[0], "tag_field", None):
        return type_info  # the tag of one of several structures
    if isinstance(type_info, inspect.TupleType) and index:
        return type_info.item_types[int(index)]
    return getattr(type_info, "value_type", None) or getattr(type_info, "item_type", None)


def _resolve(type_info: Any, value: Any) -> Any:
    """A type without its metadata and without null; of several structures the one whose tag the
    value has."""
    if isinstance(type_info, inspect.Metadata):
        return _resolve(type_info.type, value)
    if not isinstance(type_info, inspect.UnionType):
        return type_info
    members = [
        _resolve(member, value)
        for member in type_info.types
        if not isinstance(member, inspect.NoneType)
    ]
    if isinstance(value, Mapping):
        tag = value.get(getattr(members[0], "tag_field", None))
        for member in members:
            if tag is not None and getattr(member, "tag", None) == tag:
                return member
    return members[0] if len(members) == 1 else inspect.UnionType(tuple(members))


def _keys(type_info: Any) -> list[str]:
    """The keys of a structure; none of another type."""
    if not isinstance(type_info, inspect.StructType):
        return []
    return [field.encode_name for field in type_info.fields]


def _choices(type_info: Any) -> list[str]:
    """The values that a type leaves to choose from, or the tags of its structures."""
    if isinstance(type_info, inspect.LiteralType):
        return [str(value) for value in type_info.values]
    if isinstance(type_info, inspect.UnionType):
        return [str(member.tag) for member in cast(Any, type_info.types)]
    return []


Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^\S(.*\S)?$")]
"""A name: one line, without spaces around it."""


class Checked:
    """Base of frozen dataclasses that are checked on construction, by their annotations.

    A reader of files puts the key in the place of the argument: see `file_key`.

    Raises:
        LayoutError: a value is none of its type, or out of bounds; the message names the argument.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]
    KEYS: ClassVar[Mapping[str, str]] = {}
    """Fields -> their keys in a file, where the two differ."""
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {}
    """Fields in radians -> their keys and types in a file, in degrees."""
    WRITTEN: ClassVar[Collection[str]] = ()
    """Fields that are written to a file even where they have their defaults."""
    UNSAID: ClassVar[Collection[str]] = ()
    """Fields that no file has."""
    type: ClassVar[str] = ""
    """Its value under the key `type` of a file, where one of several classes may stand there."""

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
        """Returns the key of an argument in a file, or of an item: `force_n[1]` for `force[1]`."""
        keys = {**cls.KEYS, **{name: key for name, (key, _) in cls.DEGREES.items()}}
        name = argument.partition(".")[0].partition("[")[0]
        return keys.get(name, name) + argument[len(name) :]


class Part(ABC):
    """Base of classes that a part of a file stands for whose keys are not their fields."""

    @classmethod
    @abstractmethod
    def file_form(cls) -> Any:
        """Returns the form of the part: a `msgspec.Struct` whose `stands_for` is this class, or
        several."""

    @classmethod
    @abstractmethod
    def from_file(cls, tag: str, values: dict[str, Any], may_open: bool) -> "Self":
        """Returns the value that a part stands for.

        Args:
            tag: which of several forms it has.
            values: the part's values by field of the form; paths are absolute.
            may_open: whether files that the part names may be opened.

        Raises:
            LayoutError: a value does not fit.
        """


_LINES = {ord("\n"): " ", ord("\t"): " "}
"""Characters that a description may hold although they are not printable."""


@cache
def _plain_fields(cls: Any) -> tuple[list[str], Any]:
    """Fields of a dataclass that hold plain values, and the form of these."""
    hints = get_type_hints(cls, include_extras=True)
    names = [field.name for field in fields(cls) if not _holds_checked(hints[field.name])]
    return names, msgspec.defstruct(cls.__name__, [(name, hints[name]) for name in names])


def _holds_checked(kind: Any) -> bool:
    """Whether a type is, or contains, one that is checked on its own."""
    members = get_args(kind)
    if members:
        return any(map(_holds_checked, members))
    return is_class(kind) and issubclass(kind, Checked)


def is_class(kind: Any) -> bool:
    """Returns whether an annotation is a class; Python 3.10 takes `tuple[float, ...]` for one."""
    return isinstance(kind, type) and get_origin(kind) is None


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
        called: the name of the part in a schema; the dataclass's name when empty.
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
    with_default = {field.name for field in fields(cls) if field.default is not MISSING}
    may_be_left_out = (with_default - set(required)) | set(optional)
    # Required fields come first, as in a dataclass.
    struct_fields: list[Any] = [
        (name, kind)
        for name, kind in hints.items()
        if kind is not None and name not in may_be_left_out
    ]
    struct_fields += [
        (name, kind | None, None)
        for name, kind in hints.items()
        if kind is not None and name in may_be_left_out
    ]
    rename = cls.KEYS if keys is None and issubclass(cls, Checked) else dict(keys or {})
    namespace: dict[str, Any] = {"__doc__": _summary(cls), "stands_for": cls}
    if tag is None and issubclass(cls, Checked) and cls.type:
        tag = ("type", cls.type)
    key, value = tag or (None, None)
    return msgspec.defstruct(
        called or cls.__name__,
        struct_fields,
        rename=rename,
        forbid_unknown_fields=True,
        namespace=namespace,
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
    """Returns the fields of a part of a file that the file has, by name."""
    values = {name: getattr(part, name) for name in part.__struct_fields__}
    return {name: value for name, value in values.items() if value is not None}
