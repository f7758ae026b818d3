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
from finlab.files.checkpoint_config import read_normalization
from finlab.physics import plant_of
from finlab.physics.objective import command_effort
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.evaluation.splits import SplitCase
from finlab.research.networks.checkpoint import resolve_checkpoint

Columns = dict[str, AnyArray]
"""Scores of N answers: name of a column -> array (N,)."""
CONFIDENCE_LEVEL = 0.994426
"""Share of a normal variable within sqrt(2) times 1.96 standard deviations."""
BOOTSTRAP_SAMPLES = 2000
"""How often the bootstrap draws all layouts again."""
QUANTILE_SAMPLES = 1000
"""How often it draws them for a quantile."""
Interval = tuple[float, float]
"""Low and high end of a confidence interval."""


def run_method(
    method: MethodSpec, case: SplitCase, *, number: int = 0, seed: int = 0, first: int | None = None
) -> Columns:
    """Returns the scores of a method's answers to a test case, whose targets are solved together.

    Args:
        method: the method.
        case: a layout with its targets.
        number: number of the layout in its split.
        seed: of the method's random starts.
        first: how many of the targets are solved, from the first on; None for all.
    """
    targets = case.targets[:first]
    answer = method.on(case.layout).allocate_batch(targets, lost=case.lost, seed=seed)
    return score(case, targets, answer.command, answer.solve_ms, number=number)


def score(
    case: SplitCase, targets: Array, command: Array, solve_ms: Array, *, number: int = 0
) -> Columns:
    """Returns the scores of answers to a test case, whose wrenches the plant computes.

    Args:
        case: the layout, and what its errors are divided by.
        targets: desired wrenches (N, 6) [N, N m].
        command: the answers (N, n, 3).
        solve_ms: how long each took (N,) [ms].
        number: number of the layout in its split.

    Returns:
        Arrays (N,): `layout`, that number; `fins`, how many actuators work; `err_norm`, norm of the
        missing wrench over `sigma_of`, without axes that are free; `err_phys`, the same in N and
        N m; `effort`, the paper's J_en; `power` [W]; `solve_ms` [ms].
    """
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
    """Returns what the errors of a case are divided by (6,) [N, N m]: its own standard deviation of
    wrenches, or that of the paper's data set."""
    return paper_sigma() if case.sigma is None else case.sigma


@lru_cache
def paper_sigma() -> Array:
    """Returns the standard deviation (6,) [N, N m] of the wrenches of the paper's data set."""
    return read_normalization(resolve_checkpoint("default")).std


def joined(parts: Sequence[Columns]) -> Columns:
    """Returns the scores of several parts, one after the other: arrays (N_1 + N_2 + ...,)."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def means_by_layout(values: Array, group: NDArray[np.int64]) -> list[float]:
    """Returns the mean on each layout, in the order of their numbers.

    Args:
        values: values (N,).
        group: number of the layout of each (N,).
    """
    return [float(values[group == number].mean()) for number in np.unique(group)]


def paired_interval(numerators: Sequence[float], denominators: Sequence[float]) -> Interval:
    """Returns the confidence interval of a quotient of two means on the same layouts.

    Args:
        numerators: mean on each layout, of the one.
        denominators: of the other.
    """
    above = np.array(numerators)
    return ratio_interval(above, np.array(denominators), np.arange(len(above)))


def mean_interval(values: Array, group: NDArray[np.int64]) -> Interval:
    """Returns the confidence interval of a mean.

    Args:
        values: values (N,).
        group: number of the layout of each (N,).
    """
    return ratio_interval(values, np.ones(len(values)), group)


def quantile_interval(values: Array, group: NDArray[np.int64], share: float) -> Interval:
    """Returns the confidence interval of a quantile.

    Args:
        values: values (N,).
        group: number of the layout of each (N,). A lone layout is split into its entries.
        share: of the values below the quantile.
    """
    names = np.unique(group)
    parts = [values[group == name] for name in names]
    if len(parts) <= 1:
        parts = [np.array([value]) for value in values]
    rng = np.random.default_rng(0)
    quantiles = []
    for _ in range(QUANTILE_SAMPLES):
        drawn = rng.integers(len(parts), size=len(parts))
        quantiles.append(np.quantile(np.concatenate([parts[k] for k in drawn]), share))
    tail = 0.5 * (1.0 - CONFIDENCE_LEVEL)
    low, high = np.quantile(quantiles, [tail, 1.0 - tail])
    return float(low), float(high)


def ratio_interval(numerator: Array, denominator: Array, group: NDArray[np.int64]) -> Interval:
    """Returns the confidence interval of a sum over another one.

    Args:
        numerator: terms (N,) of the one sum.
        denominator: terms (N,) of the other.
        group: number of the layout of each (N,). A lone layout is split into its entries.
    """
    layouts, group_index = np.unique(group, return_inverse=True)
    if len(layouts) <= 1:
        group_index = np.arange(len(group))
    sums = [np.bincount(group_index, values) for values in (numerator, denominator)]
    if len(sums[0]) < 2:
        lone = float(numerator.sum() / denominator.sum()) if len(group) else float("nan")
        return lone, lone

    def ratio(numerators: Array, denominators: Array, axis: int) -> Array:
        return np.asarray(numerators.sum(axis) / denominators.sum(axis))

    result = bootstrap(
        sums,
        ratio,
        paired=True,
        n_resamples=BOOTSTRAP_SAMPLES,
        confidence_level=CONFIDENCE_LEVEL,
        method="percentile",
        rng=0,
    )
    low, high = result.confidence_interval
    return float(low), float(high)


def share_interval(holds: NDArray[np.bool_], group: NDArray[np.int64]) -> Interval:
    """Returns the confidence interval of the share of entries for which something holds.

    It is never narrower than Wilson's interval for N separate draws: a run without a single failure
    does not show that there are none.

    Args:
        holds: whether it holds, for each entry (N,).
        group: number of the layout of each (N,).
    """
    low, high = mean_interval(holds.astype(np.float64), group)
    wilson = binomtest(int(holds.sum()), len(holds)).proportion_ci(CONFIDENCE_LEVEL, "wilson")
    return min(low, float(wilson.low)), max(high, float(wilson.high))
