"""What the network of method `mdn` is worth: its proposals beside random ones, refined in the same way."""

import time
from itertools import product
from typing import Any

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.evaluate import REACHED
from finlab.arrays import Array
from finlab.evaluation.experiment import Experiment, check_names
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import SPLITS, Case, make_split
from finlab.evaluation.statistics.bootstrap import ratio_interval

STARTS = ("network", "random")
"""What is compared."""
WIDE: dict[str, Any] = {"starts": "random", "n_candidates": 256}
"""Settings of the wide search whose effort counts among the least."""


def run(
    split: tuple[str, ...] = ("id", "ood-fins", "many-fins"),
    layouts: int = 20,
    targets: int = 32,
    candidates: tuple[int, ...] = (4, 16, 48),
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """Two rows for each split and number of proposals: with the network, and with random forces.

    Args:
        split: names as in eval wrench.
        layouts: of each split.
        targets: on each layout, answered as one batch.
        candidates: proposals for each target; a quarter of them, six at most, are refined.
        checkpoint: of method mdn, a shipped name or a folder.
        seed: of the cases and of all draws.
    """
    check_names("split", split, SPLITS)
    return [row for name in split for row in _rows(name, layouts, targets, candidates, checkpoint, seed)]


def _rows(
    split: str, layouts: int, targets: int, candidates: tuple[int, ...], checkpoint: str | None, seed: int
) -> list[Row]:
    cases = make_split(split, layouts, targets, seed)
    settings = {
        (starts, count): {"starts": starts, "n_candidates": count, "n_refined": min(6, max(1, count // 4))}
        for count, starts in product(candidates, STARTS)
    }
    effort = {key: list[Array]() for key in (*settings, "wide")}
    spent = {key: list[float]() for key in settings}
    for case in progress(cases, "layout", split):
        wide = Allocator(case.healthy, "mdn", checkpoint=checkpoint, **WIDE)
        effort["wide"].append(_efforts(wide, case, seed)[0])
        for key, chosen in settings.items():
            found, seconds = _efforts(wide.with_settings(**chosen), case, seed)
            effort[key].append(found)
            spent[key].append(1e3 * seconds / len(case.targets))
    all_efforts = {key: np.concatenate(parts) for key, parts in effort.items()}
    least = np.min(list(all_efforts.values()), axis=0)
    group = np.repeat(np.arange(len(cases)), [len(case.targets) for case in cases])
    rows: list[Row] = []
    for starts, count in settings:
        cost = all_efforts[starts, count]
        both = np.isfinite(cost)
        ratio = cost[both] / least[both]
        rows.append(
            {
                "split": split,
                "starts": starts,
                "candidates": count,
                "n": len(cost),
                "tracked": float(both.mean()),
                "cost_ratio": float(cost[both].sum() / least[both].sum()),
                "cost_ratio_interval": list(ratio_interval(cost[both], least[both], group[both])),
                "ratio_p95": float(np.quantile(ratio, 0.95)),
                "target_ms": float(np.median(spent[starts, count])),
            }
        )
    return rows


def _efforts(allocator: Allocator, case: Case, seed: int) -> tuple[Array, float]:
    """Efforts (N,) of the answers to a case's targets, infinite where one was missed, and the time [s]."""
    start = time.process_time()
    answer = allocator.allocate_batch(case.targets, seed=seed)
    seconds = time.process_time() - start
    assert answer.effort is not None
    return np.where(answer.err_norm <= REACHED, answer.effort, np.inf), seconds


experiment = Experiment(
    name="proposals",
    question="What is the network of method `mdn` worth, beside random proposals that are refined alike?",
    columns=(
        Column("split", "split", "code"),
        Column("starts", "proposals"),
        Column("candidates", "each", "count"),
        Column("n", "targets", "count"),
        Column("tracked", "delivered", "share"),
        Column("cost_ratio", "effort over the least", "ratio", "cost_ratio_interval"),
        Column("ratio_p95", "95 % up to", "ratio"),
        Column("target_ms", "a target", "three", unit="ms"),
    ),
    run=run,
    note=(
        "The least effort is that of all rows and of a wide search from 256 random forces. Time is "
        "the processor's for a target of a batch."
    ),
    quick={"layouts": 4, "targets": 8},
    full={"layouts": 30},
)
