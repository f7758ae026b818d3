"""Records: what one method did on each target, one entry per target, kept as NPZ files. Numpy only.

Every number of every table is computed from such records by pure functions. A file holds one array per
column, named as the fields of `Records`, and `meta`, a JSON text that says how the records were made.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError

Whole = NDArray[np.int64]
Columns = dict[str, AnyArray]

VERSION = 3
"""Of the file format; part of the settings that a file is found by."""


@dataclass(frozen=True)
class Records:
    """What one method did on N targets, one entry per target."""

    layout: Whole
    """Number of the layout in its split, from 0, shape (N,)."""
    target: Whole
    """Number of the target on its layout, from 0, shape (N,)."""
    n_fins: Whole
    """Healthy fins of the layout, shape (N,)."""
    err_norm: Array
    """`||(w - target) / sigma||`, shape (N,)."""
    err_phys: Array
    """The same without sigma, newton and newton metre mixed, shape (N,)."""
    energy: Array
    """Effort of the command, the paper's energy proxy J_en, shape (N,)."""
    power: Array
    """Mean mechanical power of the command [W], shape (N,)."""
    resting: Whole
    """Healthy fins that give less than a hundredth of the force they can give, shape (N,)."""
    solve_ms: Array
    """Time to solve [ms], shape (N,)."""

    def __len__(self) -> int:
        return len(self.err_norm)

    def select(self, keep: NDArray[np.bool_ | np.intp]) -> "Records":
        """The records where `keep` (N,) holds, or those at its places."""
        return Records(**{name: values[keep] for name, values in columns_of_records(self).items()})


def join_records(parts: list[Records]) -> Records:
    """One after the other."""
    columns = [columns_of_records(part) for part in parts]
    return Records(**{name: np.concatenate([part[name] for part in columns]) for name in columns[0]})


def columns_of_records(records: Records) -> Columns:
    """The arrays by their names."""
    return {field.name: getattr(records, field.name) for field in fields(Records)}


def records_of_columns(columns: Mapping[str, AnyArray]) -> Records:
    """Inverse of `columns_of_records`; other columns are left aside."""
    return Records(**{field.name: columns[field.name] for field in fields(Records)})


def save_columns(path: Path, columns: Mapping[str, AnyArray], meta: Mapping[str, Any]) -> None:
    """Write arrays and how they were made; the file appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, meta=np.array(json.dumps(dict(meta))), **columns)
    partial.replace(path)


def load_columns(path: Path) -> tuple[Columns, dict[str, Any]]:
    """What `save_columns` wrote: the arrays, and how they were made.

    Raises:
        DataError: missing, cut off, or not one of our files.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            columns = {name: file[name] for name in file.files}
        meta = json.loads(str(columns.pop("meta")))
    except (OSError, KeyError, ValueError, EOFError, BadZipFile) as error:
        raise DataError(f"{path}: not a file of records ({error}); delete it and run again") from error
    return columns, meta
