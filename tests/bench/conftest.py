"""Few problems: one robot of a set."""

from dataclasses import replace

import pytest

from finlab.bench.problems import Problems, open_problems


@pytest.fixture(scope="session")
def shipped() -> Problems:
    """The shipped problems."""
    return open_problems()


@pytest.fixture(scope="session")
def few(shipped: Problems) -> Problems:
    """Layout A: eleven targets, two paths of twelve wrenches."""
    quick = shipped.of_sets(["paper"]).quick()
    paths = quick.sequences
    short = {"wrench": paths.wrench[:, :12], "best_error": paths.best_error[:, :12]}
    return replace(quick, sequences=paths._replace(**short))
