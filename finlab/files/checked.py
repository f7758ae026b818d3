"""Frozen dataclasses whose annotations say what their fields may be, and the same as parts of a file.

One declaration serves three: construction in code is checked by it, files are read by it, and the published
JSON Schemas are made of it.
"""

from collections.abc import Collection, Mapping
from dataclasses import MISSING, fields
from functools import cache
from typing import Annotated, Any, ClassVar, cast, get_args, get_type_hints

import msgspec
from msgspec import Meta

from finlab.errors import LayoutError
from finlab.files.schema import checked, shown

Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^\S(.*\S)?$")]
"""A name: one line, without spaces around it."""


class Checked:
    """Base of frozen dataclasses that are checked on construction, by their annotations. Raises LayoutError:
    a value is none of its type, or out of bounds; the message names the key, as in a file."""

    __dataclass_fields__: ClassVar[dict[str, Any]]
    KEYS: ClassVar[Mapping[str, str]] = {}
    """Fields -> their keys in a file, where the two differ."""
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {}
    """Fields in radians -> their keys and types in a file, in degrees."""
    WRITTEN: ClassVar[Collection[str]] = ()
    """Fields that a file is given even where they are as usual."""
    type: ClassVar[str] = ""
    """What a file calls it under the key `type`, where it may hold one of several."""

    def __post_init__(self) -> None:
        keys, kind = _plain_fields(cast(Any, type(self)))
        values = checked({key: getattr(self, name) for name, key in keys.items()}, kind)
        for name, key in keys.items():
            value = getattr(values, name)
            lines = _LINES if name == "description" else {}
            if isinstance(value, str) and not value.translate(lines).isprintable():
                raise LayoutError(f"must hold printable characters only, got {shown(value)}", key)
            object.__setattr__(self, name, value)


_LINES = {ord("\n"): " ", ord("\t"): " "}


@cache
def _plain_fields(cls: Any) -> tuple[dict[str, str], Any]:
    """Fields of a dataclass that hold plain values -> their keys, and the form of these."""
    hints = get_type_hints(cls, include_extras=True)
    names = [field.name for field in fields(cls) if not _holds_checked(hints[field.name])]
    keys = {name: cls.KEYS.get(name, name) for name in names}
    return keys, msgspec.defstruct(cls.__name__, [(name, hints[name]) for name in names], rename=keys)


def _holds_checked(kind: Any) -> bool:
    """Whether a type is, or contains, one that is checked on its own."""
    parts = get_args(kind)
    return any(map(_holds_checked, parts)) if parts else isinstance(kind, type) and issubclass(kind, Checked)


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
        optional: those of `kinds` that the file may leave out, beside the fields that have a default.
        tag: a key and its value, by which the part is known among others in the same place; the key `type`
            where the class has a `type` when None.
        kinds: types of fields that are different in the file, and of those that are there alone; None for
            a field that no file has.
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
    line = (cls.__doc__ or "").split("\n")[0].replace(" Checked on construction.", "")
    about: dict[str, Any] = {"__doc__": line, "stands_for": cls}
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


def given(part: Any) -> dict[str, Any]:
    """Returns the fields of a part of a file that are there."""
    return {name: value for name in part.__struct_fields__ if (value := getattr(part, name)) is not None}
