"""Parts of a layout file and the values that they stand for, both ways.

What holds degrees in a file is kept in radians; paths become absolute; a table of thrust in a CSV file
becomes rows.
"""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Union, get_type_hints

from msgspec import Meta, Struct, structs

from finlab.actuators.actuator import Actuator, Uncertainty
from finlab.actuators.fin.fin import Servo
from finlab.actuators.fin.fin_model import FinModelSpec, Limits, Model
from finlab.actuators.thrust_model import MAX_ROWS, PowerLaw, PowerTable, Row, ThrustModel
from finlab.errors import LayoutError
from finlab.files.schema import Checked, form
from finlab.interaction.jets import Jets
from finlab.interaction.learned import Learned
from finlab.layout.body import Body, Hull


class TableForm(Struct, tag="table", tag_field="type", forbid_unknown_fields=True):
    """Force and power over the thruster's own command: rows, or the CSV file that has them."""

    rows: Annotated[list[Row], Meta(min_length=3, max_length=MAX_ROWS)] | None = None
    path: Annotated[str, Meta(min_length=1, max_length=4096, description="a CSV file of thrust")] | None = (
        None
    )
    unit: Annotated[str, Meta(max_length=20)] | None = None


_FORMS: tuple[tuple[Any, Any], ...] = (
    (Uncertainty, form(Uncertainty)),
    (Limits, form(Limits)),
    (Servo, form(Servo)),
    (FinModelSpec, Model),
    (ThrustModel, form(PowerLaw) | TableForm),
)
"""Types of fields that are parts of their own in a file, and the forms of these."""


def _form(cls: type[Checked]) -> Any:
    """The form of a class whose angles are in degrees."""
    keys = {name: key for name, (key, _) in cls.DEGREES.items()}
    kinds = {name: kind for name, (_, kind) in cls.DEGREES.items()}
    hints = get_type_hints(cls)
    for name in (field.name for field in fields(cls)):
        kinds |= {name: own for kind, own in _FORMS if hints[name] in (kind, kind | None)}  # noqa: B035
    kinds |= dict.fromkeys(cls.UNSAID)
    return form(cls, {**cls.KEYS, **keys}, **kinds)


@cache
def actuator_form(kinds: tuple[type[Actuator], ...]) -> Any:
    """Returns the form of an actuator, one of several kinds."""
    return Union[tuple(map(_form, kinds))]  # noqa: UP007


BODY = form(Body, hull=form(Hull))
INTERACTION: Any = form(Jets) | form(Learned)


@contextmanager
def under(key: str = "", source: str = "") -> Iterator[None]:
    """Puts `key` before the keys of layout errors raised inside, and `source`, their file, before that."""
    try:
        yield
    except LayoutError as error:
        raise error.under(key, source) from None


@dataclass(frozen=True)
class Reader:
    """Makes values of parts of a file."""

    folder: Path | None = None
    """Where relative paths start; the working directory when None."""
    may_open: bool = True
    """Whether a CSV file of thrust that a part names may be opened."""

    def value(self, part: Any) -> Any:
        """Returns what a part stands for, an instance of a form, a list of them, or a plain value. Raises
        LayoutError: something does not fit; the message names the key in the part."""
        if isinstance(part, list | tuple):
            items = []
            for i, item in enumerate(part):
                with under(f"[{i}]"):
                    items.append(self.value(item))
            return tuple(items)
        if not isinstance(part, Struct):
            return part
        values = {}
        for field in structs.fields(part):
            value = getattr(part, field.name)
            if value is not None:
                with under(field.encode_name):
                    values[field.name] = self.value(value)
        for key in {"path", "mesh"} & set(values):
            values[key] = os.path.normpath((self.folder or Path.cwd()) / values[key])
        if isinstance(part, TableForm):
            return self._table(values)
        cls: Any = getattr(type(part), "stands_for", None)
        if cls is None:
            return FinModelSpec(str(part.__struct_config__.tag), tuple(values.items()))
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

    def _table(self, values: dict[str, Any]) -> PowerTable:
        if ("rows" in values) == ("path" in values):
            raise LayoutError("give either rows, or the path of a CSV file, not both or neither", "rows")
        if "rows" in values:
            return PowerTable(**values)
        if not self.may_open:
            raise LayoutError("names a file, which is not opened here; write its rows", "path")
        return PowerTable.read(values["path"], values.get("unit", ""))


def plain(value: Any) -> Any:
    """Returns the plain values of a part of a layout file; what is as usual is left out."""
    if isinstance(value, FinModelSpec):
        return {"type": value.type, **dict(value.parameters)}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if not isinstance(value, Checked):
        return value
    keys = {**value.KEYS, **{name: key for name, (key, _) in value.DEGREES.items()}}
    data = {}
    for field in fields(value):
        if field.name in value.UNSAID:
            continue
        own = getattr(value, field.name)
        if own != field.default or field.name in value.WRITTEN:
            own = degrees_of(own) if field.name in value.DEGREES else own
            data[keys.get(field.name, field.name)] = plain(own)
    name = {"name": data.pop("name")} if "name" in data else {}
    return {**name, **({"type": value.type} if value.type else {}), **data}


def degrees_of(value: Any) -> Any:
    """Returns degrees of radians [rad], one or a tuple: twelve digits give back what people wrote; where they
    do not, more are taken, so that reading gives the same radians."""
    if isinstance(value, tuple):
        return tuple(map(degrees_of, value))
    exact = math.degrees(value)
    near = (round(exact, 12), exact, math.nextafter(exact, math.inf), math.nextafter(exact, -math.inf))
    return next((angle for angle in near if math.radians(angle) == value), near[0])
