"""The paper's ablation: one stage of its pipeline changed at a time, scored by surrogate and
plant."""

from collections.abc import Sequence
from itertools import cycle, islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.methods import choose_method
from finlab.arrays import Array
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, paper_figures, progress
from finlab.research.evaluation.experiments.wrench import MEASURES
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.evaluation.plots import candidates_picture
from finlab.research.evaluation.scoring import (
    joined,
    mean_interval,
    means_by_layout,
    paper_sigma,
    score,
)
from finlab.research.evaluation.splits import SplitCase, make_split
from finlab.research.evaluation.verdict import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER = ("finlab/research/paper", "finlab/research/networks", "checkpoints/paper")
"""What decides the answers of method `paper`."""
VARIANTS: dict[str, dict[str, Any]] = {
    "mean_only": {"mean_only": True},
    "without_refinement": {"refinement": "none"},
    "nll_selection": {"ranking": "nll"},
    "random_warm_start": {"warm_start": "random"},
    "ours": {},
}
"""The paper's rows as options of method `paper`. Its mean-only row takes a tenth of the time of the
refined ones, so no refinement follows the mean."""
SCORES = (("surrogate", "believed", "believed_phys"), ("plant", "err_norm", "err_phys"))
"""What scores a command, and the columns of its errors: normalized, and in N and N m."""
TIMED_CALLS = 5
"""Single calls whose mean time a row shows, after one that is not counted."""


def run(
    variants: tuple[str, ...] = tuple(VARIANTS),
    split: str = "id",
    layouts: int = 20,
    targets: int = 100,
    candidates: int = 64,
    checkpoint: str | None = None,
    shown: int = 0,
    seed: int = 0,
) -> list[Row]:
    """Two rows for each variant, scored by the surrogate and by the plant.

    Args:
        variants: mean_only, without_refinement, nll_selection, random_warm_start, ours.
        split: name as in eval wrench.
        layouts: of the split.
        targets: on each layout.
        candidates: drawn for each target.
        checkpoint: of method paper, a shipped name or a folder.
        shown: layouts for whose first target each row has the candidates, raw and refined, as pairs
            of normalized error by the surrogate and effort (key points, in the JSON alone).
        seed: of all draws; all rows have the same cases and candidates.
    """
    check_names("variants", variants, VARIANTS)
    cases = make_split(split, layouts, targets, seed)
    rows: list[Row] = []
    for variant in variants:
        options = {"n_candidates": candidates, **VARIANTS[variant]}
        method = MethodSpec("paper", choose_method("paper", checkpoint, **options))
        times = [
            method.on(case.layout).allocate(case.targets[0], lost=case.lost, seed=seed).solve_ms
            for case in islice(cycle(cases), TIMED_CALLS + 1)
        ]
        parts = []
        sigma = paper_sigma()
        for k, case in enumerate(progress(cases, "layout", variant)):
            answer = method.on(case.layout).allocate_batch(case.targets, lost=case.lost, seed=seed)
            part = score(case, case.targets, answer.command, answer.solve_ms, number=k)
            assert answer.wrench_expected is not None
            missing = answer.wrench_expected - case.targets
            believed = {
                "believed": np.linalg.norm(missing / sigma, axis=-1),
                "believed_phys": np.linalg.norm(missing, axis=-1),
            }
            parts.append(part | believed)
        points = [candidate_points(method, case, seed) for case in cases[:shown]]
        scores = joined(parts)
        for scored_by, key, physical in SCORES:
            row = {
                "variant": variant,
                "scored_by": scored_by,
                **_errors_row(scores[key], scores[physical], scores["layout"]),
                "call_ms": float(np.mean(times[1:])),
            }
            if points and scored_by == "surrogate":
                row["points"] = points
            rows.append(row)
    return rows


def _errors_row(error: Array, error_phys: Array, layout: NDArray[np.int64]) -> Row:
    """Means of normalized errors (N,), of their squares, and of errors (N,) in N and N m; `layout`
    (N,) numbers the layout of each."""
    square = error**2
    return {
        "n": len(error),
        "j_norm_mean": float(square.mean()),
        "j_norm_mean_interval": list(mean_interval(square, layout)),
        "j_norm_mean_by_layout": means_by_layout(square, layout),
        "j_norm_std": float(square.std()),
        "err_norm_mean": float(error.mean()),
        "err_norm_median": float(np.median(error)),
        "err_phys_mean": float(error_phys.mean()),
        "err_phys_mean_interval": list(mean_interval(error_phys, layout)),
    }


def candidate_points(
    method: MethodSpec, case: SplitCase, seed: int
) -> dict[str, list[list[float]]]:
    """Normalized error by the surrogate and effort of the candidates for the first target of a
    case, `raw` as they were drawn and `refined`."""
    target = case.targets[0]
    answer = method.on(case.layout).allocate(target, lost=case.lost, seed=seed)
    points = {}
    for name, some in (("raw", answer.samples), ("refined", answer.candidates)):
        assert some is not None
        error = np.linalg.norm((some.wrench - target) / paper_sigma(), axis=-1)
        points[name] = np.column_stack([error, some.effort]).tolist()
    return points


def _picture(rows: Sequence[Row]) -> "Figure":
    """The candidates of the whole pipeline; those of the variants that were run without it."""
    whole = [row for row in rows if row["variant"] == "ours"]
    return candidates_picture(whole or rows)


def _printed(rows: Sequence[Row]) -> list[Row]:
    """The figures that the paper prints for the variants of `rows`."""
    return [
        {
            "variant": variant,
            "scored_by": "printed in the paper",
            "j_norm_mean": row["err_norm_mean"],
            "j_norm_std": row["err_norm_std"],
            "err_phys_mean": row["err_phys_mean"],
            "call_ms": 1e3 * row["time_s"],
        }
        for variant, row in paper_figures()["ablation"].items()
        if variant in {row["variant"] for row in rows}
    ]


def _compared(rows: Sequence[Row]) -> list[Comparison]:
    """Each figure of the paper's table beside ours, scored by the surrogate and by the plant."""
    compared = []
    for variant, figures in paper_figures()["ablation"].items():
        for scored_by, _, _ in SCORES:
            about = (variant, scored_by)
            row = next((r for r in rows if (r["variant"], r["scored_by"]) == about), {})
            for key, printed_key, words in (
                ("j_norm_mean", "err_norm_mean", "mean J_norm"),
                ("j_norm_std", "err_norm_std", "spread of J_norm"),
                ("err_phys_mean", "err_phys_mean", "wrench error"),
            ):
                compared.append(
                    Comparison(
                        f"{variant}, by the {scored_by}: {words}",
                        figures[printed_key],
                        row.get(key),
                        row.get(f"{key}_interval"),
                    )
                )
        row = next((r for r in rows if r["variant"] == variant), {})
        call_ms = row.get("call_ms")
        compared.append(
            Comparison(
                f"{variant}: time of a call in s",
                figures["time_s"],
                None if call_ms is None else 1e-3 * call_ms,
                obstacle="The paper timed another computer.",
            )
        )
    return compared


experiment = Experiment(
    name="ablation",
    question="What does each stage of the paper's pipeline bring? One stage is changed at a time.",
    columns=(
        Column("variant", "variant", "code"),
        Column("scored_by", "scored by"),
        Column("n", "targets", "count"),
        Column("j_norm_mean", "mean J_norm", "error", "j_norm_mean_interval"),
        Column("j_norm_std", "spread", "error"),
        Column("err_norm_mean", "mean of its root", "error"),
        Column("err_phys_mean", "wrench error in N and N m", "error", "err_phys_mean_interval"),
        Column("call_ms", "one call", "three", unit="ms"),
    ),
    run=run,
    note=(
        "The paper says neither which model scored its table nor whether its normalized error is "
        "J_norm, the squared norm of its equation, or the root: commands are scored twice here, "
        "and J_norm stands beside the printed value. The mean row refines nothing; the random "
        "warm start is the best four of as many uniform draws."
    ),
    quick={"layouts": 5, "targets": 4},
    usual={"layouts": 100, "targets": 5},
    full={"targets": 100},
    pieces=("variants",),
    measures=(*MEASURES, *PAPER, "finlab/research/evaluation/experiments/ablation.py"),
    probe={"layouts": 2, "targets": 2},
    compared=_compared,
    printed=_printed,
    picture=_picture,
    for_picture={"shown": 20},
)
