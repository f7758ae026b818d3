"""Parts of work give the same rows in this process, in several, and on a cluster that loses a
worker."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from finlab.cli import main
from finlab.errors import FinlabError
from finlab.research.executor import map_parts, on_cluster

WRENCH_EXPERIMENT = [
    *("eval", "wrench", "--split", "tables,thrusters", "--methods", "dual,qp"),
    *("--layouts", "2", "--targets", "2", "--seed", "5", "--json"),
]
"""A small run of the experiment `wrench`."""


def slow_square(folder: Path, number: int) -> int:
    """A part that leaves a file for each of its runs."""
    (folder / f"{number}-{os.getpid()}-{time.monotonic_ns()}").touch()
    time.sleep(0.05)
    return number * number


@pytest.fixture
def cluster() -> Iterator[tuple[str, list[int]]]:
    """A scheduler in this process and two workers in their own: its address, and their process
    ids."""
    distributed = pytest.importorskip("distributed")
    alone = {"n_workers": 0, "scheduler_port": 0, "dashboard_address": None, "silence_logs": 50}
    with distributed.LocalCluster(**alone) as scheduler, distributed.Client(scheduler) as client:
        address = scheduler.scheduler_address
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny"]
        command += ["--nthreads", "1", "--no-dashboard"]
        path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
        environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": path}
        workers = [
            subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) for _ in range(2)
        ]
        try:
            client.wait_for_workers(2, timeout=60)
            yield address, [worker.pid for worker in workers]
        finally:
            for worker in workers:
                worker.kill()
                worker.wait()


def plain(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows without times."""
    return [{key: value for key, value in row.items() if "_ms" not in key} for row in rows]


def test_processes_answer_in_order(tmp_path: Path) -> None:
    assert list(map_parts(partial(slow_square, tmp_path), range(9), jobs=2)) == [
        k * k for k in range(9)
    ]
    assert len({path.name.split("-")[1] for path in tmp_path.iterdir()} - {str(os.getpid())}) > 0


def test_a_process_that_has_ended_is_one_sentence() -> None:
    with pytest.raises(FinlabError, match="give it more memory"):
        list(map_parts(os._exit, [3, 4, 5], jobs=2))


def test_what_is_not_waited_for_is_ended() -> None:
    others = set(multiprocessing.active_children())
    made = map_parts(time.sleep, [0.0, 600.0, 600.0], jobs=2)
    assert next(made) is None
    del made
    assert set(multiprocessing.active_children()) <= others
    with pytest.raises(ValueError, match="non-negative"):  # of the first part
        list(map_parts(time.sleep, [-1.0, 600.0], jobs=2))
    assert set(multiprocessing.active_children()) <= others


def test_a_lost_worker_costs_its_parts_again(
    cluster: tuple[str, list[int]], tmp_path: Path
) -> None:
    address, pids = cluster
    with on_cluster(address):
        results = map_parts(partial(slow_square, tmp_path), range(40))
        first = [next(results) for _ in range(6)]
        os.kill(pids[0], signal.SIGKILL)
        assert first + list(results) == [k * k for k in range(40)]
    runs = [path.name.split("-") for path in tmp_path.iterdir()]
    assert {int(pid) for _, pid, _ in runs} == set(pids), "both have worked"
    kept = [number for number, pid, _ in runs if int(pid) == pids[1]]
    assert len(set(kept)) == len(kept), "no part of the other worker ran twice"


def test_rows_are_those_of_one_process(
    cluster: tuple[str, list[int]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    address, pids = cluster
    assert main([*WRENCH_EXPERIMENT, str(tmp_path / "alone.json")]) == 0
    killer = threading.Timer(1.0, os.kill, (pids[0], signal.SIGKILL))
    killer.start()
    assert main([*WRENCH_EXPERIMENT, str(tmp_path / "cluster.json"), "--cluster", address]) == 0
    killer.join()
    files = (tmp_path / f"{name}.json" for name in ("alone", "cluster"))
    alone, shared = (json.loads(file.read_text())["rows"] for file in files)
    assert len(alone) == 3 and plain(shared) == plain(alone)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:9", "no Dask scheduler answers at"),
        ("nonsense://x", "no Dask scheduler answers at"),
    ],
)
def test_nobody_at_the_address_is_one_sentence(
    address: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("finlab.research.executor.PATIENCE_S", 1.0)
    assert main(["bench", "qp", "--quick", "--cluster", address]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"finlab: error: cluster: {message}") and error.count("\n") == 1


def test_without_the_package_it_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["bench", "qp", "--quick", "--cluster", "tcp://127.0.0.1:9"]) == 2
    assert (
        "distributed is not installed; run: pip install 'finlab-marine[cluster]'"
        in capsys.readouterr().err
    )
