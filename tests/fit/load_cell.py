"""A load cell that measures a fin whose law is known: what its files would hold."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.fit.measurements import Measurements
from finlab.layout import FinModelSpec
from finlab.physics import FinLaw, make_law

COMMAND_MIN = np.array([0.05, 0.2, -np.pi])
"""Least amplitude [rad], frequency [Hz] and zero direction [rad]."""
COMMAND_MAX = np.array([0.6, 2.1, np.pi])
"""Largest of the same."""


def soft(**numbers: float) -> FinLaw:
    """A soft fin."""
    return make_law(FinModelSpec("soft", tuple(numbers.items())))


def commands(n: int, seed: int = 0) -> Array:
    """Commands all over the nominal limits (n, 3)."""
    return COMMAND_MIN + np.random.default_rng(seed).random((n, 3)) * (COMMAND_MAX - COMMAND_MIN)


def measured(law: FinLaw, command: Array, noise: float = 0.05, seed: int = 1) -> Array:
    """Forces (n, 3) with noise that is a share of each."""
    force = law.force(command)
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    return np.asarray(
        force + noise * size * np.random.default_rng(seed).standard_normal(force.shape)
    )


def samples(command: Array, force: Array) -> Measurements:
    """As if read from a file."""
    places = tuple(f"line {k + 2}" for k in range(len(command)))
    return Measurements(command, force, None, places, ())


def write(path: Path, columns: Mapping[str, Array]) -> Path:
    """A CSV file with these columns."""
    rows = np.stack(list(columns.values()), axis=-1)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def columns_of(command: Array, force: Array) -> dict[str, Array]:
    """Columns of a file of cycle means."""
    names = ("A", "f", "phi", "Fx", "Fy", "Fz")
    return dict(zip(names, np.hstack([command, force]).T, strict=True))
