"""Jobs: pieces of work with their settings, run on all cores, each kept in a folder when it is done."""

import hashlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from finlab.evaluation.statistics.records import VERSION, Columns, load_columns, save_columns

THREADS = 1
"""Threads of a part, so that parts run beside each other and times are of one core."""


def columns_of_rows(rows: list[dict[str, Any]]) -> Columns:
    """Rows of a finished table as one column of JSON texts, for results that have no entry per target."""
    return {"rows": np.array([json.dumps(row) for row in rows])}


def rows_of_columns(columns: Columns) -> list[dict[str, Any]]:
    """Inverse of `columns_of_rows`."""
    return [json.loads(str(text)) for text in columns["rows"]]


@dataclass(frozen=True)
class Job:
    """One piece of work."""

    name: str
    """What it is, for people; leads the name of its file."""
    work: Callable[..., Columns]
    """What is done; a function of a module, so that other processes find it."""
    settings: dict[str, Any]
    """Arguments of the work that decide the result, plain values."""
    prints: str
    """Fingerprint of what was loaded: checkpoint or normalization."""
    context: dict[str, Any] = field(default_factory=dict)
    """Arguments that do not decide the result, such as the folder of a checkpoint."""
    alone: bool = False
    """Whether nothing may run beside it, because it measures time."""

    @property
    def key(self) -> dict[str, Any]:
        """What the result depends on."""
        return {"work": self.work.__name__, "prints": self.prints, **self.settings}

    def path(self, folder: Path) -> Path:
        """Where its result lies, or will lie: a file named after the job and a digest of its key."""
        text = json.dumps({"version": VERSION, **self.key}, sort_keys=True)
        return folder / f"{self.name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.npz"

    def done(self, folder: Path) -> bool:
        """Whether its result is there."""
        return self.path(folder).is_file()

    def result(self, folder: Path) -> tuple[Columns, dict[str, Any]]:
        """Its arrays by name, and how they were made; `DataError` if they are not there."""
        return load_columns(self.path(folder))

    def run(self, folder: Path, commit: str) -> None:
        """Do the work, on `THREADS` threads, and keep its result."""
        start = time.perf_counter()
        with threadpool_limits(THREADS):
            columns = self.work(**self.settings, **self.context)
        made = {
            "settings": self.key,
            "seconds": time.perf_counter() - start,
            "made": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            "commit": commit,
        }
        save_columns(self.path(folder), columns, made)


def run_jobs(jobs: Sequence[Job], folder: Path, *, commit: str, processes: int | None = None) -> None:
    """Run what is not done yet: together first, then one by one what measures time.

    Args:
        jobs: in any order; those listed first start first.
        folder: keeps each result as soon as it is there, so that a run that was stopped goes on.
        commit: kept with the results.
        processes: how many at once; the number of cores by default, 0 for this process alone.
    """
    left = [job for job in jobs if not job.done(folder)]
    processes = os.cpu_count() or 1 if processes is None else processes
    together = [job for job in left if processes and not job.alone]
    with tqdm(total=len(left), unit="part", disable=None, file=sys.stderr) as bar:
        if together:
            _run_pool(together, folder, commit, min(processes, len(together)), bar)
        for job in sorted((job for job in left if job.alone or not processes), key=lambda job: job.alone):
            bar.set_description(job.name)
            job.run(folder, commit)
            bar.update()


def _run_pool(jobs: Sequence[Job], folder: Path, commit: str, processes: int, bar: "tqdm[Any]") -> None:
    # Fresh processes: a fork would copy the threads of BLAS in whatever state they are.
    pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_calm)
    try:
        waiting = {pool.submit(job.run, folder, commit): job for job in jobs}
        for done in as_completed(waiting):
            done.result()
            bar.set_description(waiting[done].name)
            bar.update()
    finally:
        pool.shutdown(cancel_futures=True)


def _calm() -> None:
    """No more threads than a part may have, no bars of its own, and an end at once when a user interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # What a part loads itself looks here.
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), str(THREADS))
    sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - for the life of the process
