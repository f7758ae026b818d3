"""Confidence intervals by bootstrap over layouts: where a rerun with another seed will land.

Targets on one layout resemble each other, so whole layouts are drawn again, not targets. A rerun with another
seed is as uncertain as the run at hand: the difference of the two has sqrt(2) times the spread of one. The
percentiles are those of a normal variable at sqrt(2) x 1.96, so that the rerun lies inside 95 times of 100.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array

SPREAD = 2.772
"""sqrt(2) times 1.96, in standard deviations of one run."""
TAIL = 0.002787
"""Share of a normal variable below -SPREAD: the percentiles of the interval."""
REPLICATES = 2000


class Interval(NamedTuple):
    """Ends of an interval."""

    low: float
    high: float


def mean_interval(values: Array, group: NDArray[np.int64]) -> Interval:
    """Of the mean of values (N,), whose layouts are numbered in group (N,)."""
    return ratio_interval(values, np.ones(len(values)), group)


def ratio_interval(numerator: Array, denominator: Array, group: NDArray[np.int64]) -> Interval:
    """Of the sum of numerators over the sum of denominators, each (N,)."""
    member, n_groups = _members(group)
    above, below = (np.bincount(member, v, minlength=n_groups) for v in (numerator, denominator))
    counts = _counts(n_groups)
    with np.errstate(divide="ignore", invalid="ignore"):
        drawn = (counts @ above) / (counts @ below)
    return _ends(drawn[np.isfinite(drawn)])


def share_interval(holds: NDArray[np.bool_], group: NDArray[np.int64]) -> Interval:
    """Of the share of entries (N,) that hold; never narrower than Wilson's interval for N separate draws,
    since a run without a single failure does not show that there are none."""
    drawn = mean_interval(holds.astype(np.float64), group)
    n, share = len(holds), float(holds.mean())
    centre = (share + SPREAD**2 / (2 * n)) / (1 + SPREAD**2 / n)
    half = SPREAD / (1 + SPREAD**2 / n) * np.sqrt(share * (1 - share) / n + SPREAD**2 / (4 * n**2))
    low, high = min(drawn.low, centre - half), max(drawn.high, centre + half)
    return Interval(max(0.0, float(low)), min(1.0, float(high)))


def _members(group: NDArray[np.int64]) -> tuple[NDArray[np.intp], int]:
    """Which of the groups each entry belongs to, and their number; a lone group is split into its entries."""
    found, member = np.unique(group, return_inverse=True)
    if len(found) == 1:
        return np.arange(len(group)), len(group)
    return member, len(found)


@lru_cache(maxsize=4)
def _counts(n_groups: int) -> Array:
    """How often each group is drawn (REPLICATES, n_groups); the same for every table of a report."""
    rng = np.random.default_rng(0)
    return rng.multinomial(n_groups, np.full(n_groups, 1 / n_groups), size=REPLICATES).astype(np.float64)


def _ends(drawn: Array) -> Interval:
    if len(drawn) == 0:
        return Interval(float("nan"), float("nan"))
    low, high = np.quantile(drawn, (TAIL, 1 - TAIL))
    return Interval(float(low), float(high))
