"""Rows and tables from records made by hand."""

import numpy as np
import pytest

from finlab.evaluation.paper_figures import paper_figures, paper_wrench_rows
from finlab.evaluation.statistics.records import Records
from finlab.evaluation.statistics.tables import (
    format_cell,
    text_table,
    wrench_intervals,
    wrench_row,
)

KEYS = [
    *("split", "method", "n", "scored_by"),
    *("err_norm_mean", "err_norm_median", "err_norm_p95", "err_norm_max", "err_phys_mean"),
    *("success_0.01", "success_0.05", "success_0.5", "success_1.0"),
    *("energy_mean", "power_mean", "solve_ms_p50", "solve_ms_p99"),
]
"""Keys of a row, in the order that users rely on."""


def _records(err_norm: list[float], n_fins: int = 3, energy: list[float] | None = None) -> Records:
    error = np.array(err_norm)
    n = len(error)
    return Records(
        layout=np.zeros(n, np.int64),
        target=np.arange(n),
        n_fins=np.full(n, n_fins),
        err_norm=error,
        err_phys=2 * error,
        energy=error + 1 if energy is None else np.array(energy),
        power=3 * error,
        resting=np.ones(n, np.int64),
        solve_ms=np.arange(n, dtype=float),
    )


def test_row_of_known_errors() -> None:
    row = wrench_row(_records([0.01, 0.05, 0.5, 1.0, 3.44]), split="id", method="qp")
    assert list(row) == KEYS
    assert (row["split"], row["method"], row["n"], row["scored_by"]) == ("id", "qp", 5, "plant")
    assert row["err_norm_mean"] == pytest.approx(1.0)
    assert row["err_norm_median"] == 0.5
    assert row["err_norm_max"] == 3.44
    assert row["err_norm_p95"] == pytest.approx(1.0 + 0.8 * 2.44)
    assert row["err_phys_mean"] == pytest.approx(2.0)
    assert [row[f"success_{level}"] for level in (0.01, 0.05, 0.5, 1.0)] == [0.2, 0.4, 0.6, 0.8]
    assert row["energy_mean"] == pytest.approx(2.0) and row["power_mean"] == pytest.approx(3.0)
    assert (row["solve_ms_p50"], row["solve_ms_p99"]) == (2.0, pytest.approx(3.96))


def test_intervals_hold_their_means() -> None:
    records = _records([0.01, 0.05, 0.5, 1.0, 3.44])
    row, found = wrench_row(records, split="id", method="qp"), wrench_intervals(records)
    assert set(found) < set(row)
    assert all(low - 1e-9 <= row[column] <= high + 1e-9 for column, (low, high) in found.items())
    assert found["success_1.0"].high == 1.0 and found["success_0.01"].high < 1.0


def test_paper_rows_have_our_columns() -> None:
    for split in ("id", "ood"):
        rows = paper_wrench_rows(split)
        assert len(rows) == 3
        assert all(set(row) <= set(KEYS) for row in rows)
    assert paper_wrench_rows("limits") == []
    assert paper_wrench_rows("id")[0]["err_norm_mean"] == 0.0857
    assert paper_figures()["ablation"]["ours"]["err_norm_mean"] == 3.03e-4


def test_text_table_aligns_and_leaves_gaps() -> None:
    lines = text_table([{"name": "a", "value": 1.5}, {"name": "long", "other": 12}]).splitlines()
    assert lines == ["name   value  other", "----  ------  -----", "a     1.5000", "long             12"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *((0.0, "0.0000"), (0.5, "0.5000"), (1.234e-5, "1.23e-05"), (2e7, "2.00e+07"), (None, "")),
        ([0.5, 2e-4], "[0.5000, 2.00e-04]"),
    ],
)
def test_cells(value: object, text: str) -> None:
    assert format_cell(value) == text
