"""A force table in a few kilobytes, for a link: values are rounded, then predicted from their neighbours.

Forces are whole multiples of a small share of the largest force, power likewise. Between neighbours on a
smooth grid they hardly change, and their slopes hardly do: the second differences along all three axes are
small numbers, which compress well. The uncertainties of a fit, which no allocation reads, stay behind.
"""

import csv
import io
import json
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.plain_values import parse_json
from finlab.files.schema import checked
from finlab.layout.angles import TURN
from finlab.physics.table_file import COLUMNS, POWER_COLUMN, parse_table

LEVELS = (32_768, 8_192, 2_048)
"""How many steps there may be from zero to the largest value: the finest first."""
_Head = tuple[tuple[list[float], list[float], list[float]], list[float], bool, list[str]]
NOTE = "rounded for a link, to "
"""How a table's note begins that came by one."""


def accuracy(levels: int) -> str:
    """Largest error of a value at a grid's point, as a share of the largest one, in words."""
    return f"{50.0 / levels:.2g} %"


def rounded(content: bytes, source: str, levels: int = LEVELS[0]) -> bytes:
    """The CSV file of a force table in few bytes, once they are compressed.

    Args:
        content: the file.
        source: what errors call it.
        levels: how many steps there are from zero to the largest value.

    Raises:
        DataError: it is no force table.
    """
    law = parse_table(content, source)
    axes, values, periodic = law.grid
    forces = [np.abs(values[..., :3]).max()] * 3
    steps = np.array([*forces, *values[..., 3:].max((0, 1, 2))]) / levels
    whole = np.rint(values / steps).astype(np.int64)
    for axis in (0, 1, 2, 0, 1, 2):
        whole = np.diff(whole, axis=axis, prepend=0)
    folded = np.where(whole < 0, -2 * whole - 1, 2 * whole).astype("<u4")  # small ones have small bytes
    digits = np.moveaxis(folded, -1, 0).ravel().view(np.uint8).reshape(-1, 4)
    notes = [note for note in law.notes if not note.startswith(NOTE)]
    notes.append(f"{NOTE}{accuracy(levels)} of the largest force and power")
    about = [[axis.tolist() for axis in axes], steps.tolist(), periodic, notes]
    return json.dumps(about, separators=(",", ":")).encode() + b"\n" + digits.T.tobytes()


def written(content: bytes, source: str) -> bytes:
    """The CSV file of a rounded table; it comes from a stranger and may hold anything.

    Raises:
        DataError: it is none; the message calls it `source`.
    """
    head, _, digits = content.partition(b"\n")
    try:
        told = parse_json(head.decode(), source)
        axes, steps, periodic, notes = checked(told, _Head, DataError, source)
        grid = [np.array(axis, dtype=np.float64) for axis in axes]
        values = _values(digits, tuple(len(axis) for axis in grid), np.array(steps, dtype=np.float64))
        lines = [f"# {' '.join(str(note).split())[:300]}" for note in notes]  # one line each
    except ValueError:
        raise DataError(
            f"{source}: holds no force table; copy all of the link, or ask for the file"
        ) from None
    if periodic:  # the first direction again, at the end, says that the circle is closed
        grid[2], values = np.append(grid[2], grid[2][0] + TURN), np.concatenate([values, values[:, :, :1]], 2)
    commands = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1)
    table: Any = np.concatenate([commands, values], axis=-1).reshape(-1, 3 + values.shape[-1])
    text = io.StringIO()
    text.writelines(f"{line}\n" for line in lines)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, POWER_COLUMN][: table.shape[1]])
    writer.writerows(table.tolist())  # with all digits: rounded again, the table is the same
    return text.getvalue().encode()


def _values(digits: bytes, shape: tuple[int, ...], steps: Array) -> Array:
    """Forces [N] and power [W] (a, f, d, 3 or 4) from bytes.

    Raises:
        ValueError: there are more or fewer.
    """
    if len(shape) != 3 or min(shape) == 0 or steps.shape not in ((3,), (4,)):
        raise ValueError
    columns = np.frombuffer(digits, np.uint8).reshape(4, -1).T
    folded = np.ascontiguousarray(columns).view("<u4").reshape(len(steps), *shape).astype(np.int64)
    whole = np.where(folded % 2 == 1, -(folded + 1) // 2, folded // 2)
    for axis in (1, 2, 3, 1, 2, 3):
        whole = np.cumsum(whole, axis=axis)
    values: Array = np.moveaxis(whole, 0, -1) * steps
    return values
