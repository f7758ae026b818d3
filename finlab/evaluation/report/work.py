"""What a job does: plain settings in, arrays out, so that it can run in a process of its own."""

from pathlib import Path
from typing import Any

from finlab.evaluation.experiments.ablation import ablation_method, run_variant
from finlab.evaluation.experiments.closed_loop_runs import run_all
from finlab.evaluation.experiments.cost import cost_rows
from finlab.evaluation.experiments.faults import all_faults, fault_rows, fault_scenarios
from finlab.evaluation.experiments.latency import latency_cases, latency_rows
from finlab.evaluation.experiments.temperature import refinement_columns, temperature_columns
from finlab.evaluation.experiments.training_study import train_and_run
from finlab.evaluation.experiments.trajectory_and_velocity import (
    trajectory_rows,
    trajectory_scenarios,
    velocity_rows,
    velocity_scenarios,
)
from finlab.evaluation.experiments.wrench_tracking import run_method
from finlab.evaluation.method_specs import Checkpoints, load_method_spec, load_method_specs
from finlab.evaluation.plots.closed_loop_experiments import Track, track_of
from finlab.evaluation.report.jobs import columns_of_rows
from finlab.evaluation.splits import make_split
from finlab.evaluation.statistics.records import Columns, columns_of_records
from finlab.layout import load_layout
from finlab.physics.objective import Name
from finlab.sim import make_trajectory

LATENCY_FINS = 4
"""Fins of the layouts whose calls are timed."""
PAPER_LAYOUTS = ("A", "B", "C", "D")
"""The paper's robots."""
TRACK = "track "
"""Leads the name of a column of time, position and reference (K, 7); layout and method follow."""


def wrench(
    *, split: str, layouts: int, targets: int, method: str, seed: int, checkpoint: str | None
) -> Columns:
    """Records of a method on a split."""
    cases = make_split(split, layouts, targets, seed)
    return columns_of_records(run_method(load_method_spec(method, checkpoint), cases))


def cost(
    *,
    split: str,
    objective: Name,
    methods: list[str],
    starts: int,
    layouts: int,
    targets: int,
    seed: int,
    checkpoint: str | None,
) -> Columns:
    """Rows of the comparison of costs on one set of cases."""
    allocators = load_method_specs(",".join(methods), checkpoint)
    drawn = {"layouts": layouts, "targets": targets, "seed": seed}
    return columns_of_rows(cost_rows(split, allocators, objective, n_starts=starts, **drawn))


def ablation(*, layouts: int, targets: int, candidates: int, seed: int, **options: Any) -> Columns:
    """Records of one variant, scored by plant and surrogate; options as in `ablation_method`."""
    method = ablation_method(n_candidates=candidates, **options)
    return run_variant(method, make_split("id", layouts, targets, seed), seed=seed)


def temperature(*, layouts: int, targets: int, seed: int, **options: Any) -> Columns:
    """Diversity and best J at one temperature; options as in `temperature_columns`."""
    return temperature_columns(make_split("id", layouts, targets, seed), seed=seed, **options)


def scatter(*, fins: int, targets: int, seed: int, checkpoint: str | None) -> Columns:
    """Candidates before and after refinement, on the first layout of so many fins."""
    cases = make_split("id", 40, targets, seed)
    case = next(case for case in cases if case.layout.n_fins == fins)
    return refinement_columns(case, checkpoint=checkpoint, seed=seed)


def latency(
    *, methods: list[str], calls: int, budget_s: float, seed: int, checkpoints: Checkpoints
) -> Columns:
    """Rows of the comparison of times, the fastest first; to be run with nothing beside it."""
    cases = latency_cases(LATENCY_FINS, seed)
    allocators = {name: load_method_spec(name, checkpoints.of(name)) for name in methods}
    rows = latency_rows(allocators, cases, n_calls=calls, budget_s=budget_s)
    return columns_of_rows(sorted(rows, key=lambda row: row["p50_ms"]))


def training(*, change: str, layouts: int, targets: int, seed: int, folder: str, **budget: Any) -> Columns:
    """Train with one thing changed and try the network; the budget as in `train_and_run`."""
    return train_and_run(change, make_split("id", layouts, targets, seed), Path(folder), seed=seed, **budget)


def trajectory(*, methods: str, runs: int, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the trajectory experiment, and one path on each layout, five points a second."""
    robots = [load_layout(name) for name in PAPER_LAYOUTS]
    scenarios = trajectory_scenarios(robots, make_trajectory("lissajous"))
    allocators = load_method_specs(methods, checkpoint)
    found = run_all(scenarios, allocators, range(seed, seed + runs))
    columns = columns_of_rows(trajectory_rows(found))
    for (layout, method), log in found:
        step = max(1, round(0.2 / float(log.time[1] - log.time[0])))
        columns.setdefault(f"{TRACK}{layout} {method}", track_of(log)[::step])
    return columns


def tracks_of_columns(columns: Columns) -> list[Track]:
    """The paths that `trajectory` kept."""
    tracks = []
    for name, track in columns.items():
        if name.startswith(TRACK):
            layout, _, method = name.removeprefix(TRACK).partition(" ")
            tracks.append(((layout, method), track))
    return tracks


def faults(*, methods: str, runs: int, pairs: bool, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the fault experiment on layout A."""
    robot, path = load_layout("A"), make_trajectory("circle")
    cases = [c for c in all_faults(robot, path.duration_s / 2) if pairs or len(c.fins) < 2]
    scenarios = fault_scenarios(robot, path, cases)
    found = run_all(scenarios, load_method_specs(methods, checkpoint), range(seed, seed + runs))
    return columns_of_rows(fault_rows(cases, found))


def velocity(*, methods: str, runs: int, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the velocity experiment on layout A."""
    allocators, seeds = load_method_specs(methods, checkpoint), range(seed, seed + runs)
    return columns_of_rows(velocity_rows(run_all(velocity_scenarios(load_layout("A")), allocators, seeds)))
