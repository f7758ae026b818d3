"""What several allocation tests need."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from tests.allocator_cache import AllocatorCache


@pytest.fixture
def force_table(tmp_path: Path) -> str:
    """A CSV table of the default fin's forces on a grid, and its path."""
    grid = itertools.product(
        np.linspace(0.0, 0.6, 7), np.linspace(0.0, 2.1, 6), np.linspace(-math.pi, math.pi, 25)
    )
    rows = ["A,f,phi,Fx,Fy,Fz"]
    for amplitude, frequency, direction in grid:
        thrust = 4.737410112522892 * (frequency * math.sin(amplitude)) ** 2
        force = (0.0, thrust * math.cos(direction), thrust * math.sin(direction))
        rows.append(
            ",".join(f"{value:.12g}" for value in (amplitude, frequency, direction, *force))
        )
    path = tmp_path / "forces.csv"
    path.write_text("\n".join(rows) + "\n")
    return str(path)


@pytest.fixture(scope="session")
def search() -> AllocatorCache:
    """The product's default method."""
    return AllocatorCache()
