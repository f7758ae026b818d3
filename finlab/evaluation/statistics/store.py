"""A folder of results, each found by what it depends on, so that work that was done is not done again."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.evaluation.statistics.records import VERSION, load_columns, save_columns

Columns = dict[str, NDArray[Any]]


class Result(NamedTuple):
    """What a job gave."""

    columns: Columns
    """Arrays by name."""
    meta: dict[str, Any]
    """How they were made: settings, seconds, commit, time of day."""


class Store:
    """Results on disk, one NPZ file each, named after the job and a digest of its settings."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, name: str, settings: Mapping[str, Any]) -> Path:
        """Where a result lies, or will lie."""
        text = json.dumps({"version": VERSION, **settings}, sort_keys=True)
        return self.folder / f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.npz"

    def has(self, name: str, settings: Mapping[str, Any]) -> bool:
        """Whether the work is done."""
        return self.path(name, settings).is_file()

    def load(self, name: str, settings: Mapping[str, Any]) -> Result:
        """A result that is there; `DataError` if it is not."""
        return Result(*load_columns(self.path(name, settings)))

    def keep(
        self, name: str, settings: Mapping[str, Any], make: Callable[[], Columns], **meta: Any
    ) -> Result:
        """The result that is there, or else the one that `make` gives, kept with the settings and `meta`."""
        if not self.has(name, settings):
            start = time.perf_counter()
            columns = make()
            made = {
                "settings": dict(settings),
                "seconds": time.perf_counter() - start,
                "made": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
                **meta,
            }
            save_columns(self.path(name, settings), columns, made)
        return self.load(name, settings)


def columns_of_rows(rows: list[dict[str, Any]]) -> Columns:
    """Rows of a finished table as one column of JSON texts, for results that have no entry per target."""
    return {"rows": np.array([json.dumps(row) for row in rows])}


def rows_of_columns(columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Inverse of `columns_of_rows`."""
    return [json.loads(str(text)) for text in columns["rows"]]
