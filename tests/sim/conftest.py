"""Robots and a method that are quick to make."""

import pytest

from finlab.allocation.allocator import Allocator
from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout


@pytest.fixture(scope="session")
def layout_a() -> Layout:
    return load_layout(shipped_layouts()["A"])


@pytest.fixture(scope="session")
def analytic() -> Allocator:
    """The quickest method; it takes only the normalization from a checkpoint."""
    from finlab.allocation import load_allocator

    return load_allocator("analytic")
