"""Confidence intervals by bootstrap over layouts: where a rerun with another seed will land.

Targets on one layout resemble each other, so whole layouts are drawn again, not targets. A rerun with another
seed is as uncertain as the run at hand: the difference of the two has sqrt(2) times the spread of one. The
percentiles are those of a normal variable at sqrt(2) x 1.96, so that the rerun lies inside 95 times of 100.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, bootstrap

from finlab.arrays import Array

LEVEL = 0.994426
"""Share of a normal variable within sqrt(2) times 1.96 standard deviations."""
REPLICATES = 2000
Interval = tuple[float, float]
"""Its low and its high end."""


def mean_interval(values: Array, group: NDArray[np.int64]) -> Interval:
    """Of the mean of values (N,), whose layouts are numbered in group (N,)."""
    return ratio_interval(values, np.ones(len(values)), group)


def ratio_interval(numerator: Array, denominator: Array, group: NDArray[np.int64]) -> Interval:
    """Of the sum of numerators over the sum of denominators, each (N,); a lone layout is split into its
    entries."""
    found, member = np.unique(group, return_inverse=True)
    member = member if len(found) > 1 else np.arange(len(group))
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
    """Of the share of entries (N,) that hold; never narrower than Wilson's interval for N separate draws,
    since a run without a single failure does not show that there are none."""
    low, high = mean_interval(holds.astype(np.float64), group)
    apart = binomtest(int(holds.sum()), len(holds)).proportion_ci(LEVEL, "wilson")
    return min(low, float(apart.low)), max(high, float(apart.high))
