"""Columns of cycle means that no working sensor gives: those that never change, or stop at one value."""

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError

ROUNDED = 1e-9
"""Share of the largest force below which a value is nothing but rounding errors."""
FLAT_TOP = 5
"""Commands that give exactly the largest force, or the least, from which a sensor counts as saturated ..."""
FLAT_SHARE = 0.02
"""... if they are this share of all rows."""


def check_sensors(
    source: str, command: Array, force: Array, power: Array | None, places: tuple[str, ...], turned: bool
) -> None:
    """Refuse columns that never change, and those that stop at one value again and again.

    Args:
        source: the files' names.
        command: half amplitude [rad], frequency [Hz], zero direction [rad], (n, 3).
        force: Fx, Fy, Fz [N], (n, 3).
        power: [W], (n,), where it was measured.
        places: where each row stands.
        turned: whether several zero directions were measured: then both forces across the shaft change.

    Raises:
        DataError: there is such a column; the message names the first row.
    """
    nothing = ROUNDED * np.abs(force).max()
    columns = dict(zip(("Fx", "Fy", "Fz"), force.T, strict=True)) | ({} if power is None else {"P": power})
    for name, column in columns.items():
        needed = name == "P" or (turned and name != "Fx")
        if np.ptp(column) == 0.0 and (needed or abs(column[0]) > nothing):
            raise DataError(
                f"{source}: column {name} is {column[0]:.4g} throughout; is the sensor connected?"
            )
        values, counts = np.unique(column, return_counts=True)
        # A coarse sensor repeats all its values.
        usual = int(counts[1:-1][np.abs(values[1:-1]) > nothing].max(initial=1))
        for extreme in values[[0, -1]]:
            there = np.flatnonzero(column == extreme)
            many = len(np.unique(command[there], axis=0))
            if abs(extreme) > nothing and many >= max(FLAT_TOP, FLAT_SHARE * len(column), 3 * usual):
                raise DataError(
                    f"{places[there[0]]}, column {name}: is exactly {extreme:.4g} as in {len(there) - 1} "
                    "other rows, and beyond it in none; the sensor is saturated, measure in a wider range"
                )
