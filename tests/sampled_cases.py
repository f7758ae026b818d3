"""Long tables of cases: a share runs every day, the others with `make test-all`."""

from collections.abc import Iterable
from itertools import product
from typing import Any

import pytest
from _pytest.mark import ParameterSet


def sampled(cases: Iterable[Any], every: int = 10) -> list[Any]:
    """Cases for `pytest.mark.parametrize`: each `every`-th as it is, the rest marked `exhaustive`.

    A case is a value, or a `pytest.param` of one or more values.
    """
    marked = []
    for number, case in enumerate(cases):
        param = case if isinstance(case, ParameterSet) else pytest.param(case)
        extra = [pytest.mark.exhaustive] if number % every else []
        marked.append(pytest.param(*param.values, marks=[*param.marks, *extra], id=param.id))
    return marked


def crossed(*values: Iterable[Any], every: int = 10) -> list[Any]:
    """`sampled` cases of several parameters: each of their combinations."""
    return sampled((pytest.param(*each) for each in product(*values)), every)
