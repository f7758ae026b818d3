"""How fast single answers come, and how much memory the process has taken: `finlab-runtime speed`."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Layout
from finlab.physics import Plant

Array = NDArray[np.float64]

N_WARM = 100
"""Answers before the clock starts."""


def answer_times(allocate: Callable[[Array], object], targets: Array) -> tuple[float, float]:
    """Median and 99th percentile [ms] of single answers to targets (N, 6), one after the other."""
    for target in targets[:N_WARM]:
        allocate(target)
    times = []
    for target in targets:
        start = time.perf_counter()
        allocate(target)
        times.append(time.perf_counter() - start)
    p50, p99 = np.percentile(times, [50, 99]) * 1e3
    return float(p50), float(p99)


def random_targets(layout: Layout, count: int) -> Array:
    """Wrenches (count, 6) of random commands, the same ones every time."""
    draws = np.random.default_rng(0).random((count, layout.n_fins, 3))
    return Plant(layout).wrench(layout.lower + draws * (layout.upper - layout.lower))


def peak_memory() -> float:
    """Largest resident size of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
