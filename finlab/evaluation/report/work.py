"""What a job does: plain settings in, arrays out. Each function loads what it needs, so that it can run in a
process of its own."""

from __future__ import annotations

from typing import Any

import numpy as np

from finlab.evaluation.report.work_closed_loop import faults, trajectory, velocity
from finlab.evaluation.splits import make_split
from finlab.evaluation.statistics.records import columns_of_records
from finlab.evaluation.statistics.store import Columns, columns_of_rows

MOST_FINS = 8
"""Commands are padded to so many fins, those that are not there hold NaN."""
LATENCY_FINS = 4
"""Their fins."""


def wrench(
    *, split: str, layouts: int, targets: int, method: str, seed: int, checkpoint: str | None
) -> Columns:
    """Records of a method on a split."""
    from finlab.evaluation.experiments.wrench_tracking import run_method
    from finlab.evaluation.method_specs import load_method_spec

    cases = make_split(split, layouts, targets, seed)
    return columns_of_records(run_method(load_method_spec(method, checkpoint), cases))


def energy(*, layouts: int, targets: int, method: str, seed: int, checkpoint: str | None) -> Columns:
    """Records of a method on split `id`, with its commands (N, 8, 3), so that each can be checked again."""
    from finlab.evaluation.experiments.wrench_tracking import score
    from finlab.evaluation.method_specs import load_method_spec
    from finlab.evaluation.statistics.records import join_records

    allocator, parts, commands = load_method_spec(method, checkpoint), [], []
    for k, case in enumerate(make_split("id", layouts, targets, seed)):
        answer = allocator.allocate_batch(case.layout, case.targets)
        parts.append(
            score(case, case.targets, answer.command, answer.solve_ms, allocator.normalization.std, number=k)
        )
        padded = np.full((len(case.targets), MOST_FINS, 3), np.nan)
        padded[:, : case.layout.n_fins] = answer.command
        commands.append(padded)
    return columns_of_records(join_records(parts)) | {"command": np.concatenate(commands)}


def ablation(
    *,
    variant: str,
    refinement: str,
    layouts: int,
    targets: int,
    candidates: int,
    temperature: float,
    seed: int,
    checkpoint: str | None,
) -> Columns:
    """Records of one variant, scored by plant and surrogate, and the time of single calls."""
    from finlab.evaluation.experiments.ablation import ablation_method, run_variant

    method = ablation_method(
        variant, refinement, checkpoint=checkpoint, n_candidates=candidates, temperature=temperature
    )
    scored = run_variant(method, make_split("id", layouts, targets, seed), seed=seed)
    believed = {
        "surrogate_err_norm": scored.surrogate.err_norm,
        "surrogate_err_phys": scored.surrogate.err_phys,
    }
    return columns_of_records(scored.plant) | believed | {"call_s": np.array(scored.call_s)}


def temperature(
    *, temperature: float, layouts: int, targets: int, seed: int, checkpoint: str | None
) -> Columns:
    """Diversity and best J at one temperature."""
    from finlab.evaluation.experiments.temperature import temperature_columns

    cases = make_split("id", layouts, targets, seed)
    return temperature_columns(cases, temperature, checkpoint=checkpoint, seed=seed)


def scatter(*, fins: int, targets: int, seed: int, checkpoint: str | None) -> Columns:
    """Candidates before and after refinement, on the first layout of so many fins."""
    from finlab.evaluation.experiments.temperature import refinement_columns

    cases = make_split("id", 40, targets, seed)
    case = next(case for case in cases if case.layout.n_fins == fins)
    return refinement_columns(case, checkpoint=checkpoint, seed=seed)


def seeds(*, layouts: int, targets: int, candidates: int, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the comparison of the network's seeds with random ones."""
    from finlab.evaluation.experiments.seeds import learned_allocator, seed_rows

    cases = make_split("id", layouts, targets, seed)
    return columns_of_rows(seed_rows(learned_allocator(checkpoint), cases, n_seeds=candidates, seed=seed))


def latency(
    *,
    methods: list[str],
    calls: int,
    budget_s: float,
    seed: int,
    checkpoint: str | None,
    paper_checkpoint: str | None,
) -> Columns:
    """Rows of the comparison of times; to be run with nothing beside it."""
    from finlab.evaluation.experiments.latency import latency_cases, latency_rows
    from finlab.evaluation.method_specs import load_method_spec

    cases = latency_cases(LATENCY_FINS, seed)
    allocators = {
        name: load_method_spec(name, paper_checkpoint if name == "paper" else checkpoint) for name in methods
    }
    return columns_of_rows(latency_rows(allocators, cases, n_calls=calls, budget_s=budget_s))


def training(
    *,
    change: str,
    preset: str,
    steps: int,
    batch_size: int,
    layouts: int,
    targets: int,
    seed: int,
    folder: str,
) -> Columns:
    """Train with one thing changed and try the network."""
    from pathlib import Path

    from finlab.evaluation.experiments.training_study import train_and_run

    return train_and_run(
        change,
        make_split("id", layouts, targets, seed),
        Path(folder),
        preset=preset,
        steps=steps,
        batch_size=batch_size,
        seed=seed,
    )


WORK: dict[str, Any] = {
    function.__name__: function
    for function in (
        wrench,
        energy,
        ablation,
        temperature,
        scatter,
        seeds,
        latency,
        training,
        trajectory,
        faults,
        velocity,
    )
}
"""Name of the work -> what does it."""
