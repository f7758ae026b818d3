"""Parts of experiments, run on all cores, each kept as a file of rows as soon as it is done."""

import hashlib
import json
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

from threadpoolctl import threadpool_limits
from tqdm import tqdm

from finlab.errors import DataError
from finlab.evaluation.experiment import load_experiment
from finlab.evaluation.report.document import Row
from finlab.whole_file import write_whole

THREADS = 1
"""Threads of a part, so that parts run beside each other and times are of one core."""


@dataclass(frozen=True)
class Part:
    """One run of an experiment."""

    experiment: str
    options: dict[str, Any]
    source: str
    """Digest of the code and the weights: another one gives other results."""

    @property
    def name(self) -> str:
        """Leads the name of its file: the experiment, and what tells its parts apart."""
        each = load_experiment(self.experiment).each
        return "-".join([self.experiment, *(map(str, self.options[each]) if each else ())])

    def path(self, folder: Path) -> Path:
        """Where its rows are, or will be."""
        key = json.dumps([self.experiment, self.options, self.source], sort_keys=True)
        return folder / f"{self.name.replace('/', '-')}-{hashlib.sha256(key.encode()).hexdigest()[:12]}.json"

    def done(self, folder: Path) -> bool:
        """Whether its rows are there."""
        return self.path(folder).is_file()

    def record(self, folder: Path) -> dict[str, Any]:
        """Its `options`, `rows`, and the `seconds` of the processor that it took.

        Raises:
            DataError: no file, or not one that `run` wrote.
        """
        path = self.path(folder)
        try:
            found: dict[str, Any] = json.loads(path.read_text("utf-8"))
            return {key: found[key] for key in ("options", "rows", "seconds")}
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path}: not a file of rows ({error}); delete it and run again") from None

    def rows(self, folder: Path) -> list[Row]:
        """Its rows."""
        rows: list[Row] = self.record(folder)["rows"]
        return rows

    def run(self, folder: Path) -> None:
        """Run it on `THREADS` threads, and keep its rows.

        Raises:
            DataError: the file cannot be written.
        """
        start = time.process_time()
        with threadpool_limits(THREADS):
            rows = load_experiment(self.experiment).rows(**self.options)
        found = {"options": self.options, "rows": rows, "seconds": round(time.process_time() - start, 1)}
        write_whole(self.path(folder), json.dumps(found, indent=1, allow_nan=False) + "\n", DataError)


def run_parts(parts: Sequence[Part], folder: Path, *, processes: int | None = None) -> None:
    """Run what is not done yet: together first, then one by one what measures time.

    Args:
        parts: those listed first start first.
        folder: for their files, which is made.
        processes: parts that run at once; the number of cores by default, 0 for this process alone.

    Raises:
        DataError: a file cannot be written, or a process that ran a part was ended.
    """
    left = [part for part in parts if not part.done(folder)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: cannot be made: {error.strerror}") from None
    processes = os.cpu_count() or 1 if processes is None else processes
    apart = [part for part in left if load_experiment(part.experiment).timed or not processes]
    together = [part for part in left if part not in apart]
    with tqdm(total=len(left), unit="part", disable=None, file=sys.stderr) as bar:
        if together:
            _run_pool(together, folder, min(processes, len(together)), bar)
        for part in apart:
            bar.set_description(part.name)
            part.run(folder)
            bar.update()


def _run_pool(parts: Sequence[Part], folder: Path, processes: int, bar: "tqdm[Any]") -> None:
    # A fork would copy the threads of BLAS in whatever state they are.
    context = multiprocessing.get_context("spawn")
    pool = None
    try:
        pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin_worker)
        waiting = {pool.submit(part.run, folder): part for part in parts}
        for done in as_completed(waiting):
            done.result()
            bar.set_description(waiting[done].name)
            bar.update()
    except BrokenProcessPool:
        raise DataError(f"{folder}: a process that ran a part was ended; the same command goes on") from None
    except OSError as error:
        raise DataError(f"{folder}: parts cannot run beside each other: {error}") from None
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)


def _begin_worker() -> None:
    """No bars of its own, an end at once when a user interrupts, and an end with the process that waits for
    it, however that one ends."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115 - for the life of the process
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
