"""Wrench tracking: methods over a split, every answer scored by the plant."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from finlab.allocation.allocation import BatchAllocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.energy import command_energy
from finlab.evaluation.metrics import Records, join_records, make_records, rows_by_fin_count, wrench_row
from finlab.evaluation.paper_figures import paper_wrench_rows
from finlab.evaluation.splits import Case
from finlab.evaluation.tables import text_table
from finlab.physics import Plant

Array = NDArray[np.float64]


def run_method(
    allocator: Allocator, cases: Sequence[Case], *, seed: int = 0, single: int | None = None
) -> Records:
    """What a method does on the cases of a split.

    Args:
        allocator: the method.
        cases: layouts with targets.
        seed: passed to the method.
        single: None solves all targets of a layout together and `solve_ms` is their time over their number;
            otherwise only the first so many targets of each layout are solved, one call each, each timed.
    """
    parts = []
    # disable=None: a bar on a terminal, nothing elsewhere
    bar = tqdm(cases, desc=allocator.name, unit="layout", disable=None, leave=False, file=sys.stderr)
    for case in bar:
        targets = case.targets if single is None else case.targets[:single]
        if single is None:
            answer = allocator.allocate_batch(case.layout, targets, failed=case.failed, seed=seed)
        else:
            answer = _one_by_one(allocator, case, targets, seed)
        parts.append(score(case, targets, answer, allocator.normalization.std))
    return join_records(parts)


def score(case: Case, targets: Array, answer: BatchAllocation, sigma: Array) -> Records:
    """Records of a method's answers to targets (N, 6) of a case, the wrench computed by the plant."""
    upper = np.array([fin.limits.upper for fin in case.layout.fins])
    return make_records(
        wrench=Plant(case.layout).wrench(answer.command),
        target=targets,
        sigma=sigma,
        energy=command_energy(answer.command, upper),
        solve_ms=answer.solve_ms,
        n_fins=case.layout.n_fins - len(case.failed),
    )


def _one_by_one(allocator: Allocator, case: Case, targets: Array, seed: int) -> BatchAllocation:
    results = [allocator.allocate(case.layout, target, failed=case.failed, seed=seed) for target in targets]
    return BatchAllocation(
        np.array([result.command for result in results]),
        None,
        np.array([result.solve_ms for result in results]),
    )


def wrench_rows(records: dict[str, Records], split: str) -> list[dict[str, Any]]:
    """The table's rows, one per method."""
    return [wrench_row(of_method, split=split, method=method) for method, of_method in records.items()]


def wrench_report(records: dict[str, Records], split: str, *, single: int | None = None) -> str:
    """The table beside the paper's printed figures, and the error by fin count, as text."""
    by_fins = [row for method, part in records.items() for row in rows_by_fin_count(part, method=method)]
    timing = (
        "solve_ms: the time of all targets of a layout over their number."
        if single is None
        else "solve_ms: one call at a time."
    )
    return "\n".join(
        [
            text_table([*wrench_rows(records, split), *paper_wrench_rows(split)]),
            "",
            text_table(by_fins),
            "",
            f"scored by the plant, the analytic fin model. {timing}",
        ]
    )
