"""The law of a fin whose forces were measured or computed at the points of a grid."""

import os
from functools import lru_cache

import numpy as np

from finlab.actuators.fin.force_table_file import read_force_table
from finlab.actuators.hermite_grid import Grid, HermiteGrids, grid_numbers
from finlab.actuators.law import FinLaw
from finlab.arrays import Array, Values, library_of
from finlab.axes import TURN
from finlab.bundle_files import file_stamp


class GridLaw(FinLaw):
    """Forces and power by interpolation on one grid, or on one for each of n fins; see `FinLaw`."""

    uniform = False
    measured = True

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
        """See `FinLaw`. Tensors are answered, too, but nothing is differentiated through the
        table."""
        xp = library_of(command)
        if xp is not np:
            values = self.force(command.detach().cpu().numpy())
            return xp.from_numpy(np.ascontiguousarray(values)).to(command)
        return self._grids(command, 1)[..., 0, 0, 0, :3].astype(command.dtype, copy=False)

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
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
        """Takes the grid's axes [rad, Hz, rad], rising, two points or more each, and values (a, f,
        d, 3 or 4): forces [N], and power [W] where it is known. The forces' standard deviations (a,
        f, d, 3) [N] are None or (a, f, d, 0) where unknown. A periodic grid has no second end of
        the circle."""
        self.grid = Grid(axes, values, periodic)
        """What was measured."""
        super().__init__([self.grid])
        self.periodic = periodic
        self.notes = notes
        self.covers = tuple((float(axis[0]), float(axis[-1])) for axis in axes)
        """First and last amplitude [rad], frequency [Hz] and zero direction [rad] of the grid."""
        self.deviation = deviation if deviation is not None and deviation.shape[-1] else None
        """Standard deviations of the forces at the grid's points (a, f, d, 3) [N], where they are
        known."""


def _jacobian(mixed: Array) -> Array:
    """First derivatives (..., 3 commands, c) of values and mixed derivatives (..., 2, 2, 2, c)."""
    by = mixed[..., 1, 0, 0, :], mixed[..., 0, 1, 0, :], mixed[..., 0, 0, 1, :]
    return np.stack(by, axis=-2)


def read_table(path: str | os.PathLike[str]) -> TableLaw:
    """Returns the law in a CSV file; errors as for `read_force_table`."""
    return TableLaw(*read_force_table(path))


def kept_table(path: str) -> TableLaw:
    """Returns the law in a CSV file, read again when the file has changed; errors as for
    `read_table`."""
    return _read(path, file_stamp(path))


@lru_cache(maxsize=64)
def _read(path: str, stamp: tuple[int, int] | None) -> TableLaw:
    return read_table(path)
