"""What the grid of a fin's force table leaves open, by the lines that are left out of it."""

from functools import cached_property, lru_cache, partial

import numpy as np

from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.actuators.fin.table import TableLaw
from finlab.arrays import Array
from finlab.uncertainty.table_error import FEWEST, TableError, line_error

ORDER, OPEN_ORDER = 3, 2
"""Orders of the cubic interpolation around a circle, and on an axis with ends, where slopes are one-sided."""
WEIGHTS = 2 * (9 / 16) ** 2 + 2 * (1 / 16) ** 2
"""Sum of its squared weights half way between two lines."""
SMALL = 0.05
"""Share of the largest force that counts in full where a force is smaller, so that shares of it are none of
nothing."""


class GridUncertainty:
    """How far the forces of a fin's table may be off, over its grid."""

    def __init__(self, law: TableLaw) -> None:
        """Takes the law of the table."""
        self._grid = law.grid
        self._measured = None if law.deviation is None else np.square(law.deviation)

    @cached_property
    def error(self) -> TableError:
        """What the grid leaves open, over the size of the force."""
        return grid_error(self._grid)

    @cached_property
    def _variances(self) -> Array:
        """Variances (a, f, d, 2) [N^2] of the forces across the shaft and along it at the grid's points: what
        the file says, and the error of the grid."""
        square, error = (self._grid.values[..., :3] ** 2).sum(axis=-1), self.error
        share = error.spacing**2 + (error.noise**2 if self._measured is None else 0.0)
        known = np.zeros(3) if self._measured is None else self._measured
        across = share * (square + SMALL**2 * square.max()) + known[..., 1:].mean(axis=-1)
        return np.stack(np.broadcast_arrays(across, known[..., 0]), axis=-1)

    @cached_property
    def _between(self) -> HermiteGrids:
        return HermiteGrids([self._grid._replace(values=self._variances)])

    def deviation(self, command: Array) -> Array:
        """Returns the standard deviation (..., 2) [N] of the force across the shaft, in each of two
        directions, and along it, at commands (..., 3)."""
        return np.asarray(np.sqrt(np.maximum(self._between(command, 1)[..., 0, 0, 0, :], 0.0)))

    @cached_property
    def uncertain_share(self) -> float:
        """The part of the standard deviation across the shaft that grows with the force, as a share of it,
        over the grid."""
        square, variance = (self._grid.values[..., :3] ** 2).sum(axis=-1), self._variances[..., 0]
        away = square - square.mean()
        return float(np.sqrt(max((away * variance).sum() / max((away**2).sum(), 1e-300), 0.0)))


@lru_cache(maxsize=64)
def grid_uncertainty(law: TableLaw) -> GridUncertainty:
    """Returns the uncertainty of a table, kept for later."""
    return GridUncertainty(law)


def grid_error(grid: Grid) -> TableError:
    """Returns the errors of a grid of forces over their sizes, those of all axes together."""
    counts = [len(axis) for axis in grid.axes]
    told = [
        line_error(
            count, ORDER if k == 2 and grid.periodic else OPEN_ORDER, WEIGHTS, partial(_missed, grid, k)
        )
        for k, count in enumerate(counts)
        if count >= FEWEST[0]
    ]
    few = tuple(k for k, count in enumerate(counts) if count < FEWEST[0])
    spacing = float(np.sqrt(sum(own**2 for own, _ in told)))
    return TableError(spacing, max((noise for _, noise in told), default=0.0), few)


def _missed(grid: Grid, axis: int, step: int) -> Array | None:
    """Errors of forces at the lines of an axis that lie between each two of those kept, over their sizes,
    each component in turn."""
    lines = grid.axes[axis]
    closed = grid.periodic and axis == 2 and len(lines) % step == 0 and len(lines) > step
    kept = np.arange(0, len(lines), step)
    left = np.arange(step // 2, len(lines) if closed else kept[-1], step)
    if len(kept) < 2 or not len(left):
        return None
    forces = grid.values[..., :3]
    axes = [lines[kept] if k == axis else own for k, own in enumerate(grid.axes)]
    coarse = Grid(axes, forces.take(kept, axis), closed if axis == 2 else grid.periodic)
    at = [lines[left] if k == axis else own for k, own in enumerate(grid.axes)]
    command = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1)
    truth = forces.take(left, axis)
    size = np.linalg.norm(truth, axis=-1)
    largest = float(np.linalg.norm(forces, axis=-1).max())
    error: Array = HermiteGrids([coarse])(command, 1)[..., 0, 0, 0, :] - truth
    return np.asarray(error[..., 1:] / np.hypot(size, SMALL * largest)[..., None])
