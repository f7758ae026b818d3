"""A bundle of the shipped checkpoint, made once."""

import pytest

import finlab
from finlab.allocation import Allocator
from finlab.deploy.bundle import Bundle, make_bundle


@pytest.fixture(scope="session")
def shipped_allocator() -> Allocator:
    """The product's default."""
    return finlab.load_allocator()


@pytest.fixture(scope="session")
def bundle(shipped_allocator: Allocator) -> Bundle:
    """Layout A with the shipped checkpoint."""
    return make_bundle(finlab.load_layout("A"), shipped_allocator)
