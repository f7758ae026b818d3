"""The paper's figure A: what the temperature of the draw does to the candidates of its network."""

import numpy as np

from finlab.allocation.methods import choose_method
from finlab.arrays import Array
from finlab.axes import is_full_turn
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, progress
from finlab.research.evaluation.experiments.ablation import PAPER
from finlab.research.evaluation.experiments.wrench import MEASURES
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.evaluation.plots import temperature_picture
from finlab.research.evaluation.scoring import mean_interval, means_by_layout, paper_sigma
from finlab.research.evaluation.splits import make_split
from finlab.research.paper.pipeline import PaperSettings

PAPER_TEMPERATURE = 0.02
"""The paper's choice."""
TEMPERATURES = (0.001, 0.01, PAPER_TEMPERATURE, 0.05, 0.1, 0.5, 1.0, 10.0)


def run(
    temperatures: tuple[float, ...] = TEMPERATURES,
    split: str = "id",
    layouts: int = 100,
    targets: int = 2,
    candidates: int = 64,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each temperature, before any refinement. Raises DataError: a temperature of 0 or
    less.

    Args:
        temperatures: of the draw, above 0.
        split: name as in eval wrench.
        layouts: of the split.
        targets: on each layout.
        candidates: drawn for each target.
        checkpoint: of method paper, a shipped name or a folder.
        seed: of all draws.
    """
    if min(temperatures) <= 0.0:
        raise DataError(f"temperatures: expected numbers above 0, got {min(temperatures):g}")
    cases = make_split(split, layouts, targets, seed)
    rows: list[Row] = []
    for temperature in temperatures:
        options = {"n_candidates": candidates, "temperature": temperature, "refinement": "none"}
        method = MethodSpec("paper", choose_method("paper", checkpoint, **options))
        best = []
        spread = []
        group = []
        for k, case in enumerate(progress(cases, "layout", f"T = {temperature:g}")):
            for target in case.targets:
                samples = method.on(case.healthy).allocate(target, seed=seed).samples
                assert samples is not None
                error = np.linalg.norm((samples.wrench - target) / paper_sigma(), axis=-1)
                best.append((error**2 + PaperSettings.gamma * samples.effort).min())
                spread.append(diversity(samples.command, case.healthy))
                group.append(k)
        rows.append(
            {
                "temperature": temperature,
                "n": len(best),
                "diversity": float(np.mean(spread)),
                "best_j_mean": float(np.mean(best)),
                "best_j_mean_interval": list(mean_interval(np.array(best), np.array(group))),
                "best_j_mean_by_layout": means_by_layout(np.array(best), np.array(group)),
                "best_j_median": float(np.median(best)),
            }
        )
    return rows


def diversity(command: Array, layout: Layout) -> float:
    """Mean distance between two of the commands (K, n, 3): root mean square over all their entries,
    each in units of its range; zero directions of a full circle are compared the short way
    round."""
    width = np.maximum(layout.upper - layout.lower, 1e-9)
    first, second = np.triu_indices(len(command), k=1)
    if len(first) == 0:
        return 0.0
    gap = np.abs(command[first] - command[second])
    turns = is_full_turn(width[:, 2])
    gap[..., 2] = np.where(turns, np.minimum(gap[..., 2], 2 * np.pi - gap[..., 2]), gap[..., 2])
    return float(np.sqrt(((gap / width) ** 2).mean(axis=(1, 2))).mean())


experiment = Experiment(
    name="temperature",
    question="What does the temperature of the draw do to the candidates of the paper's network "
    "(figure A)?",
    columns=(
        Column("temperature", "T", "three"),
        Column("n", "targets", "count"),
        Column("diversity", "diversity", "three"),
        Column("best_j_mean", "best J, mean", "error", "best_j_mean_interval"),
        Column("best_j_median", "best J, median", "error"),
    ),
    run=run,
    note=(
        "Diversity, which the paper does not define: the mean distance between two candidates in "
        "units of the command ranges. J: squared error plus weighted effort, by the surrogate, "
        "before refinement."
    ),
    quick={"layouts": 10, "targets": 1},
    usual={"targets": 5},
    full={"targets": 20},
    pieces=("temperatures",),
    measures=(*MEASURES, *PAPER, "finlab/research/evaluation/experiments/temperature.py"),
    probe={"layouts": 2, "targets": 1},
    picture=temperature_picture,
)
