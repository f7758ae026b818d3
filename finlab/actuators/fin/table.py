"""A fin model that is a table of forces, measured in a tank or computed by CFD.

Forces, power and their derivatives are continuous between the grid's points. When the zero directions cover
the circle the table is periodic. Amplitudes and frequencies beyond the table count as its edge.
"""

import numpy as np

from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.actuators.law import FinLaw
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
        if not self.has_power:
            return super().power(command)
        # A polynomial through points near zero may dip below.
        return np.maximum(self._grids(command, 1)[..., 0, 0, 0, 3], 0.0)

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
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
        self.deviation = deviation if deviation is not None and deviation.shape[-1] else None
        """Standard deviations of the forces at the grid's points (a, f, d, 3) [N], where they are known."""


def _jacobian(found: Array) -> Array:
    """First derivatives (..., 3 commands, c) of values and mixed derivatives (..., 2, 2, 2, c)."""
    by = found[..., 1, 0, 0, :], found[..., 0, 1, 0, :], found[..., 0, 0, 1, :]
    return np.stack(by, axis=-2)
