"""The paper's ablation: one stage of its pipeline changed at a time, scored by surrogate and plant.

The same five rows are run twice: refined by Adam as in the paper, and by Levenberg-Marquardt steps that take
about as long.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from finlab.evaluation.experiments.wrench_tracking import score
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.records import Records, join_records
from finlab.evaluation.statistics.tables import Row, text_table

VARIANTS: dict[str, dict[str, Any]] = {
    "mean_only": {"mean_only": True},
    "without_refinement": {"refinement": "none"},
    "nll_selection": {"ranking": "nll"},
    "random_warm_start": {"warm_start": "random"},
    "ours": {},
}
"""The paper's rows as options of method `paper`. Its mean-only row takes a tenth of the time of the refined
ones, so no refinement follows the mean."""
REFINEMENTS = ("adam", "levenberg-marquardt")
"""Refinements of method `paper` that are compared."""
TIMED_CALLS = 10
"""Single calls whose mean time a row shows, after one that is not counted."""


class Scored(NamedTuple):
    """What one variant did, scored twice, the same commands."""

    plant: Records
    """By the analytic fin model."""
    surrogate: Records
    """By the surrogate that refined them."""
    call_s: float
    """Mean time of single calls [s]."""


def ablation_method(
    variant: str,
    refinement: str = "adam",
    *,
    checkpoint: str | Path | None = None,
    n_candidates: int = 64,
    temperature: float = 0.02,
) -> Allocator:
    """The method of a row.

    Args:
        variant: one of `VARIANTS`.
        refinement: one of `REFINEMENTS`.
        checkpoint: of method `paper`; the shipped one by default.
        n_candidates: candidates drawn per target.
        temperature: of the draw.

    Raises:
        AllocationError: unknown refinement.
    """
    options = {"n_candidates": n_candidates, "temperature": temperature, "refinement": refinement}
    method: Allocator = load_allocator("paper", checkpoint=checkpoint, **{**options, **VARIANTS[variant]})
    return method


def run_variant(allocator: Allocator, cases: Sequence[Case], *, seed: int = 0) -> Scored:
    """One row's records; same cases and seed, same candidates in every row that draws them."""
    call_s = _seconds_per_call(allocator, cases, seed)
    plant: list[Records] = []
    surrogate: list[Records] = []
    sigma = allocator.normalization.std
    bar = tqdm(cases, desc="layouts", unit="layout", disable=None, leave=False, file=sys.stderr)
    for k, case in enumerate(bar):
        answer = allocator.allocate_batch(case.layout, case.targets, failed=case.failed, seed=seed)
        by_plant = score(case, case.targets, answer.command, answer.solve_ms, sigma, number=k)
        plant.append(by_plant)
        assert answer.wrench_surrogate is not None
        difference = answer.wrench_surrogate - case.targets
        norm, phys = (np.linalg.norm(d, axis=-1) for d in (difference / sigma, difference))
        surrogate.append(replace(by_plant, err_norm=norm, err_phys=phys))
    return Scored(join_records(plant), join_records(surrogate), call_s)


def ablation_row(variant: str, refinement: str, scored_by: str, records: Records, call_s: float) -> Row:
    """One row of the table, with the interval of its mean."""
    ends = mean_interval(records.err_norm, records.layout)
    return {
        "variant": variant,
        "refinement": refinement,
        "scored_by": scored_by,
        "n": len(records),
        "err_norm_mean": float(records.err_norm.mean()),
        "err_norm_mean_interval": list(ends),
        "err_norm_std": float(records.err_norm.std()),
        "err_norm_median": float(np.median(records.err_norm)),
        "err_phys_mean": float(records.err_phys.mean()),
        "time_s": call_s,
    }


def ablation_rows(cases: Sequence[Case], *, seed: int = 0, **options: Any) -> list[Row]:
    """Four rows per variant: each refinement, scored by the surrogate and by the plant.

    Same cases, candidates and temperature in all of them; options as in `ablation_method`.
    """
    pairs = [(variant, refinement) for variant in VARIANTS for refinement in REFINEMENTS]
    rows: list[Row] = []
    for variant, refinement in tqdm(pairs, unit="row", disable=None, leave=False, file=sys.stderr):
        scored = run_variant(ablation_method(variant, refinement, **options), cases, seed=seed)
        for name, records in (("surrogate", scored.surrogate), ("plant", scored.plant)):
            rows.append(ablation_row(variant, refinement, name, records, scored.call_s))
    return rows


def _seconds_per_call(allocator: Allocator, cases: Sequence[Case], seed: int) -> float:
    """Mean time of single calls [s]."""
    chosen = [cases[k % len(cases)] for k in range(TIMED_CALLS + 1)]
    results = [
        allocator.allocate(case.layout, case.targets[0], failed=case.failed, seed=seed) for case in chosen
    ]
    return float(np.mean([result.solve_ms for result in results[1:]])) / 1e3


def paper_ablation_rows() -> list[Row]:
    """The printed rows; the paper does not say which model scored them."""
    printed = paper_figures()["ablation"]
    return [{"variant": name, "scored_by": "(printed in the paper)", **row} for name, row in printed.items()]


def ablation_report(rows: Sequence[Row]) -> str:
    """Each variant's rows beside the paper's, as text."""
    order = list(VARIANTS)
    together = sorted([*rows, *paper_ablation_rows()], key=lambda row: order.index(row["variant"]))
    note = (
        "time_s: mean of single calls. err_norm_mean_interval: where a rerun with another seed lands, 95 "
        "times of 100. The paper does not say which model scored its figures."
    )
    return f"{text_table(together)}\n\n{note}"
