"""From the description of a fin's model to its law."""

import os
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.drag import Drag
from finlab.actuators.fin.lighthill import Lighthill
from finlab.actuators.fin.soft import Soft
from finlab.actuators.fin.table import GridLaw, TableLaw
from finlab.actuators.law import FinLaw, PlanarLaw
from finlab.bundle_files import archive_around
from finlab.layout.fin_model import FinModelSpec
from finlab.layout.force_table_file import read_force_table
from finlab.layout.layout import Layout

PLANAR_LAWS: dict[str, type[PlanarLaw]] = {"drag": Drag, "lighthill": Lighthill, "soft": Soft}
"""Fin model -> law with a formula; its parameters may be arrays, one number for each of n fins."""


def make_law(spec: FinModelSpec) -> FinLaw:
    """Returns the law of one fin model.

    Raises:
        DataError: it is a table whose file is missing or wrong.
    """
    values: dict[str, Any] = spec.values()
    if spec.type == "table":
        return _table(values["path"], file_stamp(spec))
    return PLANAR_LAWS[spec.type](**values)


def stack_laws(specs: Sequence[FinModelSpec]) -> list[tuple[NDArray[np.intp], FinLaw]]:
    """Returns the laws of n fins as (places, law); fins of one formula, and those with tables that tell the
    same quantities, are evaluated together.

    Raises:
        DataError: a table's file is missing or wrong.
    """
    laws = [make_law(spec) for spec in specs]
    kinds = [
        law.has_power if isinstance(law, TableLaw) else spec.type
        for spec, law in zip(specs, laws, strict=True)
    ]
    groups: list[tuple[NDArray[np.intp], FinLaw]] = []
    for kind in dict.fromkeys(kinds):
        places = np.array([i for i, own in enumerate(kinds) if own == kind])
        groups.append((places, _together([specs[i] for i in places], [laws[i] for i in places])))
    return groups


def _together(specs: list[FinModelSpec], laws: list[FinLaw]) -> FinLaw:
    """One law for fins of one formula, or with tables of as many columns."""
    if all(spec == specs[0] for spec in specs):
        return laws[0]
    tables = [law.grid for law in laws if isinstance(law, TableLaw)]
    if tables:
        return GridLaw(tables)
    rows: list[dict[str, Any]] = [spec.values() for spec in specs]
    return PLANAR_LAWS[specs[0].type](**{name: np.array([row[name] for row in rows]) for name in rows[0]})


def file_stamp(spec: FinModelSpec) -> tuple[int, int] | None:
    """Returns time and size of the file that a model reads, None where it reads none."""
    if spec.type != "table":
        return None
    path = str(spec.values()["path"])
    try:
        found = os.stat(archive_around(path) or path)
    except (OSError, ValueError):
        return 0, 0
    return found.st_mtime_ns, found.st_size


def file_stamps(layout: Layout) -> tuple[tuple[int, int] | None, ...]:
    """Returns the stamps of all fins of a layout, for what is kept of it until one of its files changes."""
    return tuple([file_stamp(fin.model) for fin in layout.fins])


def read_table(path: str | os.PathLike[str]) -> TableLaw:
    """Returns the law in a CSV file; errors as for `read_force_table`."""
    return TableLaw(*read_force_table(path))


@lru_cache(maxsize=64)
def _table(path: str, stamp: tuple[int, int] | None) -> TableLaw:
    """The table in a file, read again when the file has changed."""
    return read_table(path)
