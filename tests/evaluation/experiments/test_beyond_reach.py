"""On the boundary and beyond: what is missed is measured from the least that is possible."""

import pytest

from finlab.allocation import load_allocator
from finlab.errors import DataError
from finlab.evaluation.experiments.beyond_reach import beyond_reach_rows

pytest.importorskip("casadi")


def test_nobody_errs_less_than_possible_and_the_search_hardly_more() -> None:
    methods = {name: load_allocator(name) for name in ("search", "analytic")}
    rows = beyond_reach_rows(methods, layouts=3, targets=2, seed=11)
    found = {(row["factor"], row["method"]): row for row in rows}
    assert [factor for factor, _ in found] == [1.0, 1.0, 1.2, 1.2, 2.0, 2.0, 3.0, 3.0]
    least = [found[factor, "search"]["least_mean"] for factor in (1.0, 1.2, 2.0, 3.0)]
    assert least[0] < 1e-3 < least[1] < least[2] < least[3]
    for row in rows:
        assert row["n"] == 6 and row["excess_median"] > -1e-3
        low, high = row["excess_mean_interval"]
        assert low <= row["excess_mean"] <= high
    assert all(found[factor, "search"]["excess_max"] < 0.01 for factor in (1.0, 1.2, 2.0, 3.0))
    assert found[3.0, "analytic"]["excess_mean"] > 0.1  # a pseudo-inverse does not know what to give up


def test_the_judge_knows_one_law() -> None:
    with pytest.raises(DataError, match="split: expected one whose fins follow the judge's law"):
        beyond_reach_rows({"search": load_allocator()}, layouts=2, targets=1, seed=0, split="fins")
