"""The error of a table between its lines, from what every second and every fourth line say of the
others.

What is interpolated from lines twice as far apart misses the lines left out by more than the table
itself misses what lies between: by 2^p times as much for a smooth quantity and an interpolation of
order p (Richardson, 1911). Noise of the measurements does not grow with the distance; lines four
times as far apart tell the two apart.
"""

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.hermite_grid import Grid, HermiteGrids
from finlab.actuators.thrust_model import PowerTable
from finlab.arrays import Array

FEWEST = 3, 9
"""Lines from which every second and every fourth one tell something."""
SMALL = 0.2
"""Share of a propeller's largest force that counts in full where a force is smaller."""


class TableError(NamedTuple):
    """Root mean square errors of a table, as shares of its values."""

    spacing: float
    """By what happens between its lines."""
    noise: float
    """By the noise of its values."""
    few: tuple[int, ...] = ()
    """Axes that have too few lines to tell."""


def line_error(
    count: int, order: int, weights: float, missed: Callable[[int], Array | None]
) -> tuple[float, float]:
    """Returns the errors by spacing and by noise along one axis of `count` lines, three or more, by
    the order of the interpolation and the sum of its squared weights half way between lines;
    `missed` gives the errors at the lines left out if every second or every fourth one is kept, as
    shares, or None."""
    second = _mean_square(missed(2))
    fourth = _mean_square(missed(4)) if count >= FEWEST[1] else 0.0
    far = 4.0**order
    farther = 16.0**order
    spacing = second / far
    if fourth:
        spacing = min(max((fourth - second) / (farther - far), 0.0), spacing)
    noise = max(second - far * spacing, 0.0) / (1.0 + weights)
    return float(np.sqrt(spacing)), float(np.sqrt(noise))


@lru_cache(maxsize=256)
def thrust_table_error(model: PowerTable) -> tuple[float, float]:
    """Returns the standard deviation of the force by the rows of a propeller's table, with straight
    lines between: as a share of the force, and the part that is there at any force [N]."""
    command, force, _ = model.columns
    floor = SMALL * float(np.abs(force).max())

    def missed(step: int) -> Array:
        kept = np.arange(0, len(command), step)
        left = np.arange(step // 2, kept[-1], step)
        result = np.interp(command[left], command[kept], force[kept])
        return np.asarray((result - force[left]) / np.hypot(force[left], floor))

    share = float(np.hypot(*line_error(len(command), 2, 0.5, missed)))
    return share, share * floor


def _mean_square(error: Array | None) -> float:
    return 0.0 if error is None or not error.size else float(np.mean(error**2))


ORDER, OPEN_ORDER = 3, 2
"""Orders of the cubic interpolation around a circle, and on an axis with ends, where slopes are
one-sided."""
WEIGHTS = 2 * (9 / 16) ** 2 + 2 * (1 / 16) ** 2
"""Sum of its squared weights half way between two lines."""
SMALL_FORCE = 0.05
"""Share of the largest force that counts in full where a force is smaller."""


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
        """Variances (a, f, d, 2) [N^2] of the forces across the shaft and along it, by file and
        grid."""
        square = (self._grid.values[..., :3] ** 2).sum(axis=-1)
        error = self.error
        share = error.spacing**2 + (error.noise**2 if self._measured is None else 0.0)
        known = np.zeros(3) if self._measured is None else self._measured
        across = share * (square + SMALL_FORCE**2 * square.max()) + known[..., 1:].mean(axis=-1)
        return np.stack(np.broadcast_arrays(across, known[..., 0]), axis=-1)

    @cached_property
    def _between(self) -> HermiteGrids:
        return HermiteGrids([self._grid._replace(values=self._variances)])

    def deviation(self, command: Array) -> Array:
        """Returns standard deviations (..., 2) [N] of forces across the shaft and along it at
        commands (..., 3)."""
        return np.asarray(np.sqrt(np.maximum(self._between(command, 1)[..., 0, 0, 0, :], 0.0)))

    @cached_property
    def uncertain_share(self) -> float:
        """The part of the standard deviation across the shaft that grows with the force, as a share
        of it."""
        square = (self._grid.values[..., :3] ** 2).sum(axis=-1)
        variance = self._variances[..., 0]
        away = square - square.mean()
        return float(np.sqrt(max((away * variance).sum() / max((away**2).sum(), 1e-300), 0.0)))


grid_uncertainty = lru_cache(maxsize=64)(GridUncertainty)
"""The uncertainty of a table, kept for later."""


def grid_error(grid: Grid) -> TableError:
    """Returns the errors of a grid of forces over their sizes, those of all axes together."""
    counts = [len(axis) for axis in grid.axes]
    orders = [OPEN_ORDER, OPEN_ORDER, OPEN_ORDER]
    if grid.periodic:
        orders[2] = ORDER
    few = tuple(k for k, count in enumerate(counts) if count < FEWEST[0])
    many = [k for k in range(3) if k not in few]
    errors = [line_error(counts[k], orders[k], WEIGHTS, partial(_missed, grid, k)) for k in many]
    spacing = float(np.sqrt(sum(own**2 for own, _ in errors)))
    return TableError(spacing, max((noise for _, noise in errors), default=0.0), few)


def _missed(grid: Grid, axis: int, step: int) -> Array | None:
    """Errors of forces at the lines of an axis between those kept, over their sizes, in each
    component."""
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
    return np.asarray(error[..., 1:] / np.hypot(size, SMALL_FORCE * largest)[..., None])
