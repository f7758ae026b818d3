"""What the rows of a propeller's table leave open, by the rows that are left out of it."""

from functools import lru_cache, partial

import numpy as np

from finlab.actuators.table_error import FEWEST, TableError, line_error
from finlab.arrays import Array
from finlab.layout.thrust_model import PowerTable

ORDER = 2
"""Order of the straight lines between rows."""
WEIGHTS = 0.5
"""Sum of their squared weights half way between two rows."""
SMALL = 0.2
"""Share of the largest force that counts in full where a force is smaller."""


@lru_cache(maxsize=256)
def thrust_table_error(model: PowerTable) -> tuple[float, float]:
    """Returns the standard deviation of the force that a table gives: its part that grows with the force, as
    a share of it, and the part that is there at any force [N]."""
    command, force, _ = model.columns
    if len(command) < FEWEST[0]:
        return 0.0, 0.0
    error = TableError(*line_error(len(command), ORDER, WEIGHTS, partial(_missed, command, force)))
    share = float(np.hypot(error.spacing, error.noise))
    return share, share * SMALL * float(np.abs(force).max())


def _missed(command: Array, force: Array, step: int) -> Array | None:
    """Errors of forces at the rows between each two of those kept, over their sizes."""
    kept = np.arange(0, len(command), step)
    left = np.arange(step // 2, kept[-1], step)
    if len(kept) < 2 or not len(left):
        return None
    found = np.interp(command[left], command[kept], force[kept])
    return np.asarray((found - force[left]) / np.hypot(force[left], SMALL * np.abs(force).max()))
