"""A fin model that is a table of forces, measured in a tank or computed by CFD; `table_file` reads it.

Forces, power and their derivatives are continuous between the grid's points. When the zero directions cover
the circle the table is periodic. Amplitudes and frequencies beyond the table count as its edge.
"""

from functools import cached_property

import numpy as np

from finlab.actuators.fin.grid_error import SMALL, grid_error
from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.actuators.law import FinLaw
from finlab.actuators.table_error import TableError
from finlab.arrays import Array, Values, library_of


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

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """See `FinLaw`. Tensors are answered, too, but nothing is differentiated through the table."""
        xp = library_of(command)
        if xp is not np:
            values = self.force(command.detach().cpu().numpy())
            return xp.from_numpy(np.ascontiguousarray(values)).to(command)
        return self._grids(command, 1)[..., 0, 0, 0, :3].astype(command.dtype, copy=False)

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """See `FinLaw`; exact derivatives of the interpolation."""
        found = self._grids(command, 2)[..., :3]
        return found[..., 0, 0, 0, :], _jacobian(found)

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `FinLaw`."""
        if not self.has_power:
            return super().power(command)
        # A polynomial through points near zero may dip below.
        return np.maximum(self._grids(command, 1)[..., 0, 0, 0, 3], 0.0)

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        """See `FinLaw`."""
        if not self.has_power:
            return super().power_gradient(command)
        found = self._grids(command, 2)[..., 3:]
        return _jacobian(found)[..., 0] * (found[..., 0, 0, 0, :] > 0.0)


class TableLaw(GridLaw):
    """The law of one table."""

    def __init__(
        self,
        axes: list[Array],
        values: Array,
        periodic: bool,
        notes: tuple[str, ...] = (),
        deviation: Array | None = None,
    ) -> None:
        """Takes the grid's axes [rad, Hz, rad], rising, two points or more each, and what was measured
        (a, f, d, 3 or 4): forces [N], and power [W] where it is known. The forces' standard deviations
        (a, f, d, 3) [N] are None or (a, f, d, 0) where nothing is known of them.

        A periodic grid's zero directions cover the circle, without the first one again at the end.
        """
        self.grid = Grid(axes, values, periodic)
        """What was measured."""
        super().__init__([self.grid])
        self.periodic = periodic
        self.notes = notes
        """What to know of the table, a sentence each."""
        self.covers = tuple((float(axis[0]), float(axis[-1])) for axis in axes)
        """First and last amplitude [rad], frequency [Hz] and zero direction [rad] of the grid."""
        self._measured = np.square(deviation) if deviation is not None and deviation.shape[-1] else None

    @cached_property
    def grid_error(self) -> TableError:
        """What the grid leaves open, over the size of the force."""
        return grid_error(self.grid)

    @cached_property
    def _variances(self) -> Array:
        """Variances (a, f, d, 2) [N^2] of the forces across the shaft and along it at the grid's points: what
        the file says, and the error of the grid."""
        square, error = (self.grid.values[..., :3] ** 2).sum(axis=-1), self.grid_error
        share = error.spacing**2 + (error.noise**2 if self._measured is None else 0.0)
        known = np.zeros(3) if self._measured is None else self._measured
        across = share * (square + SMALL**2 * square.max()) + known[..., 1:].mean(axis=-1)
        return np.stack(np.broadcast_arrays(across, known[..., 0]), axis=-1)

    @cached_property
    def _between(self) -> HermiteGrids:
        return HermiteGrids([self.grid._replace(values=self._variances)])

    def deviation(self, command: Array) -> Array:
        """Returns the standard deviation (..., 2) [N] of the force across the shaft, in each of two
        directions, and along it, at commands (..., 3)."""
        return np.asarray(np.sqrt(np.maximum(self._between(command, 1)[..., 0, 0, 0, :], 0.0)))

    @cached_property
    def uncertain_share(self) -> float:
        """The part of the standard deviation across the shaft that grows with the force, as a share of it,
        over the grid."""
        square, variance = (self.grid.values[..., :3] ** 2).sum(axis=-1), self._variances[..., 0]
        away = square - square.mean()
        return float(np.sqrt(max((away * variance).sum() / max((away**2).sum(), 1e-300), 0.0)))


def _jacobian(found: Array) -> Array:
    """First derivatives (..., 3 commands, c) of values and mixed derivatives (..., 2, 2, 2, c)."""
    by = found[..., 1, 0, 0, :], found[..., 0, 1, 0, :], found[..., 0, 0, 1, :]
    return np.stack(by, axis=-2)
