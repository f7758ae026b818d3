"""The paper's ablation: one stage of its pipeline changed at a time, scored by surrogate and plant.

The same five rows are run twice: refined by Adam as in the paper, and by Levenberg-Marquardt steps.
"""

from collections.abc import Sequence
from itertools import cycle, islice, product
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from finlab.evaluation.experiments.wrench_tracking import score
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.records import Columns, columns_of_records, join_records
from finlab.evaluation.statistics.tables import Row

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


def ablation_method(
    variant: str,
    refinement: str = "adam",
    *,
    checkpoint: str | Path | None = None,
    n_candidates: int = 64,
    temperature: float = 0.02,
) -> Allocator:
    """The method of a row: one of `VARIANTS` with one of `REFINEMENTS`; `AllocationError` for another one.

    The checkpoint is one of method `paper`, by default the shipped one. So many candidates are drawn for each
    target, at this temperature.
    """
    options = {"n_candidates": n_candidates, "temperature": temperature, "refinement": refinement}
    method: Allocator = load_allocator("paper", checkpoint=checkpoint, **{**options, **VARIANTS[variant]})
    return method


def run_variant(allocator: Allocator, cases: Sequence[Case], *, seed: int = 0) -> Columns:
    """What one variant does; same cases and seed, same candidates in every row that draws them.

    Columns: those of `Records`, scored by the plant; `surrogate_err_norm` and `surrogate_err_phys`, the same
    commands scored by the surrogate that refined them; `call_s`, the mean time of single calls [s].
    """
    times = [
        allocator.allocate(case.layout, case.targets[0], failed=case.failed, seed=seed).solve_ms
        for case in islice(cycle(cases), TIMED_CALLS + 1)
    ]
    parts, believed = [], []
    sigma = allocator.normalization.std
    for k, case in enumerate(progress(cases, "layout")):
        answer = allocator.allocate_batch(case.layout, case.targets, failed=case.failed, seed=seed)
        parts.append(score(case, case.targets, answer.command, answer.solve_ms, sigma, number=k))
        assert answer.wrench_surrogate is not None
        believed.append(answer.wrench_surrogate - case.targets)
    difference = np.concatenate(believed)
    return columns_of_records(join_records(parts)) | {
        "surrogate_err_norm": np.linalg.norm(difference / sigma, axis=-1),
        "surrogate_err_phys": np.linalg.norm(difference, axis=-1),
        "call_s": np.array(np.mean(times[1:]) / 1e3),
    }


def variant_rows(variant: str, refinement: str, columns: Columns) -> list[Row]:
    """The two rows of a variant, scored by the surrogate and by the plant, with the intervals of the means.

    `j_norm` is the paper's J_norm, the squared norm of the normalized error, `err_norm` its root; `err_phys`
    is the norm in N and N m.
    """
    rows: list[Row] = []
    for scored_by, prefix in (("surrogate", "surrogate_"), ("plant", "")):
        error, physical = columns[f"{prefix}err_norm"], columns[f"{prefix}err_phys"]
        square = error**2
        rows.append(
            {
                "variant": variant,
                "refinement": refinement,
                "scored_by": scored_by,
                "n": len(error),
                "j_norm_mean": float(square.mean()),
                "j_norm_mean_interval": list(mean_interval(square, columns["layout"])),
                "j_norm_std": float(square.std()),
                "err_norm_mean": float(error.mean()),
                "err_norm_mean_interval": list(mean_interval(error, columns["layout"])),
                "err_norm_std": float(error.std()),
                "err_norm_median": float(np.median(error)),
                "err_phys_mean": float(physical.mean()),
                "err_phys_square_mean": float((physical**2).mean()),
                "time_s": float(columns["call_s"]),
            }
        )
    return rows


def ablation_rows(cases: Sequence[Case], *, seed: int = 0, **options: Any) -> list[Row]:
    """Four rows per variant: each refinement, scored by the surrogate and by the plant.

    Same cases, candidates and temperature in all of them; options as in `ablation_method`.
    """
    return [
        row
        for pair in progress(list(product(VARIANTS, REFINEMENTS)), "row")
        for row in variant_rows(*pair, run_variant(ablation_method(*pair, **options), cases, seed=seed))
    ]
