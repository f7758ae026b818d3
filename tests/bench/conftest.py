"""Few problems, made anew: one robot of a set."""

import pytest

from finlab.bench.problems import Problems, open_problems


@pytest.fixture(scope="session")
def shipped() -> Problems:
    """The shipped problems."""
    return open_problems()


@pytest.fixture(scope="session")
def few(shipped: Problems) -> Problems:
    """Layout A: eleven targets, two paths."""
    return shipped.of_sets(["paper"]).quick()
