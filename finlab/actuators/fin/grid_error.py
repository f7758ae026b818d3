"""What the grid of a fin's force table leaves open, by the lines that are left out of it."""

from functools import partial

import numpy as np

from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.actuators.table_error import FEWEST, TableError, line_error
from finlab.arrays import Array

ORDER, OPEN_ORDER = 3, 2
"""Orders of the cubic interpolation around a circle, and on an axis with ends, where slopes are one-sided."""
WEIGHTS = 2 * (9 / 16) ** 2 + 2 * (1 / 16) ** 2
"""Sum of its squared weights half way between two lines."""
SMALL = 0.05
"""Share of the largest force that counts in full where a force is smaller, so that shares of it are none of
nothing."""


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
