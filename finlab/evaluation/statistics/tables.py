"""Tables: rows (one dict each) from records, and rows as an aligned text. Pure functions, numpy only."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from finlab.evaluation.statistics.bootstrap import (
    Interval,
    mean_interval,
    quantile_interval,
    share_interval,
)
from finlab.evaluation.statistics.records import Records

Row = dict[str, Any]

SUCCESS_LEVELS = (0.01, 0.05, 0.5, 1.0)
"""Levels t of `success@t`, the share of targets with `err_norm <= t`."""


def wrench_row(records: Records, *, split: str, method: str) -> Row:
    """One row of the wrench table, from at least one target."""
    error = records.err_norm
    shares = {f"success_{level}": float((error <= level).mean()) for level in SUCCESS_LEVELS}
    return {
        "split": split,
        "method": method,
        "n": len(records),
        "scored_by": "plant",
        "err_norm_mean": float(error.mean()),
        "err_norm_median": float(np.median(error)),
        "err_norm_p95": float(np.quantile(error, 0.95)),
        "err_norm_max": float(error.max()),
        "err_phys_mean": float(records.err_phys.mean()),
        **shares,
        "energy_mean": float(records.energy.mean()),
        "power_mean": float(records.power.mean()),
        "solve_ms_p50": float(np.quantile(records.solve_ms, 0.5)),
        "solve_ms_p99": float(np.quantile(records.solve_ms, 0.99)),
    }


def wrench_intervals(records: Records) -> dict[str, Interval]:
    """Where the columns of `wrench_row` would lie in a rerun with another seed, by column."""
    error, group = records.err_norm, records.layout
    shares = {f"success_{level}": share_interval(error <= level, group) for level in SUCCESS_LEVELS}
    return {
        "err_norm_mean": mean_interval(error, group),
        "err_norm_median": quantile_interval(error, 0.5, group),
        "err_norm_p95": quantile_interval(error, 0.95, group),
        "err_phys_mean": mean_interval(records.err_phys, group),
        "energy_mean": mean_interval(records.energy, group),
        "power_mean": mean_interval(records.power, group),
        **shares,
    }


def format_cell(value: object) -> str:
    """A cell as text: small and large numbers with three significant digits, nothing for a missing one, an
    interval in brackets."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_cell, value))}]"
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, bool) or not isinstance(value, float):
        return str(value)
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.4f}"
    return f"{value:.2e}"


def text_table(rows: Sequence[Row], columns: Sequence[str] | None = None) -> str:
    """Columns padded with spaces, numbers to the right, a rule under the heading; by default every key that
    occurs, in order of first appearance."""
    columns = list(columns or dict.fromkeys(key for row in rows for key in row))
    lines = [[format_cell(row.get(column)) for column in columns] for row in rows]
    rule = ["-" * max([len(column), *(len(line[i]) for line in lines)]) for i, column in enumerate(columns)]
    return aligned(
        columns, [rule, *lines], [any(isinstance(row.get(c), str) for row in rows) for c in columns]
    )


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))
