"""Wrenches on the boundary of what a robot can do, and beyond it: what each method misses above the least.

A direction is that of a random command's wrench, so that it can be pushed at all. IPOPT finds how far it goes
(`Judge.largest_share`), and for each multiple of that wrench the least error that any forces leave
(`Judge.least_error`); no method under test has a part in either. The plant scores the answers.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiments.unreachable import Judge
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import make_split
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.tables import Row
from finlab.physics import plant_of

FACTORS = (1.0, 1.2, 2.0, 3.0)
"""Targets, over the largest wrench of their direction."""
FAR = 30.0
"""A random command's wrench times this is out of reach [-]."""
EVERYWHERE = np.ones(6, dtype=bool)


class BoundaryCase(NamedTuple):
    """A robot, and targets on and beyond the boundary of what it can do."""

    number: int
    """Of the layout in its split."""
    targets: Array
    """(F, D, 6) [N, N m], by factor and direction."""
    least: Array
    """The least normalized errors (F, D) that any forces leave."""


def beyond_reach_rows(
    allocators: Mapping[str, Allocator],
    *,
    layouts: int,
    targets: int,
    seed: int,
    split: str = "id",
    factors: Sequence[float] = FACTORS,
) -> list[Row]:
    """One row per factor and method.

    Args:
        allocators: methods by name; the first one's yardstick of errors is everybody's.
        layouts: of the split, whose fins follow the law `drag`, which is the judge's.
        targets: directions on each layout.
        seed: of the split.
        split: any with that law, such as `id`, `ood`, `ood-fins` or `limits`.
        factors: targets over the largest wrench of their direction.

    Returns:
        Rows of `factor`, `method`, `n`, `least_mean`, and of the normalized error beyond the least possible
        `excess_mean` with `excess_mean_interval`, `excess_median` and `excess_max`.

    Raises:
        DataError: a split with fins of another law.
    """
    cases = make_split(split, layouts, targets, seed)
    if any(fin.model.type != "drag" for case in cases for fin in case.layout.fins):
        raise DataError(f"split: expected one whose fins follow the judge's law, drag, got {split!r}")
    sigma = next(iter(allocators.values())).normalization.std
    bounds = []
    for number, case in enumerate(progress(cases, "layout", "boundary")):
        judge = Judge(case.healthy, sigma)
        far = FAR * case.targets
        largest = np.array([judge.largest_share(each / sigma) for each in far])[:, None] * far
        asked = np.multiply.outer(np.asarray(factors), largest)
        least = [[judge.least_error(each / sigma, EVERYWHERE) for each in row] for row in asked]
        bounds.append(BoundaryCase(number, asked, np.array(least)))
    rows: list[Row] = []
    for name, method in allocators.items():
        excess = []
        for case, bound in zip(progress(cases, "layout", name), bounds, strict=True):
            wanted = bound.targets.reshape(-1, 6)
            answer = method.allocate_batch(case.layout, wanted, failed=case.failed)
            works = [fin not in case.failed for fin in case.layout.names]
            given = plant_of(case.healthy).wrench(answer.command[:, works])
            error = np.linalg.norm((given - wanted) / sigma, axis=-1).reshape(bound.least.shape)
            excess.append(error - bound.least)
        rows += [_row(name, factor, k, bounds, excess) for k, factor in enumerate(factors)]
    return sorted(rows, key=lambda row: row["factor"])


def _row(name: str, factor: float, k: int, bounds: Sequence[BoundaryCase], excess: Sequence[Array]) -> Row:
    values = np.concatenate([each[k] for each in excess])
    group = np.concatenate([np.full(len(bound.least[k]), bound.number) for bound in bounds])
    return {
        "factor": factor,
        "method": name,
        "n": len(values),
        "least_mean": float(np.mean([bound.least[k] for bound in bounds])),
        "excess_mean": float(values.mean()),
        "excess_mean_interval": list(mean_interval(values, group)),
        "excess_median": float(np.median(values)),
        "excess_max": float(values.max()),
    }
