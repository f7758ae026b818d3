"""Force and power of a propeller, as a layout file gives them: a power law, or a table of
measurements."""

import os
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from msgspec import Meta, Struct

from finlab.arrays import Array
from finlab.errors import DataError, LayoutError
from finlab.files.csv_table import read_table
from finlab.files.schema import Checked, Part

MAX_FORCE = 1e6
"""Largest force of one actuator [N]."""
MAX_ROWS = 2000
"""Most rows of a table."""
MAX_BYTES = 1_000_000
"""Largest CSV file of a table that is read [bytes]."""
NOISE = 0.05
"""By how much, as a share of the largest power of a side, a table's power may lie above its convex
hull: measured tables rise with noise, and their marginal cost falls here and there."""
COLUMNS = ("command", "force_n", "power_w")
"""Columns of a table, by name; their order in a CSV file is free."""

Newtons = Annotated[float, Meta(ge=-MAX_FORCE, le=MAX_FORCE)]
Factor = Annotated[float, Meta(ge=1e-9, le=1e9)]
Row = tuple[
    Annotated[float, Meta(ge=-1e9, le=1e9)], Newtons, Annotated[float, Meta(ge=0.0, le=1e9)]
]


@dataclass(frozen=True)
class PowerLaw(Checked):
    """Watts that grow with a power of the force. Checked on construction."""

    type: ClassVar[str] = "power_law"

    forward: Factor
    """Power [W] at a force of 1 N; a force F takes `forward` F^exponent."""
    reverse: Factor | None = None
    """The same of a negative force; `forward` when left out."""
    exponent: Annotated[float, Meta(ge=1.1, le=4.0)] = 1.5
    """Exponent; 1.5 is that of an ideal propeller at rest."""


@dataclass(frozen=True)
class PowerTable(Checked, Part):
    """Force and power over the thruster's own command, as measured. Checked on construction."""

    type: ClassVar[str] = "table"

    rows: Annotated[tuple[Row, ...], Meta(min_length=3, max_length=MAX_ROWS)]
    """Command in its own unit, rising; force [N], which must not fall; electrical power [W]."""
    unit: Annotated[str, Meta(max_length=20)] = ""
    """Unit of the command, such as us for the width of a pulse."""

    def __post_init__(self) -> None:
        super().__post_init__()
        command, force, power = self.columns
        steps = np.diff(command)
        if (steps <= 0.0).any():
            i = int(np.argmin(steps > 0.0)) + 1
            raise LayoutError(
                f"the command must rise from row to row, row {i + 1} has {command[i]:g}", "rows"
            )
        if (np.diff(force) < 0.0).any():
            i = int(np.argmax(np.diff(force) < 0.0)) + 1
            raise LayoutError(
                f"the force must not fall with the command, row {i + 1} has {force[i]:g} N after "
                f"{force[i - 1]:g} N; order the rows from full reverse to full forward",
                "rows",
            )
        if not force[0] <= 0.0 <= force[-1] or force[0] == force[-1]:
            raise LayoutError(
                f"must reach a force of 0, got {force[0]:g} .. {force[-1]:g} N", "rows"
            )
        for sign, side in ((1, "forward"), (-1, "reverse")):
            size, watts = side_points(force, power, sign)
            above = watts - np.interp(size, *lower_hull(size, watts))
            if above.max() > NOISE * watts.max():
                at = size[int(np.argmax(above))] * sign
                raise LayoutError(
                    f"the power must grow ever faster with the force, but {side} it lies "
                    f"{above.max():.3g} W "
                    f"above its convex hull at {at:g} N, more than {NOISE:.0%} of "
                    f"{watts.max():.4g} W",
                    "rows",
                )

    @property
    def columns(self) -> Array:
        """Commands, forces [N] and powers [W] (3, rows)."""
        return np.array(self.rows).T

    @classmethod
    def file_form(cls) -> Any:
        return TableForm

    @classmethod
    def from_file(cls, tag: str, values: dict[str, Any], may_open: bool) -> Self:
        if ("rows" in values) == ("path" in values):
            raise LayoutError(
                "give either rows, or the path of a CSV file, not both or neither", "rows"
            )
        if "rows" in values:
            return cls(**values)
        if not may_open:
            raise LayoutError("names a file, which is not opened here; write its rows", "path")
        return cls.read(values["path"], values.get("unit", ""))

    @classmethod
    def read(cls, path: str | os.PathLike[str], unit: str = "") -> Self:
        """Returns the table in a CSV file with the columns `COLUMNS`. Raises LayoutError: the file
        cannot be read, lacks a column, or its rows are not acceptable."""
        try:
            table = read_table(path, MAX_BYTES, "a table of thrust (CSV)")
            missing = [name for name in COLUMNS if name not in table.header]
            if missing:
                raise DataError(
                    f"{path}: has no column {missing[0]}, expected {', '.join(COLUMNS)}"
                )
            rows, _ = table.numbers([table.header.index(name) for name in COLUMNS])
        except DataError as error:
            raise LayoutError(str(error), "path") from None
        try:
            return cls(tuple(map(tuple, rows.tolist())), unit)
        except LayoutError as error:
            raise LayoutError(f"{path}: {error}", "path") from None


class TableForm(Struct, tag="table", tag_field="type", forbid_unknown_fields=True):
    """Force and power over the thruster's own command: rows, or the CSV file that has them."""

    stands_for: ClassVar[type[PowerTable]] = PowerTable

    rows: Annotated[list[Row], Meta(min_length=3, max_length=MAX_ROWS)] | None = None
    path: (
        Annotated[str, Meta(min_length=1, max_length=4096, description="a CSV file of thrust")]
        | None
    ) = None
    unit: Annotated[str, Meta(max_length=20)] | None = None


ThrustModel = PowerLaw | PowerTable
"""What a thruster's power is."""


def check_force(model: ThrustModel, force: tuple[float, float]) -> None:
    """Refuses limits of the force that a table does not cover. Raises LayoutError: a limit [N] lies
    beyond the table's rows."""
    if isinstance(model, PowerTable):
        least = model.rows[0][1]
        most = model.rows[-1][1]
        if not least <= force[0] <= force[1] <= most:
            raise LayoutError(
                f"the table ends at {least:g} and {most:g} N, got {force[0]:g} .. {force[1]:g}",
                "force",
            )


def side_points(force: Array, power: Array, sign: int) -> tuple[Array, Array]:
    """Returns sizes of force (K,) [N], from 0 on and rising, and the least power (K,) [W] known at
    each, of the forward (`sign` 1) or the reverse side (-1) of a table."""
    kept = sign * force >= 0.0
    size = (sign * force)[kept]
    watts = power[kept]
    if not (size == 0.0).any():
        size = np.append(size, 0.0)
        watts = np.append(watts, np.interp(0.0, force, power))
    places, inverse = np.unique(size, return_inverse=True)
    least = np.full(len(places), np.inf)
    np.minimum.at(least, inverse, watts)
    return places, least


def lower_hull(x: Array, y: Array) -> tuple[Array, Array]:
    """Returns the points of the lower convex hull of points with rising x, from left to right."""
    kept: list[int] = []
    for i in range(len(x)):
        while len(kept) > 1:
            a, b = kept[-2:]
            if (y[b] - y[a]) * (x[i] - x[a]) <= (y[i] - y[a]) * (x[b] - x[a]):
                break
            kept.pop()
        kept.append(i)
    return x[kept], y[kept]
