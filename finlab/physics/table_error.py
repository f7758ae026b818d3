"""Error of a table between its lines, estimated by Richardson extrapolation from coarser tables.

A table of every second line, interpolated at the lines that it omits, has a larger error than the
whole table has between its lines: by a factor 2^p for a smooth quantity and an interpolation of
order p (Richardson, 1911). Noise of the measurements does not grow with the spacing, so a table of
every fourth line separates the two. `finlab.physics.expected_miss` and the notes on tables use
this.
"""

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.hermite_grid import Grid, HermiteGrids
from finlab.actuators.thrust_model import PowerTable
from finlab.arrays import Array

MIN_LINES_EVERY_SECOND = 3
"""Least number of lines with one that a table of every second line omits."""
MIN_LINES_EVERY_FOURTH = 9
"""Least number of lines for a table of every fourth line."""
THRUST_FLOOR = 0.2
"""Share of a propeller's largest force that is added (root of squares) to the force by which errors
are divided [1]: near zero force, relative errors mean nothing."""
LINEAR_ORDER = 2
"""Order of linear interpolation."""
LINEAR_SQUARED_WEIGHTS = 0.5
"""Sum of squared weights of linear interpolation halfway between two lines: 2 (1/2)^2."""


class TableError(NamedTuple):
    """Root mean square errors of a table, as shares of its values."""

    spacing: float
    """By interpolation between its lines [1]."""
    noise: float
    """By the noise of its values [1]."""
    few: tuple[int, ...] = ()
    """Axes that have too few lines for an estimate."""


def line_error(
    count: int, order: int, squared_weights: float, coarse_error: Callable[[int], Array | None]
) -> tuple[float, float]:
    """Returns the errors along one axis of a table.

    Args:
        count: number of lines, three or more.
        order: order p of the interpolation.
        squared_weights: sum of squared weights of the interpolation halfway between two lines [1].
        coarse_error: from a step (2 or 4) to the relative errors, at the lines that it omits, of a
            table of every second or every fourth line; None where there are none.

    Returns:
        Root mean square errors by spacing and by noise [1].
    """
    second = _mean_square(coarse_error(2))
    fourth = _mean_square(coarse_error(4)) if count >= MIN_LINES_EVERY_FOURTH else 0.0
    # With e^2 by spacing and s^2 by noise at a line that is omitted:
    #   second = 4^p e^2 + s^2,  fourth = 16^p e^2 + s^2
    growth_second = 4.0**order
    growth_fourth = 16.0**order
    spacing = second / growth_second
    if fourth:
        difference = (fourth - second) / (growth_fourth - growth_second)
        spacing = min(max(difference, 0.0), spacing)
    # Of s^2, one part is the noise of the line itself, the others that of the interpolation.
    noise = max(second - growth_second * spacing, 0.0) / (1.0 + squared_weights)
    return float(np.sqrt(spacing)), float(np.sqrt(noise))


@lru_cache(maxsize=256)
def thrust_table_error(model: PowerTable) -> tuple[float, float]:
    """Returns the standard deviation of the force of a propeller's table, with linear
    interpolation.

    Returns:
        Standard deviation over the force [1], and its part that is there at any force [N].
    """
    command, force, _ = model.columns
    floor = THRUST_FLOOR * float(np.abs(force).max())

    def coarse_error(step: int) -> Array:
        coarse = np.arange(0, len(command), step)
        omitted = np.arange(step // 2, coarse[-1], step)
        interpolated = np.interp(command[omitted], command[coarse], force[coarse])
        error = interpolated - force[omitted]
        return np.asarray(error / np.hypot(force[omitted], floor))

    spacing, noise = line_error(len(command), LINEAR_ORDER, LINEAR_SQUARED_WEIGHTS, coarse_error)
    share = float(np.hypot(spacing, noise))
    return share, share * floor


def _mean_square(error: Array | None) -> float:
    """Mean of squares; 0 of no errors."""
    if error is None or not error.size:
        return 0.0
    return float(np.mean(error**2))


PERIODIC_ORDER = 3
"""Order of the cubic interpolation around a circle."""
OPEN_ORDER = 2
"""Order of the cubic interpolation on an axis with ends, where slopes are one-sided."""
CUBIC_SQUARED_WEIGHTS = 2 * (9 / 16) ** 2 + 2 * (1 / 16) ** 2
"""Sum of squared weights of the cubic interpolation halfway between two lines."""
FORCE_FLOOR = 0.05
"""Share of a fin's largest force that is added (root of squares) to the force by which errors are
divided [1]."""
SMALLEST_VARIANCE = 1e-300
"""Least divisor of a regression; it only avoids 0 / 0."""


class GridUncertainty:
    """Standard deviations of the forces of a fin's table, on the grid of the table."""

    def __init__(self, law: TableLaw) -> None:
        """Takes the law of the table."""
        self._grid = law.grid
        self._measured = None if law.deviation is None else np.square(law.deviation)
        """Variances (a, f, d, 3) [N^2] along own axes in the file of the table; None without."""

    @cached_property
    def error(self) -> TableError:
        """Errors of the grid, over the size of the force."""
        return grid_error(self._grid)

    @cached_property
    def _variances(self) -> Array:
        """Variances (a, f, d, 2) [N^2] of the forces across the shaft and along it, by the file's
        standard deviations and the error of the grid."""
        squared_force = self._squared_force
        squared_floor = FORCE_FLOOR**2 * squared_force.max()
        error = self.error
        if self._measured is None:
            relative = error.spacing**2 + error.noise**2
            measured = np.zeros(3)
        else:
            # The file's standard deviations hold the noise already.
            relative = error.spacing**2
            measured = self._measured
        across = relative * (squared_force + squared_floor) + measured[..., 1:].mean(axis=-1)
        along = measured[..., 0]
        return np.stack(np.broadcast_arrays(across, along), axis=-1)

    @cached_property
    def _squared_force(self) -> Array:
        """Squared sizes (a, f, d) [N^2] of the forces of the table."""
        return np.asarray((self._grid.values[..., :3] ** 2).sum(axis=-1))

    @cached_property
    def _interpolated_variance(self) -> HermiteGrids:
        """The variances between the lines."""
        return HermiteGrids([self._grid._replace(values=self._variances)])

    def deviation(self, command: Array) -> Array:
        """Returns standard deviations (..., 2) [N] of forces across the shaft and along it at
        commands (..., 3) [rad, Hz, rad]."""
        variance = self._interpolated_variance(command, 1)[..., 0, 0, 0, :]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

    @cached_property
    def uncertain_share(self) -> float:
        """Part of the standard deviation across the shaft that grows with the force, over the
        force [1]: root of the slope of a linear regression of variance on squared force."""
        variance = self._variances[..., 0]
        centered = self._squared_force - self._squared_force.mean()
        slope = (centered * variance).sum() / max((centered**2).sum(), SMALLEST_VARIANCE)
        return float(np.sqrt(max(slope, 0.0)))


grid_uncertainty = lru_cache(maxsize=64)(GridUncertainty)
"""The uncertainty of a table's law, from a cache."""


def grid_error(grid: Grid) -> TableError:
    """Returns the errors of a grid of forces over the sizes of the forces: by spacing the root of
    the sum of squares over the axes, by noise the largest of any axis."""
    counts = [len(axis) for axis in grid.axes]
    orders = [OPEN_ORDER, OPEN_ORDER, OPEN_ORDER]
    if grid.periodic:
        orders[2] = PERIODIC_ORDER
    few = []
    squared_spacings = []
    noises = []
    for axis, count in enumerate(counts):
        if count < MIN_LINES_EVERY_SECOND:
            few.append(axis)
            continue
        coarse_error = partial(_coarse_error, grid, axis)
        spacing, noise = line_error(count, orders[axis], CUBIC_SQUARED_WEIGHTS, coarse_error)
        squared_spacings.append(spacing**2)
        noises.append(noise)
    return TableError(
        spacing=float(np.sqrt(sum(squared_spacings))),
        noise=max(noises, default=0.0),
        few=tuple(few),
    )


def _coarse_error(grid: Grid, axis: int, step: int) -> Array | None:
    """Relative errors (..., 2) across the shaft of a grid of every second or fourth line of an
    axis, at the lines that it omits; None where it is no grid."""
    lines = grid.axes[axis]
    is_circle = grid.periodic and axis == 2 and len(lines) % step == 0 and len(lines) > step
    coarse = np.arange(0, len(lines), step)
    omitted = np.arange(step // 2, len(lines) if is_circle else coarse[-1], step)
    if len(coarse) < 2 or not len(omitted):
        return None
    forces = grid.values[..., :3]
    coarse_axes = list(grid.axes)
    coarse_axes[axis] = lines[coarse]
    omitted_axes = list(grid.axes)
    omitted_axes[axis] = lines[omitted]
    is_periodic = is_circle if axis == 2 else grid.periodic
    coarse_grid = Grid(coarse_axes, forces.take(coarse, axis), is_periodic)
    command = np.stack(np.meshgrid(*omitted_axes, indexing="ij"), axis=-1)
    true_force = forces.take(omitted, axis)
    size = np.linalg.norm(true_force, axis=-1)
    largest = float(np.linalg.norm(forces, axis=-1).max())
    error: Array = HermiteGrids([coarse_grid])(command, 1)[..., 0, 0, 0, :] - true_force
    return np.asarray(error[..., 1:] / np.hypot(size, FORCE_FLOOR * largest)[..., None])
