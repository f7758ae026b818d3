"""Tables of loads by heading, such as those of a wind tunnel or a towing tank."""

from __future__ import annotations

import os

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import DataError
from finlab.files.csv_table import read_table

MAX_BYTES = 1_000_000
"""Largest table that is read [bytes]."""
HEADING = "heading_deg"
"""Name of the column of headings."""


def read_loads(path: str | os.PathLike[str]) -> tuple[tuple[float, ...], Array]:
    """Returns the loads in a CSV file: a column `heading_deg`, and one for each axis of a wrench
    that is not 0, `Fx` to `Tz`, in N and N m.

    Args:
        path: the file.

    Returns:
        Headings (H,) [deg], clockwise from ahead, and wrenches (H, 6) on the robot [N, N m].

    Raises:
        DataError: it cannot be read, or has other columns; the message names line and column.
    """
    table = read_table(path, MAX_BYTES, "a CSV table of loads by heading")
    known = (HEADING, *AXES)
    wrong = [name for name in table.header if name not in known]
    is_twice = len(set(table.header)) < len(table.header)
    if HEADING not in table.header or len(table.header) < 2 or wrong or is_twice:
        raise DataError(
            f"{table.source}: expected columns {HEADING} and some of {', '.join(AXES)}, each once, "
            f"got {', '.join(table.header)}"
        )
    numbers, _ = table.numbers(range(len(table.header)))
    wrench = np.zeros((len(numbers), 6))
    for k, name in enumerate(table.header):
        if name in AXES:
            wrench[:, AXES.index(name)] = numbers[:, k]
    headings = numbers[:, table.header.index(HEADING)]
    return tuple(headings.tolist()), wrench
