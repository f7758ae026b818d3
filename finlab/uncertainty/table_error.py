"""The error of a table between its lines, from what every second and every fourth line say of the others.

What is interpolated from lines twice as far apart misses the lines left out by more than the table itself
misses what lies between: by 2^p times as much for a smooth quantity and an interpolation of order p
(Richardson, 1911). Noise of the measurements does not grow with the distance; lines four times as far apart
tell the two apart.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout.thrust_model import PowerTable

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
    """Returns the errors by spacing and by noise along one axis of a table.

    Args:
        count: lines of the axis, three or more.
        order: of the interpolation.
        weights: sum of the squared weights of the interpolation half way between lines.
        missed: gives the errors at the lines left out if every second or every fourth one is kept, as shares
            of the values there; None where none can be left out.
    """
    second = _mean_square(missed(2))
    fourth = _mean_square(missed(4)) if count >= FEWEST[1] else 0.0
    far, farther = 4.0**order, 16.0**order
    spacing = second / far
    if fourth:
        spacing = min(max((fourth - second) / (farther - far), 0.0), spacing)
    noise = max(second - far * spacing, 0.0) / (1.0 + weights)
    return float(np.sqrt(spacing)), float(np.sqrt(noise))


@lru_cache(maxsize=256)
def thrust_table_error(model: PowerTable) -> tuple[float, float]:
    """Returns the standard deviation of the force by the rows of a propeller's table, with straight lines
    between: as a share of the force, and the part that is there at any force [N]."""
    command, force, _ = model.columns
    floor = SMALL * float(np.abs(force).max())

    def missed(step: int) -> Array:
        kept = np.arange(0, len(command), step)
        left = np.arange(step // 2, kept[-1], step)
        found = np.interp(command[left], command[kept], force[kept])
        return np.asarray((found - force[left]) / np.hypot(force[left], floor))

    share = float(np.hypot(*line_error(len(command), 2, 0.5, missed)))
    return share, share * floor


def _mean_square(error: Array | None) -> float:
    return 0.0 if error is None or not error.size else float(np.mean(error**2))
