"""Power of a propeller over its force, as a layout file gives it: a power law, or a table of
measurements. `thrust_power` evaluates them.
"""

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta, Struct

from finlab.arrays import Array
from finlab.errors import DataError, LayoutError
from finlab.files.csv_table import read_table
from finlab.files.schema import Checked, Part

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

MAX_FORCE = 1e9
"""Largest force of one actuator [N]."""
MAX_ROWS = 2000
"""Most rows of a table."""
MAX_BYTES = 1_000_000
"""Largest CSV file of a table that is read [bytes]."""
NOISE = 0.05
"""Most by which a table's power may lie above its convex hull, over the largest power of the side:
measured tables rise with noise, and their marginal cost falls in some intervals."""
COLUMNS = ("command", "force_n", "power_w")
"""Columns of a table, by name; their order in a CSV file is free."""

Newtons = Annotated[float, Meta(ge=-MAX_FORCE, le=MAX_FORCE)]
"""A force [N]."""
Factor = Annotated[float, Meta(ge=1e-9, le=1e9)]
"""Power at a force of 1 N [W]."""
Row = tuple[
    Annotated[float, Meta(ge=-1e9, le=1e9)], Newtons, Annotated[float, Meta(ge=0.0, le=1e9)]
]
"""Input in its own unit, force [N] and power [W]."""


@dataclass(frozen=True)
class PowerLaw(Checked):
    """Watts that grow with a power of the force. Checked on construction.

    Args:
        forward: power at a force of 1 N [W]; a force F takes `forward` F^exponent.
        reverse: the same of a negative force [W]; `forward` when None.
        exponent: the exponent [1]; 1.5 is that of an ideal propeller at rest.

    Raises:
        LayoutError: a value is out of its bounds; the message names the argument.
    """

    type: ClassVar[str] = "power_law"

    forward: Factor
    reverse: Factor | None = None
    exponent: Annotated[float, Meta(ge=1.1, le=4.0)] = 1.5


@dataclass(frozen=True)
class PowerTable(Checked, Part):
    """Force and power over the thruster's own command, as measured. Checked on construction.

    Args:
        rows: command in its own unit, rising; force, which must not fall [N]; electrical power [W].
        unit: unit of the command, such as us for the width of a pulse.

    Raises:
        LayoutError: rows are not in order, do not reach a force of 0, or their power is far from
            convex.
    """

    type: ClassVar[str] = "table"

    rows: Annotated[tuple[Row, ...], Meta(min_length=3, max_length=MAX_ROWS)]
    unit: Annotated[str, Meta(max_length=20)] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        command, force, power = self.columns
        _check_order(command, force)
        for sign, side in ((1, "forward"), (-1, "reverse")):
            size, side_power = side_points(force, power, sign)
            above_hull = side_power - np.interp(size, *lower_hull(size, side_power))
            if above_hull.max() > NOISE * side_power.max():
                worst = size[int(np.argmax(above_hull))] * sign
                raise LayoutError(
                    f"the power must grow ever faster with the force, but {side} it lies "
                    f"{above_hull.max():.3g} W above its convex hull at {worst:g} N, more than "
                    f"{NOISE:.0%} of {side_power.max():.4g} W",
                    "rows",
                )

    @property
    def columns(self) -> Array:
        """Commands, forces [N] and power [W] (3, rows)."""
        return np.array(self.rows).T

    @classmethod
    def file_form(cls) -> Any:
        return TableForm

    @classmethod
    def from_file(cls, tag: str, values: dict[str, Any], may_open: bool) -> "Self":
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
    def read(cls, path: str | os.PathLike[str], unit: str = "") -> "Self":
        """Returns the table in a CSV file with the columns `COLUMNS`.

        Args:
            path: the file.
            unit: unit of its commands.

        Raises:
            LayoutError: the file cannot be read, lacks a column, or its rows are not acceptable.
        """
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
"""Electrical power of a propeller over its force."""


def _check_order(command: Array, force: Array) -> None:
    """Refuses a table by its commands (rows,) and forces (rows,) [N]. Raises LayoutError: commands
    do not rise, forces fall, or they do not reach 0."""
    steps = np.diff(command)
    if (steps <= 0.0).any():
        i = int(np.argmin(steps > 0.0)) + 1
        raise LayoutError(
            f"the command must rise from row to row, row {i + 1} has {command[i]:g}", "rows"
        )
    falls = np.diff(force) < 0.0
    if falls.any():
        i = int(np.argmax(falls)) + 1
        raise LayoutError(
            f"the force must not fall with the command, row {i + 1} has {force[i]:g} N after "
            f"{force[i - 1]:g} N; order the rows from full reverse to full forward",
            "rows",
        )
    if not force[0] <= 0.0 <= force[-1] or force[0] == force[-1]:
        raise LayoutError(f"must reach a force of 0, got {force[0]:g} .. {force[-1]:g} N", "rows")


def check_force(model: ThrustModel, force: tuple[float, float]) -> None:
    """Refuses limits of the force (least, most) [N] that a table does not cover. Raises
    LayoutError: a limit lies beyond the table's rows."""
    if isinstance(model, PowerTable):
        least = model.rows[0][1]
        most = model.rows[-1][1]
        if not least <= force[0] <= force[1] <= most:
            raise LayoutError(
                f"the table ends at {least:g} and {most:g} N, got {force[0]:g} .. {force[1]:g}",
                "force",
            )


def side_points(force: Array, power: Array, sign: int) -> tuple[Array, Array]:
    """Returns the points of one side of a table.

    Args:
        force: forces (rows,) [N].
        power: power (rows,) [W].
        sign: 1 for the forward side, -1 for the reverse one.

    Returns:
        Sizes of the force (K,) [N], rising from 0, and the least power (K,) [W] at each.
    """
    is_here = sign * force >= 0.0
    size = (sign * force)[is_here]
    side_power = power[is_here]
    if not (size == 0.0).any():
        size = np.append(size, 0.0)
        side_power = np.append(side_power, np.interp(0.0, force, power))
    sizes, inverse = np.unique(size, return_inverse=True)
    least = np.full(len(sizes), np.inf)
    np.minimum.at(least, inverse, side_power)
    return sizes, least


def lower_hull(x: Array, y: Array) -> tuple[Array, Array]:
    """Returns the vertices (K,) and (K,) of the lower convex hull of points (N,) and (N,) with
    rising x, from left to right (Andrew's monotone chain, 1979)."""
    hull: list[int] = []
    for i in range(len(x)):
        while len(hull) > 1:
            a, b = hull[-2:]
            # b stays where the turn from a over b to i is to the left.
            if (y[b] - y[a]) * (x[i] - x[a]) <= (y[i] - y[a]) * (x[b] - x[a]):
                break
            hull.pop()
        hull.append(i)
    return x[hull], y[hull]
