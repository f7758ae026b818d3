"""How long one call takes: methods side by side in one run on one machine, single calls only."""

import os
import platform
import re
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

from finlab.allocation.allocator import Allocator
from finlab.errors import DataError
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case, make_split
from finlab.evaluation.statistics.bootstrap import quantile_interval
from finlab.evaluation.statistics.tables import Row

REFERENCE = "search"
"""The method that the others are compared with, where it takes part."""
LAYOUTS = 5
"""Layouts whose calls are timed."""
WARM_UP = 2
"""First calls on each layout that are not counted; a robot keeps its layout for long."""


def latency_cases(fins: int, seed: int) -> list[Case]:
    """The first layouts of split `id` with so many fins; `DataError` if it has none of them."""
    if not 2 <= fins <= 5:
        raise DataError(f"fins: expected 2 to 5, the fin counts of split id, got {fins}")
    return [case for case in make_split("id", 100, 50, seed) if case.layout.n_fins == fins][:LAYOUTS]


def latency_rows(
    allocators: Mapping[str, Allocator], cases: Sequence[Case], *, n_calls: int = 200, budget_s: float = 20.0
) -> list[Row]:
    """Median and 99th percentile of whole `allocate` calls [ms], and the ratio to `search`.

    Args:
        allocators: method name -> method.
        cases: layouts with targets, visited one after the other; every method sees the same.
        n_calls: calls of each method.
        budget_s: a slow method stops after this long [s]; its row says how many calls it made.
    """
    rows: list[Row] = []
    for name, allocator in progress(allocators.items(), "method"):
        times = _time_calls(allocator, cases, n_calls, budget_s)
        rows.append(
            {
                "method": name,
                "calls": len(times),
                "p50_ms": float(np.quantile(times, 0.5)),
                "p50_ms_interval": list(quantile_interval(np.array(times), 0.5, np.arange(len(times)))),
                "p99_ms": float(np.quantile(times, 0.99)),
            }
        )
    reference = next((row["p50_ms"] for row in rows if row["method"] == REFERENCE), None)
    if reference is not None:
        for row in rows:
            row[f"p50_over_{REFERENCE}"] = row["p50_ms"] / reference
    return rows


def _time_calls(allocator: Allocator, cases: Sequence[Case], n_calls: int, budget_s: float) -> list[float]:
    """Wall time of each counted call [ms]."""
    times: list[float] = []
    per_case = -(-n_calls // len(cases))
    for case in cases:
        if len(times) >= n_calls:
            break
        begin = time.perf_counter()
        for k in range(WARM_UP + min(per_case, n_calls - len(times))):
            target = case.targets[k % len(case.targets)]
            start = time.perf_counter()
            allocator.allocate(case.layout, target, failed=case.failed)
            end = time.perf_counter()
            if k >= WARM_UP:
                times.append((end - start) * 1e3)
                if end - begin > budget_s / len(cases):
                    break
    return times


def machine() -> dict[str, str]:
    """What this ran on: processor, cores, threads and versions of what is installed."""
    versions = {}
    for package in ("numpy", "scipy", "torch"):
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "threads": str(max((pool["num_threads"] for pool in threadpool_info()), default=1)),
        "python": platform.python_version(),
        **versions,
    }


def _processor() -> str:
    """The processor's name as Linux tells it, or what Python knows."""
    with suppress(OSError):
        named = re.search(r"^model name\s*: *(.+)$", Path("/proc/cpuinfo").read_text("utf-8"), re.MULTILINE)
        if named:
            return named[1].strip()
    return platform.processor() or platform.machine()
