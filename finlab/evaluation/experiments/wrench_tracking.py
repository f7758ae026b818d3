"""Wrench tracking: methods over a split, every answer scored by the plant."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.ipopt import Ipopt
from finlab.arrays import Array
from finlab.evaluation.method_specs import method_and_starts
from finlab.evaluation.paper_figures import paper_wrench_rows
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.records import Records, join_records
from finlab.evaluation.statistics.tables import (
    FIN_COUNT_COLUMNS,
    energy_rows,
    rows_by_fin_count,
    text_table,
    wrench_intervals,
    wrench_row,
)
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy

RESTING = 0.01
"""A fin rests when it gives less than this share of the force that its limits allow."""


def run_method(
    allocator: Allocator,
    cases: Sequence[Case],
    *,
    seed: int = 0,
    single: int | None = None,
    first: int | None = None,
) -> Records:
    """What a method does on the cases of a split.

    Args:
        allocator: the method.
        cases: layouts with targets.
        seed: passed to the method.
        single: None solves all targets of a layout together and `solve_ms` is their time over their number;
            otherwise only the first so many targets of each layout are solved, one call each, each timed.
        first: only the first so many targets of each layout, solved together.
    """
    parts = []
    for k, case in enumerate(progress(cases, "layout", allocator.name)):
        targets = case.targets[: first if single is None else single]
        if single is None:
            answer = allocator.allocate_batch(case.layout, targets, failed=case.failed, seed=seed)
            command, solve_ms = answer.command, answer.solve_ms
        else:
            answers = [allocator.allocate(case.layout, t, failed=case.failed, seed=seed) for t in targets]
            command = np.array([answer.command for answer in answers])
            solve_ms = np.array([answer.solve_ms for answer in answers])
        parts.append(score(case, targets, command, solve_ms, allocator.normalization.std, number=k))
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


def wrench_rows(records: dict[str, Records], split: str) -> list[dict[str, Any]]:
    """The table's rows, one per method."""
    return [wrench_row(of_method, split=split, method=method) for method, of_method in records.items()]


def interval_rows(records: dict[str, Records], split: str) -> list[dict[str, Any]]:
    """Intervals of the table's columns, one row per method: [low, high] by column."""
    return [
        {"split": split, "method": method, **{k: list(v) for k, v in wrench_intervals(part).items()}}
        for method, part in records.items()
    ]


def energy_comparison(records: dict[str, Records]) -> list[dict[str, Any]]:
    """Energies of all methods over those of IPOPT, from the most starts that took part; none without it."""
    parsed = {name: method_and_starts(name) for name in records}
    usual = Ipopt.n_starts
    starts = {name: count or usual for name, (method, count) in parsed.items() if method == "ipopt"}
    if not starts or len(records) == 1:
        return []
    reference = max(starts, key=lambda name: starts[name])
    return [
        {"reference": reference, **row}
        for method, part in records.items()
        if method != reference
        for row in energy_rows(part, records[reference], method=method)
    ]


def wrench_report(records: dict[str, Records], split: str, *, single: int | None = None) -> str:
    """The table beside the paper's printed figures, its intervals, and the error by fin count, as text."""
    by_fins = [row for method, part in records.items() for row in rows_by_fin_count(part, method=method)]
    timing = "one call at a time" if single else "the time of all targets of a layout over their number"
    energies = energy_comparison(records)
    beside = [f"energy over that of {energies[0]['reference']}", text_table(energies), ""] if energies else []
    return "\n".join(
        [
            text_table([*wrench_rows(records, split), *paper_wrench_rows(split)]),
            "",
            "where a rerun with another seed lands, 95 times of 100 (bootstrap over layouts)",
            text_table(interval_rows(records, split), ("method", *FIN_COUNT_COLUMNS[1:])),
            "",
            text_table(by_fins),
            "",
            *beside,
            f"scored by the plant, the analytic fin model. solve_ms: {timing}.",
        ]
    )
