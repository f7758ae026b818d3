"""From the description of a fin's model to its law: a formula, or a table measured or computed."""

import os
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_model import FinModelSpec
from finlab.actuators.fin.force_table_file import read_force_table
from finlab.actuators.fin.formulas import Drag, Lighthill, Soft
from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.actuators.form import grid_numbers
from finlab.actuators.law import FinLaw, PlanarLaw
from finlab.arrays import Array, Values, library_of
from finlab.axes import TURN
from finlab.bundle_files import archive_around


class GridLaw(FinLaw):
    """Forces and power by interpolation on one grid, or on one for each of n fins; see `FinLaw`."""

    uniform = False

    def __init__(self, grids: list[Grid]) -> None:
        """Takes grids of forces [N], all of them with power [W] or none: three columns or four."""
        self._grids = HermiteGrids(grids)

    @property
    def has_power(self) -> bool:
        """Whether it is known what power the fins take."""
        return self._grids.columns > 3

    def grid_numbers(self, lower: Array, upper: Array) -> Array:
        """See `FinLaw`: the table as it is."""
        (grid,) = self._grids.grids
        return grid_numbers(grid.axes, grid.values[..., :3], TURN if grid.periodic else 0.0)

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """See `FinLaw`. Tensors are answered, too, but nothing is differentiated through the table."""
        xp = library_of(command)
        if xp is not np:
            values = self.force(command.detach().cpu().numpy())
            return xp.from_numpy(np.ascontiguousarray(values)).to(command)
        return self._grids(command, 1)[..., 0, 0, 0, :3].astype(command.dtype, copy=False)

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """See `FinLaw`; exact derivatives of the interpolation."""
        result = self._grids(command, 2)[..., :3]
        return result[..., 0, 0, 0, :], _jacobian(result)

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        if not self.has_power:
            return super().power(command)
        # A polynomial through points near zero may dip below.
        return np.maximum(self._grids(command, 1)[..., 0, 0, 0, 3], 0.0)

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        if not self.has_power:
            return super().power_gradient(command)
        result = self._grids(command, 2)[..., 3:]
        return _jacobian(result)[..., 0] * (result[..., 0, 0, 0, :] > 0.0)


class TableLaw(GridLaw):
    """The law of one table of measured or computed forces, with what is known beside them."""

    def __init__(
        self,
        axes: list[Array],
        values: Array,
        periodic: bool,
        notes: tuple[str, ...] = (),
        deviation: Array | None = None,
    ) -> None:
        """Takes the grid's axes [rad, Hz, rad], rising, two points or more each, and values (a, f, d, 3 or
        4): forces [N], and power [W] where it is known. The forces' standard deviations (a, f, d, 3) [N] are
        None or (a, f, d, 0) where unknown. A periodic grid has no second end of the circle."""
        self.grid = Grid(axes, values, periodic)
        """What was measured."""
        super().__init__([self.grid])
        self.periodic = periodic
        self.notes = notes
        """What to know of the table, a sentence each."""
        self.covers = tuple((float(axis[0]), float(axis[-1])) for axis in axes)
        """First and last amplitude [rad], frequency [Hz] and zero direction [rad] of the grid."""
        self.deviation = deviation if deviation is not None and deviation.shape[-1] else None
        """Standard deviations of the forces at the grid's points (a, f, d, 3) [N], where they are known."""


def _jacobian(mixed: Array) -> Array:
    """First derivatives (..., 3 commands, c) of values and mixed derivatives (..., 2, 2, 2, c)."""
    by = mixed[..., 1, 0, 0, :], mixed[..., 0, 1, 0, :], mixed[..., 0, 0, 1, :]
    return np.stack(by, axis=-2)


PLANAR_LAWS: dict[str, type[PlanarLaw]] = {"drag": Drag, "lighthill": Lighthill, "soft": Soft}
"""Fin model -> law with a formula; its parameters may be arrays, one number for each of n fins."""


def make_law(spec: FinModelSpec) -> FinLaw:
    """Returns the law of one fin model. Raises DataError: it is a table whose file is missing or wrong."""
    values: dict[str, Any] = spec.values()
    if spec.type == "table":
        return _table(values["path"], file_stamp(values["path"]))
    return PLANAR_LAWS[spec.type](**values)


def stack_laws(specs: Sequence[FinModelSpec]) -> list[tuple[NDArray[np.intp], FinLaw]]:
    """Returns the laws of n fins as (places, law); fins of one formula, and those with tables of as many
    columns, are evaluated together. Errors as for `make_law`."""
    laws = [make_law(spec) for spec in specs]
    kinds = [
        law.has_power if isinstance(law, TableLaw) else spec.type
        for spec, law in zip(specs, laws, strict=True)
    ]
    groups: list[tuple[NDArray[np.intp], FinLaw]] = []
    for kind in dict.fromkeys(kinds):
        places = np.array([i for i, own in enumerate(kinds) if own == kind])
        groups.append((places, _together([specs[i] for i in places], [laws[i] for i in places])))
    return groups


def _together(specs: list[FinModelSpec], laws: list[FinLaw]) -> FinLaw:
    """One law for fins of one formula, or with tables of as many columns."""
    if all(spec == specs[0] for spec in specs):
        return laws[0]
    tables = [law.grid for law in laws if isinstance(law, TableLaw)]
    if tables:
        return GridLaw(tables)
    rows: list[dict[str, Any]] = [spec.values() for spec in specs]
    return PLANAR_LAWS[specs[0].type](**{name: np.array([row[name] for row in rows]) for name in rows[0]})


def file_stamp(path: str | None) -> tuple[int, int] | None:
    """Returns time and size of a file that a law reads, None where it reads none."""
    if path is None:
        return None
    try:
        result = os.stat(archive_around(path) or path)
    except (OSError, ValueError):
        return 0, 0
    return result.st_mtime_ns, result.st_size


def read_table(path: str | os.PathLike[str]) -> TableLaw:
    """Returns the law in a CSV file; errors as for `read_force_table`."""
    return TableLaw(*read_force_table(path))


@lru_cache(maxsize=64)
def _table(path: str, stamp: tuple[int, int] | None) -> TableLaw:
    """The table in a file, read again when the file has changed."""
    return read_table(path)
