"""The paper's ablation: one stage of its pipeline changed at a time, scored by surrogate and plant."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.records import Records, join_records
from finlab.evaluation.splits import Case
from finlab.evaluation.tables import text_table
from finlab.evaluation.wrench import score

VARIANTS: dict[str, dict[str, Any]] = {
    "mean_only": {"mean_only": True, "refine": False},
    "without_refinement": {"refine": False},
    "nll_selection": {"ranking": "nll"},
    "random_warm_start": {"warm_start": "random"},
    "ours": {},
}
"""The paper's rows as options of method `paper`. Its mean-only row takes a tenth of the time of the refined
ones, so no refinement follows the mean."""
TIMED_CALLS = 10
"""Single calls whose mean time a row shows, after one that is not counted."""

Row = dict[str, Any]


def ablation_rows(
    cases: Sequence[Case],
    *,
    checkpoint: str | Path | None = None,
    n_candidates: int = 64,
    temperature: float = 0.02,
    seed: int = 0,
) -> list[Row]:
    """Two rows per variant, scored by the surrogate and by the plant; same cases, candidates and temperature.

    Args:
        cases: layouts with targets.
        checkpoint: of method `paper`; the shipped one by default.
        n_candidates: candidates drawn per target.
        temperature: of the draw.
        seed: same seed, same candidates.
    """
    rows: list[Row] = []
    for variant, options in tqdm(
        VARIANTS.items(), unit="variant", disable=None, leave=False, file=sys.stderr
    ):
        allocator = load_allocator(
            checkpoint, "paper", n_candidates=n_candidates, temperature=temperature, **options
        )
        time_s = _seconds_per_call(allocator, cases, seed)
        for scored_by, records in _score_twice(allocator, cases, seed).items():
            rows.append(_row(variant, scored_by, records, time_s))
    return rows


def _score_twice(allocator: Allocator, cases: Sequence[Case], seed: int) -> dict[str, Records]:
    """Records by the model that scored them, of the same commands."""
    parts: dict[str, list[Records]] = {"surrogate": [], "plant": []}
    sigma = allocator.normalization.std
    for case in tqdm(cases, desc="layouts", unit="layout", disable=None, leave=False, file=sys.stderr):
        answer = allocator.allocate_batch(case.layout, case.targets, failed=case.failed, seed=seed)
        by_plant = score(case, case.targets, answer, sigma)
        parts["plant"].append(by_plant)
        if answer.wrench_surrogate is not None:
            difference = answer.wrench_surrogate - case.targets
            believed = replace(
                by_plant,
                err_norm=np.linalg.norm(difference / sigma, axis=-1),
                err_phys=np.linalg.norm(difference, axis=-1),
            )
            parts["surrogate"].append(believed)
    return {name: join_records(part) for name, part in parts.items() if part}


def _seconds_per_call(allocator: Allocator, cases: Sequence[Case], seed: int) -> float:
    """Mean time of single calls [s]."""
    chosen = [cases[k % len(cases)] for k in range(TIMED_CALLS + 1)]
    results = [
        allocator.allocate(case.layout, case.targets[0], failed=case.failed, seed=seed) for case in chosen
    ]
    return float(np.mean([result.solve_ms for result in results[1:]])) / 1e3


def _row(variant: str, scored_by: str, records: Records, time_s: float) -> Row:
    return {
        "variant": variant,
        "scored_by": scored_by,
        "n": len(records),
        "err_norm_mean": float(records.err_norm.mean()),
        "err_norm_std": float(records.err_norm.std()),
        "err_phys_mean": float(records.err_phys.mean()),
        "time_s": time_s,
    }


def paper_ablation_rows() -> list[Row]:
    """The printed rows; the paper does not say which model scored them."""
    printed = paper_figures()["ablation"]
    return [{"variant": name, "scored_by": "(printed in the paper)", **row} for name, row in printed.items()]


def ablation_report(rows: Sequence[Row]) -> str:
    """Each variant's rows beside the paper's, as text."""
    order = list(VARIANTS)
    together = sorted([*rows, *paper_ablation_rows()], key=lambda row: order.index(row["variant"]))
    note = "time_s: mean of single calls. The paper does not say which model scored its figures."
    return f"{text_table(together)}\n\n{note}"
