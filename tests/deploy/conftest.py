"""Bundles of shipped layouts, made once, and a robot with measured fins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.layout import FinModelSpec, Layout
from finlab.physics import make_law, write_table
from tests.allocator_cache import AllocatorCache


@pytest.fixture(scope="session")
def shipped_allocator() -> AllocatorCache:
    """The product's default."""
    return AllocatorCache()


@pytest.fixture(scope="session")
def bundle(shipped_allocator: AllocatorCache) -> Bundle:
    """Layout A for the product's default."""
    return make_bundle(shipped_allocator.on(finlab.load_layout("A")))


@pytest.fixture(scope="session")
def force_table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of a soft fin, which saturates and leans."""
    path = tmp_path_factory.mktemp("tank") / "soft fin.csv"
    numbers = (("k", 4.0), ("x0", 0.9), ("e", 0.15), ("phi_e", 0.7), ("d", 0.1))
    grid = np.linspace(0.0, 0.6, 9), np.linspace(0.0, 2.1, 10), np.linspace(-np.pi, np.pi, 13)
    write_table(path, make_law(FinModelSpec("soft", numbers)), *grid)
    return path


@pytest.fixture(scope="session")
def measured(force_table: Path) -> Layout:
    """Layout `mixed` with a measured fin in the place of one of its laws."""
    layout = finlab.load_layout("mixed")
    table = FinModelSpec("table", (("path", str(force_table)),))
    fins = (*layout.fins[:2], replace(layout.fins[2], model=table), layout.fins[3])
    return replace(layout, name="measured", actuators=fins)


@pytest.fixture(scope="session")
def measured_bundle(measured: Layout, shipped_allocator: AllocatorCache) -> Bundle:
    """That robot for the product's default."""
    return make_bundle(shipped_allocator.on(measured))
