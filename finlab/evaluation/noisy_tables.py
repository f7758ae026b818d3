"""Fins as they would be known from a tank: a grid of forces with noise, in a CSV file."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from finlab.layout import Fin, FinModelSpec
from finlab.physics import TableLaw, make_law, write_table

GRID = (8, 9, 12)
"""Amplitudes, frequencies and zero directions of a table; the first two range over the fin's limits, the last
over the circle."""
NOISE = 0.03
"""Standard deviation of each component of a force, as a share of it."""


def noisy_table(rng: np.random.Generator, fin: Fin, name: str) -> Fin:
    """A fin with a table of its model in place of the model; the file of that name is written once."""
    path = Path(_folder().name) / f"{name}.csv"
    if not path.exists():
        ranges = zip((fin.limits.amplitude, fin.limits.frequency), GRID, strict=False)
        axes = [np.linspace(*ends, count) for ends, count in ranges]
        axes.append(np.linspace(-np.pi, np.pi, GRID[2], endpoint=False))
        force = make_law(fin.model).force(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
        noisy = np.asarray(force * (1.0 + NOISE * rng.standard_normal(force.shape)))
        write_table(path, TableLaw(axes, noisy, periodic=True), *axes)
    return replace(fin, model=FinModelSpec("table", (("path", str(path)),)))


@cache
def _folder() -> "TemporaryDirectory[str]":
    """Where this process keeps its tables; gone when it ends."""
    return TemporaryDirectory(prefix="finlab-tables-")
