"""Tables: rows (one dict each) from records, and rows as an aligned text. Pure functions, numpy only."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from finlab.evaluation.statistics.bootstrap import (
    Interval,
    mean_interval,
    quantile_interval,
    ratio_interval,
    share_interval,
)
from finlab.evaluation.statistics.records import Records, same_targets

Row = dict[str, Any]

SUCCESS_LEVELS = (0.01, 0.05, 0.5, 1.0)
"""Levels t of `success@t`, the share of targets with `err_norm <= t`."""
MET = 0.05
"""Normalized error up to which a target counts as met when energies are compared."""
FIN_COUNT_COLUMNS = (
    "n",
    "err_norm_mean",
    "err_norm_median",
    "err_norm_p95",
    "success_0.01",
    "energy_mean",
    "power_mean",
)
"""Of `wrench_row`, in the table by number of fins."""
ENERGY_COLUMNS = ("energy_mean", "energy_ratio", "cheaper", "resting")
"""Columns without a value where no target was met by both."""


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


def rows_by_fin_count(records: Records, *, method: str) -> list[Row]:
    """Error and energy for each number of healthy fins (the paper's figure B as a table)."""
    rows = []
    for n_fins in np.unique(records.n_fins):
        row = wrench_row(records.select(records.n_fins == n_fins), split="", method=method)
        rows.append({"method": method, "fins": int(n_fins)} | {key: row[key] for key in FIN_COUNT_COLUMNS})
    return rows


def energy_rows(records: Records, reference: Records, *, method: str) -> list[Row]:
    """Energy over the reference's on the targets that both met, and resting fins: one row per fin count, and
    one over all of them, whose `fins` is "all"."""
    ours, theirs = same_targets(records, reference)
    both = (ours.err_norm <= MET) & (theirs.err_norm <= MET)
    rows: list[Row] = []
    for fins in [*np.unique(ours.n_fins).tolist(), "all"]:
        chosen = both | True if fins == "all" else ours.n_fins == fins
        a, b = ours.select(both & chosen), theirs.select(both & chosen)
        row: Row = {"method": method, "fins": fins, "n": int(chosen.sum()), "met_by_both": len(a)}
        row["success_0.01"] = float((ours.err_norm[chosen] <= 0.01).mean())
        rows.append(row | (_energy_columns(a, b) if len(a) else dict.fromkeys(ENERGY_COLUMNS)))
    return rows


def _energy_columns(ours: Records, theirs: Records) -> Row:
    """Energies and resting fins on targets that both met."""
    ends = ratio_interval(ours.energy, theirs.energy, ours.layout)
    return {
        "energy_mean": float(ours.energy.mean()),
        "energy_ratio": float(ours.energy.sum() / theirs.energy.sum()),
        "energy_ratio_low": ends.low,
        "energy_ratio_high": ends.high,
        "cheaper": float((ours.energy < theirs.energy).mean()),
        "resting": float(ours.resting.mean()),
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
