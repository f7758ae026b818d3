"""What a job does: plain settings in, arrays out, so that it can run in a process of its own."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from finlab.assets import PAPER_LAYOUTS
from finlab.evaluation.experiments.ablation import ablation_method, run_variant
from finlab.evaluation.experiments.beyond_reach import beyond_reach_rows
from finlab.evaluation.experiments.closed_loop_runs import Run, Scenario, run_all
from finlab.evaluation.experiments.cost import cost_rows
from finlab.evaluation.experiments.faults import all_faults, fault_rows, fault_scenarios
from finlab.evaluation.experiments.first_answers import first_answer_rows
from finlab.evaluation.experiments.hard_days import choose_days
from finlab.evaluation.experiments.latency import latency_cases, latency_rows
from finlab.evaluation.experiments.mode_coverage import mode_rows
from finlab.evaluation.experiments.network import network_rows
from finlab.evaluation.experiments.noisy_sequences import noisy_sequence_rows
from finlab.evaluation.experiments.steadiness import steadiness_rows
from finlab.evaluation.experiments.swims import swim_all
from finlab.evaluation.experiments.temperature import refinement_columns, temperature_columns
from finlab.evaluation.experiments.training_study import train_and_run
from finlab.evaluation.experiments.trajectory_and_velocity import (
    trajectory_rows,
    trajectory_scenarios,
    velocity_rows,
    velocity_scenarios,
)
from finlab.evaluation.experiments.unreachable import unreachable_rows
from finlab.evaluation.experiments.wrench_tracking import run_method
from finlab.evaluation.method_specs import Checkpoints, load_method_spec
from finlab.evaluation.plots.closed_loop_experiments import Track, track_of
from finlab.evaluation.report.jobs import columns_of_rows
from finlab.evaluation.splits import make_split
from finlab.evaluation.statistics.records import Columns, columns_of_records
from finlab.layout import load_layout
from finlab.physics.objective import Name
from finlab.sim import make_trajectory

LATENCY_FINS = 4
"""Fins of the layouts whose calls are timed."""
PATIENCE_S = 60.0
"""Processor time [s] that a target may take where answers count and not times: a clock that cut a solver
short would do so elsewhere in the next run. Starts and steps end it long before."""
TRACK = "track "
"""Leads the name of a column of time, position and reference (K, 7); layout and method follow."""


def wrench(
    *, split: str, layouts: int, targets: int, method: str, seed: int, checkpoints: Checkpoints
) -> Columns:
    """Records of a method on a split."""
    cases = make_split(split, layouts, targets, seed)
    return columns_of_records(run_method(_patient([method], checkpoints)[method], cases))


rerun = wrench
"""The same with another seed."""


def cost(
    *, split: str, objective: Name, methods: list[str], starts: int, checkpoints: Checkpoints, **drawn: int
) -> Columns:
    """Rows of the comparison of costs on one set of cases; drawn as in `cost_rows`."""
    allocators = _patient(methods, checkpoints)
    return columns_of_rows(cost_rows(split, allocators, objective, n_starts=starts, **drawn))


def network(*, fins: int, objective: Name, checkpoints: Checkpoints, **drawn: int) -> Columns:
    """Rows of what the network buys for one number of fins and one objective; drawn as in `network_rows`."""
    method = load_allocator("mdn", checkpoint=checkpoints.of("mdn"))
    return columns_of_rows(network_rows(method, [fins], objective, **drawn))


def modes(*, layouts: int, targets: int, starts: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the comparison of distinct ways, for least effort."""
    cases = make_split("id", layouts, targets, seed)
    method = load_method_spec("search-effort", checkpoints.of("search"))
    return columns_of_rows(mode_rows(method, cases, n_starts=starts, seed=seed))


def unreachable(*, layouts: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of what is delivered of wrenches out of reach."""
    method = load_method_spec("search", checkpoints.of("search"))
    return columns_of_rows(unreachable_rows(method, n_layouts=layouts, seed=seed))


def beyond(*, layouts: int, targets: int, methods: list[str], seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of what methods miss on the boundary of what robots can do, and beyond."""
    allocators = _patient(methods, checkpoints)
    return columns_of_rows(beyond_reach_rows(allocators, layouts=layouts, targets=targets, seed=seed))


def sequences(
    *, layouts: list[str], paths: int, ticks: int, methods: list[str], seed: int, checkpoints: Checkpoints
) -> Columns:
    """Rows of what commands change by along noisy sequences."""
    robots = [load_layout(name) for name in layouts]
    allocators = _patient(methods, checkpoints)
    return columns_of_rows(noisy_sequence_rows(allocators, robots, n_paths=paths, ticks=ticks, seed=seed))


def steadiness(*, layouts: list[str], paths: int, ticks: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the turns along smooth paths."""
    robots = [load_layout(name) for name in layouts]
    method = load_method_spec("search", checkpoints.of("search"))
    return columns_of_rows(steadiness_rows(method, robots, n_paths=paths, ticks=ticks, seed=seed))


def first_answers(*, robots: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the times until the first answer for fins that were not seen before."""
    method = load_method_spec("search", checkpoints.of("search"))
    return columns_of_rows(first_answer_rows(method, robots=robots, seed=seed))


def latency(
    *, methods: list[str], calls: int, budget_s: float, seed: int, checkpoints: Checkpoints
) -> Columns:
    """Rows of the comparison of times, the fastest first; to be run with nothing beside it."""
    cases = latency_cases(LATENCY_FINS, seed)
    rows = latency_rows(_allocators(methods, checkpoints), cases, n_calls=calls, budget_s=budget_s)
    return columns_of_rows(sorted(rows, key=lambda row: row["p50_ms"]))


def ablation(
    *, layouts: int, targets: int, candidates: int, seed: int, checkpoints: Checkpoints, **options: Any
) -> Columns:
    """Records of one variant, scored by plant and surrogate; options as in `ablation_method`."""
    method = ablation_method(n_candidates=candidates, checkpoint=checkpoints.of("paper"), **options)
    return run_variant(method, make_split("id", layouts, targets, seed), seed=seed)


def temperature(
    *, layouts: int, targets: int, temperature: float, seed: int, checkpoints: Checkpoints
) -> Columns:
    """Diversity and best J at one temperature."""
    cases = make_split("id", layouts, targets, seed)
    return temperature_columns(cases, temperature, checkpoint=checkpoints.of("paper"), seed=seed)


def scatter(*, fins: int, targets: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Candidates before and after refinement, on the first layout of so many fins."""
    cases = make_split("id", 40, targets, seed)
    case = next(case for case in cases if case.layout.n_fins == fins)
    return refinement_columns(case, checkpoint=checkpoints.of("paper"), seed=seed)


def training(*, change: str, layouts: int, targets: int, seed: int, folder: str, **budget: Any) -> Columns:
    """Train with one thing changed and try the network; the budget as in `train_and_run`."""
    return train_and_run(change, make_split("id", layouts, targets, seed), Path(folder), seed=seed, **budget)


def trajectory(*, methods: str, runs: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the trajectory experiment, and one path on each layout, five points a second."""
    robots = [load_layout(name) for name in PAPER_LAYOUTS]
    scenarios = trajectory_scenarios(robots, make_trajectory("lissajous"))
    found = _swim(scenarios, methods, runs, seed, checkpoints)
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


def faults(*, methods: str, runs: int, pairs: bool, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the fault experiment on layout A."""
    robot, path = load_layout("A"), make_trajectory("circle")
    cases = [c for c in all_faults(robot, path.duration_s / 2) if pairs or len(c.fins) < 2]
    found = _swim(fault_scenarios(robot, path, cases), methods, runs, seed, checkpoints)
    return columns_of_rows(fault_rows(cases, found))


def velocity(*, methods: str, runs: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Rows of the velocity experiment on layout A."""
    scenarios = velocity_scenarios(load_layout("A"))
    return columns_of_rows(velocity_rows(_swim(scenarios, methods, runs, seed, checkpoints)))


def swims(*, scenarios: str, methods: str, seeds: int, seed: int, checkpoints: Checkpoints) -> Columns:
    """Swims of hard days, each with its figures."""
    found = swim_all(
        choose_days(scenarios), _allocators(methods.split(","), checkpoints), range(seed, seed + seeds)
    )
    return columns_of_rows([swim._asdict() for swim in found])


slow_swims = swims


def _swim(
    scenarios: Sequence[Scenario], methods: str, runs: int, seed: int, checkpoints: Checkpoints
) -> list[Run]:
    return run_all(scenarios, _allocators(methods.split(","), checkpoints), range(seed, seed + runs))


def _allocators(methods: Sequence[str], checkpoints: Checkpoints) -> dict[str, Allocator]:
    """Methods by name, each from its own checkpoint."""
    return {name: load_method_spec(name, checkpoints.of(name)) for name in methods}


def _patient(methods: Sequence[str], checkpoints: Checkpoints) -> dict[str, Allocator]:
    """The same, none of them ended by the clock."""
    found = _allocators(methods, checkpoints)
    limited = [name for name, method in found.items() if "time_limit_s" in method.option_names()]
    return found | {name: found[name].with_settings(time_limit_s=PATIENCE_S) for name in limited}
