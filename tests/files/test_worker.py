"""A file is read in a process of its own: what it takes is bounded, and what it says comes back."""

import os
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from finlab.errors import DataError, FinlabError, LayoutError
from finlab.files import worker
from finlab.files.worker import in_worker


@pytest.fixture(params=["copied", "beside threads"], autouse=True)
def _started(request: pytest.FixtureRequest) -> Iterator[None]:
    """Both ways to make the process."""
    end = threading.Event()
    if request.param != "copied":
        threading.Thread(target=end.wait, daemon=True).start()
    yield
    end.set()


def refuse(kind: type[FinlabError]) -> None:
    """Raise an error of some kind, as a reader would."""
    raise kind("a.yaml: is wrong")


def spin() -> None:
    """Never end."""
    while True:
        pass


def fill(content: bytes = b"", megabytes: int = 3_000) -> int:
    """Take memory, far more than a process that is copied may have free."""
    return len([bytearray(1_000_000) for _ in range(megabytes)])


def grown() -> int:
    """By how much the address space of a reader can grow [MB]."""
    before = address_space()
    parts = []
    most = before
    try:
        while True:
            parts.append(bytearray(1_000_000))
            most = max(most, address_space())
    except MemoryError:
        parts.clear()
    return (most - before) // 1_000_000


def address_space() -> int:
    """Bytes that this process has mapped."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


def test_what_is_read_comes_back() -> None:
    assert in_worker(divmod, 7, 2) == (3, 1)
    assert in_worker(os.getpid) != os.getpid()


@pytest.mark.parametrize("kind", [FinlabError, DataError, LayoutError])
def test_a_refusal_comes_back_as_it_is(kind: type[FinlabError]) -> None:
    with pytest.raises(kind, match=r"^a\.yaml: is wrong$"):
        in_worker(refuse, kind)


def test_a_reader_that_fails_or_ends_is_a_sentence() -> None:
    with pytest.raises(
        FinlabError, match=r"a fault of finlab \(ZeroDivisionError in .*report it with the file"
    ):
        in_worker(divmod, 1, 0)
    with pytest.raises(FinlabError, match="reading the file takes too much memory"):
        in_worker(os._exit, 1)


def test_time_is_bounded() -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.monotonic()
    with pytest.raises(FinlabError, match=r"too much time, more than 1\.8 s"):
        in_worker(spin)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 2.0
    assert time.monotonic() - begin < worker.WALL_OVER_CPU * worker.CPU_S


def test_memory_is_bounded() -> None:
    with pytest.raises(FinlabError, match="too much memory, over 150 MB"):
        in_worker(fill)
    assert 100 < in_worker(grown) <= 150


def test_limits_grow_with_the_file() -> None:
    content = bytes(20_000_000)
    assert in_worker(fill, content, 300) == 300
    with pytest.raises(FinlabError, match="too much memory"):
        in_worker(fill)


def test_a_reader_that_only_waits_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "WALL_OVER_CPU", 0.2)
    with pytest.raises(FinlabError, match="too much time"):
        in_worker(time.sleep, 60.0)


def test_a_process_ends_with_the_one_that_started_it(tmp_path: Path) -> None:
    """However that ended, and whatever it does meanwhile."""
    script = tmp_path / "parent.py"
    script.write_text(PARENT_PROGRAM)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    workers = [int(number) for number in parent.stdout.readline().split()]
    assert len(workers) == 2 and all(map(runs, workers))
    parent.kill()
    parent.wait()
    end = time.monotonic() + 20.0
    while any(map(runs, workers)):
        assert time.monotonic() < end
        time.sleep(0.05)


PARENT_PROGRAM = """
import multiprocessing, time
from finlab.files.worker import end_with_parent

if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(2, end_with_parent) as pool:
        busy = pool.map_async(time.sleep, [600.0, 600.0], 1)
        print(*[process.pid for process in pool._pool], flush=True)
        busy.wait()
"""
"""A program that starts a worker and is killed."""


def runs(number: int) -> bool:
    """Whether there is a process of this number that has not ended."""
    try:
        return "Z" not in Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
