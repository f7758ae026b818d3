"""Answers of a method, scored by the plant, and confidence intervals of the scores.

Targets on one layout resemble each other, so the bootstrap draws whole layouts again, not targets.
An interval says where a rerun with another seed will land, which is as uncertain as the run at
hand: the difference of the two has sqrt(2) times the spread of one. The percentiles are those of a
normal variable at sqrt(2) x 1.96, so that the rerun lies inside 95 times of 100.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, bootstrap

from finlab.arrays import AnyArray, Array
from finlab.physics import plant_of
from finlab.physics.objective import command_effort
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.evaluation.splits import SplitCase
from finlab.research.networks.checkpoint import read_normalization, resolve_checkpoint

Columns = dict[str, AnyArray]
"""Arrays of N entries by name."""
LEVEL = 0.994426
"""Share of a normal variable within sqrt(2) times 1.96 standard deviations."""
REPLICATES = 2000
Interval = tuple[float, float]
"""Its low and its high end."""


def run_method(
    method: MethodSpec, case: SplitCase, *, number: int = 0, seed: int = 0, first: int | None = None
) -> Columns:
    """The columns of `score` of a method's answers to a case, whose targets, or only the first so
    many, are solved together; `number` is that of the layout in its split."""
    targets = case.targets[:first]
    answer = method.on(case.layout).allocate_batch(targets, lost=case.lost, seed=seed)
    return score(case, targets, answer.command, answer.solve_ms, number=number)


def score(
    case: SplitCase, targets: Array, command: Array, solve_ms: Array, *, number: int = 0
) -> Columns:
    """Scores of answers (N, n, 3), which took `solve_ms` (N,), to targets (N, 6) of a case, whose
    wrench the plant computes: arrays (N,) `layout`, its number in its split; `fins`, how many it
    has; `err_norm`, the norm of what is missing over `sigma_of`, without axes that are free;
    `err_phys`, the same in N and N m; `effort`, the paper's J_en; `power` [W]; `solve_ms`."""
    plant = plant_of(case.layout)
    missing = (plant.wrench(command) - targets) * case.layout.commanded
    return {
        "layout": np.full(len(targets), number, np.int64),
        "fins": np.full(len(targets), case.healthy.n, np.int64),
        "err_norm": np.linalg.norm(missing / sigma_of(case), axis=-1),
        "err_phys": np.linalg.norm(missing, axis=-1),
        "effort": command_effort(command, plant.upper),
        "power": np.nansum(plant.power(command), axis=-1),
        "solve_ms": np.asarray(solve_ms, np.float64),
    }


def sigma_of(case: SplitCase) -> Array:
    """What the errors of a case are divided by (6,) [N, N m]: its own standard deviation of
    wrenches, or that of the paper's data set."""
    return paper_sigma() if case.sigma is None else case.sigma


@lru_cache
def paper_sigma() -> Array:
    """Per-axis standard deviation (6,) [N, N m] of the wrenches of the paper's data set."""
    return read_normalization(resolve_checkpoint("default")).std


def joined(parts: Sequence[Columns]) -> Columns:
    """Columns of parts one after the other: arrays (N_1 + N_2 + ...,) by name."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def mean_interval(values: Array, group: NDArray[np.int64]) -> Interval:
    """Of the mean of values (N,), whose layouts are numbered in group (N,)."""
    return ratio_interval(values, np.ones(len(values)), group)


def ratio_interval(numerator: Array, denominator: Array, group: NDArray[np.int64]) -> Interval:
    """Of the sum of numerators over the sum of denominators, each (N,); a lone layout is split into
    its entries."""
    layouts, member = np.unique(group, return_inverse=True)
    member = member if len(layouts) > 1 else np.arange(len(group))
    sums = [np.bincount(member, values) for values in (numerator, denominator)]
    if len(sums[0]) < 2:
        lone = float(numerator.sum() / denominator.sum()) if len(group) else float("nan")
        return lone, lone

    def ratio(above: Array, below: Array, axis: int) -> Array:
        return np.asarray(above.sum(axis) / below.sum(axis))

    drawn = bootstrap(
        sums,
        ratio,
        paired=True,
        n_resamples=REPLICATES,
        confidence_level=LEVEL,
        method="percentile",
        rng=0,
    )
    low, high = drawn.confidence_interval
    return float(low), float(high)


def share_interval(holds: NDArray[np.bool_], group: NDArray[np.int64]) -> Interval:
    """Of the share of entries (N,) that hold; never narrower than Wilson's interval for N separate
    draws, since a run without a single failure does not show that there are none."""
    low, high = mean_interval(holds.astype(np.float64), group)
    apart = binomtest(int(holds.sum()), len(holds)).proportion_ci(LEVEL, "wilson")
    return min(low, float(apart.low)), max(high, float(apart.high))
