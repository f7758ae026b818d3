"""What each part of the paper's training brings: small trainings on equal budgets, one thing changed at a
time."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.learned.paper import PaperAllocator
from finlab.evaluation.experiments.wrench_tracking import run_method
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.records import Columns, columns_of_records
from finlab.evaluation.statistics.tables import Row
from finlab.inference.checkpoint import resolve_checkpoint

LM_STEPS = 4
"""Levenberg-Marquardt steps after which the refined error is taken."""


@dataclass(frozen=True)
class Change:
    """What differs from the recipe at hand."""

    title: str
    """In words."""
    training: dict[str, Any] = field(default_factory=dict)
    """Fields of `AllocatorTraining`."""
    network: dict[str, Any] = field(default_factory=dict)
    """Fields of `NetworkConfig`."""


CHANGES = {
    "recipe": Change("the recipe of the paper's network, at this budget"),
    "no_guidance": Change("imitation alone, no physics guidance", {"guidance": 0.0, "guidance_start": 0.0}),
    "weak_guidance": Change("guidance of a thousandth of the weight", {"guidance": 1.0}),
    "unramped": Change("guidance in full from the first step", {"guidance_start": 1000.0}),
    "no_entropy": Change("no entropy term", {"entropy": 0.0}),
    "nominal_limits": Change("every layout with nominal limits", {"varied_limits": 0.0}),
    "one_component": Change("one Gaussian per fin instead of a mixture", network={"n_components": 1}),
}
"""Name -> change; the first one changes nothing."""


def train_and_run(
    name: str, cases: Sequence[Case], folder: Path, *, preset: str, steps: int, batch_size: int, seed: int = 0
) -> Columns:
    """Train with one change and try the network on cases; a training that was cut off goes on.

    Columns: those of `Records` for the best of 64 raw candidates by the surrogate, `refined_err_norm` and
    `refined_energy` after a few Levenberg-Marquardt steps, and `train_s`, the seconds of training. All are
    scored by the plant; in all of them the surrogate of the shipped checkpoint `paper` guides, ranks and
    refines.

    Args:
        name: one of `CHANGES`.
        cases: layouts with targets.
        folder: of the training run.
        preset: recipe that is changed.
        steps: optimizer steps.
        batch_size: samples per step.
        seed: of data and weights.
    """
    from finlab.training.allocator import train_allocator

    change = CHANGES[name]
    start = time.perf_counter()
    trained = train_allocator(
        preset,
        folder,
        surrogate=resolve_checkpoint("paper"),
        seed=seed,
        network=change.network,
        steps=steps,
        batch_size=batch_size,
        **change.training,
    )
    train_s = time.perf_counter() - start
    raw = run_method(PaperAllocator(trained, refinement="none"), cases, seed=seed)
    few_steps = PaperAllocator(trained, refinement="levenberg-marquardt", n_steps=LM_STEPS)
    refined = run_method(few_steps, cases, seed=seed)
    after = {"refined_err_norm": refined.err_norm, "refined_energy": refined.energy}
    return columns_of_records(raw) | after | {"train_s": np.array(train_s)}


def training_row(name: str, columns: Columns) -> Row:
    """One row of the table."""
    raw, refined, group = columns["err_norm"], columns["refined_err_norm"], columns["layout"]
    return {
        "change": name,
        "n": len(raw),
        "err_norm_mean": float(raw.mean()),
        "err_norm_mean_interval": list(mean_interval(raw, group)),
        "energy_mean": float(columns["energy"].mean()),
        "refined_err_norm_mean": float(refined.mean()),
        "refined_err_norm_mean_interval": list(mean_interval(refined, group)),
        "refined_success_0.01": float((refined <= 0.01).mean()),
        "refined_energy_mean": float(columns["refined_energy"].mean()),
        "train_s": float(columns["train_s"]),
    }
