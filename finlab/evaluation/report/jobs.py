"""Jobs: pieces of work with their settings, run on all cores, each kept in a store when it is done."""

import hashlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from finlab.evaluation.statistics.records import VERSION, load_columns, save_columns

Columns = dict[str, NDArray[Any]]


class Result(NamedTuple):
    """What a job gave."""

    columns: Columns
    """Arrays by name."""
    meta: dict[str, Any]
    """How they were made: settings, seconds, commit, time of day."""


class Store:
    """Results on disk, one NPZ file each, named after the job and a digest of its settings."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, name: str, settings: Mapping[str, Any]) -> Path:
        """Where a result lies, or will lie."""
        text = json.dumps({"version": VERSION, **settings}, sort_keys=True)
        return self.folder / f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.npz"

    def has(self, name: str, settings: Mapping[str, Any]) -> bool:
        """Whether the work is done."""
        return self.path(name, settings).is_file()

    def load(self, name: str, settings: Mapping[str, Any]) -> Result:
        """A result that is there; `DataError` if it is not."""
        return Result(*load_columns(self.path(name, settings)))

    def keep(
        self, name: str, settings: Mapping[str, Any], make: Callable[[], Columns], **meta: Any
    ) -> Result:
        """The result that is there, or else the one that `make` gives, kept with the settings and `meta`."""
        if not self.has(name, settings):
            start = time.perf_counter()
            columns = make()
            made = {
                "settings": dict(settings),
                "seconds": time.perf_counter() - start,
                "made": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
                **meta,
            }
            save_columns(self.path(name, settings), columns, made)
        return self.load(name, settings)


def columns_of_rows(rows: list[dict[str, Any]]) -> Columns:
    """Rows of a finished table as one column of JSON texts, for results that have no entry per target."""
    return {"rows": np.array([json.dumps(row) for row in rows])}


def rows_of_columns(columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
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

    def done(self, store: Store) -> bool:
        """Whether its result is there."""
        return store.has(self.name, self.key)

    def result(self, store: Store) -> Result:
        """Its result; `DataError` if it is not there."""
        return store.load(self.name, self.key)

    def run(self, store: Store, commit: str) -> None:
        """Do the work, unless it is done."""
        arguments = {**self.settings, **self.context}
        store.keep(self.name, self.key, lambda: self.work(**arguments), commit=commit)


def run_jobs(jobs: Sequence[Job], store: Store, *, commit: str, processes: int | None = None) -> None:
    """Run what is not done yet: together first, then one by one what measures time.

    Args:
        jobs: in any order; those listed first start first.
        store: keeps each result as soon as it is there, so that a run that was stopped goes on.
        commit: kept with the results.
        processes: how many at once; the number of cores by default, 0 for this process alone.
    """
    left = [job for job in jobs if not job.done(store)]
    together = [job for job in left if not job.alone]
    bar = tqdm(total=len(left), unit="part", disable=None, file=sys.stderr)
    processes = os.cpu_count() or 1 if processes is None else processes
    with bar:
        if processes == 0:
            for job in together:
                _show(bar, job)
                job.run(store, commit)
                bar.update()
        elif together:
            _run_pool(together, store.folder, commit, min(processes, len(together)), bar)
        for job in left:
            if job.alone:
                _show(bar, job)
                job.run(store, commit)
                bar.update()


def _run_pool(jobs: Sequence[Job], folder: Path, commit: str, processes: int, bar: "tqdm[Any]") -> None:
    # Fresh processes: a fork would copy the threads of BLAS in whatever state they are.
    pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_calm)
    try:
        waiting = {pool.submit(_run_one, job, folder, commit): job for job in jobs}
        for done in as_completed(waiting):
            done.result()
            _show(bar, waiting[done])
            bar.update()
    finally:
        pool.shutdown(cancel_futures=True)


def _calm() -> None:
    """One thread for each process, no bars of its own, and an end at once when a user interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")  # of what is loaded later
    threadpool_limits(1)
    sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - for the life of the process


def _run_one(job: Job, folder: Path, commit: str) -> None:
    job.run(Store(folder), commit)


def _show(bar: "tqdm[Any]", job: Job) -> None:
    bar.set_description(job.name)
