"""Wrench tracking: methods over a split, every answer scored by the plant."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.method_specs import installed_methods, is_slow, load_method_specs
from finlab.evaluation.own_layout import layout_and_failed, own_case
from finlab.evaluation.paper_figures import paper_wrench_rows
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import SPLITS, Case, make_split
from finlab.evaluation.statistics.records import Records, join_records
from finlab.evaluation.statistics.tables import wrench_intervals, wrench_row
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy
from finlab.physics.objective import Name as Objective

RESTING = 0.01
"""A fin rests when it gives less than this share of the force that its limits allow."""


def run_method(
    allocator: Allocator, cases: Sequence[Case], *, seed: int = 0, first: int | None = None
) -> Records:
    """What a method does on the cases of a split; all targets of a layout are solved together.

    Args:
        allocator: the method.
        cases: layouts with targets.
        seed: passed to the method.
        first: only the first so many targets of each layout.
    """
    parts = []
    for k, case in enumerate(progress(cases, "layout", allocator.name)):
        targets = case.targets[:first]
        answer = allocator.allocate_batch(case.layout, targets, failed=case.failed, seed=seed)
        sigma = allocator.normalization.std
        parts.append(score(case, targets, answer.command, answer.solve_ms, sigma, number=k))
    return join_records(parts)


def score(
    case: Case, targets: Array, command: Array, solve_ms: Array, sigma: Array, *, number: int = 0
) -> Records:
    """Records of a method's answers to targets (N, 6) of a case, the wrench computed by the plant.

    Args:
        case: the layout.
        targets: desired wrenches (N, 6).
        command: the method's answers (N, n, 3).
        solve_ms: what each took (N,) [ms].
        sigma: per-axis standard deviation (6,), where the case has none of its own.
        number: of the layout in its split.
    """
    plant = plant_of(case.layout)
    difference = plant.wrench(command) - targets
    return Records(
        layout=np.full(len(targets), number, np.int64),
        target=np.arange(len(targets)),
        n_fins=np.full(len(targets), case.layout.n_fins - len(case.failed), np.int64),
        err_norm=np.linalg.norm(difference / (sigma if case.sigma is None else case.sigma), axis=-1),
        err_phys=np.linalg.norm(difference, axis=-1),
        energy=command_energy(command, plant.upper),
        power=np.nansum(plant.power(command), axis=-1),
        resting=_count_resting(plant, command),
        solve_ms=np.asarray(solve_ms, np.float64),
    )


def _count_resting(plant: Plant, command: Array) -> NDArray[np.int64]:
    """Healthy fins that rest (N,) in commands (N, n, 3): nearly no force beside their largest one."""
    force, largest = (np.linalg.norm(plant.fin_forces(u), axis=-1) for u in (command, plant.upper))
    rests = (force < RESTING * largest) & ~np.isnan(command).any(axis=-1)
    return np.asarray(rests.sum(axis=-1))


def run(
    layout: str | None = None,
    split: tuple[str, ...] = ("id",),
    methods: tuple[str, ...] | None = None,
    layouts: int = 100,
    targets: int = 1000,
    subsample: int = 10,
    objective: Objective = "power",
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each split and method.

    Args:
        layout: a layout file, graph file or shipped name in place of a split: one case, of that many targets,
            with errors over the robot's own wrenches.
        split: names, or all: id, ood, ood-fins, limits, failure, near-singular, fins, fins-mixed, tables,
            many-fins, perturbed, parallel, collinear, clustered, coincident, stacked, big, tiny.
        methods: names; by default search and paper, on LAYOUT all that are installed. An objective may
            follow, as in search-effort, and a number of starts ipopt, as in ipopt-32.
        layouts: of each split.
        targets: on each layout.
        subsample: ipopt answers only the first so many of each layout; column n says how many.
        objective: what methods that can choose keep least.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of all draws.
    """
    sets = _cases(layout, split, layouts, targets, seed)
    usual = ("search", "paper") if layout is None else installed_methods()
    allocators = load_method_specs(",".join(methods or usual), checkpoint, objective)
    rows: list[Row] = []
    for name, cases in sets.items():
        for method, allocator in allocators.items():
            found = run_method(allocator, cases, first=subsample if is_slow(method) else None)
            intervals = {f"{key}_interval": list(ends) for key, ends in wrench_intervals(found).items()}
            rows.append(wrench_row(found, split=name, method=method) | intervals)
    return rows


def _cases(
    layout: str | None, split: tuple[str, ...], layouts: int, targets: int, seed: int
) -> dict[str, list[Case]]:
    """Cases by the name of their set."""
    if layout is None:
        names = list(SPLITS) if split == ("all",) else split
        return {name: make_split(name, layouts, targets, seed) for name in names}
    if split != ("id",):
        raise DataError(
            f"split: a layout has none, got {','.join(split)!r} beside {layout!r:.60}; leave one of them out"
        )
    own = own_case(*layout_and_failed(layout), targets, seed)
    return {f"layout {own.layout.name}": [own]}


def _printed(rows: Sequence[Row]) -> list[Row]:
    return [row for split in dict.fromkeys(row["split"] for row in rows) for row in paper_wrench_rows(split)]


experiment = Experiment(
    name="wrench",
    question="How far off are the wrenches of each method, of those that a robot can deliver?",
    columns=(
        Column("split", "split", "code"),
        Column("method", "method", "code"),
        Column("n", "targets", "count"),
        Column("err_norm_mean", "mean error", "error", "err_norm_mean_interval"),
        Column("err_norm_median", "median", "error"),
        Column("err_norm_p95", "95th percentile", "error"),
        Column("err_norm_max", "largest", "error"),
        Column("success_0.01", "within 0.01", "share", "success_0.01_interval"),
        Column("success_0.5", "within 0.5", "share"),
        Column("power_mean", "mean power", "three", unit="W"),
        Column("solve_ms_p50", "median time", "three", unit="ms"),
    ),
    run=run,
    note=(
        "Scored by the plant. Errors in standard deviations of the wrenches of random layouts, on fins, "
        "fins-mixed, tables, big and tiny and on a layout of your own of the robot's. Intervals: where "
        "another seed lands, 95 times of 100. Time: that of all targets of a layout over their number."
    ),
    each="split",
    printed=_printed,
    less_is_better=("err_norm_mean",),
)
