#!/usr/bin/env python3
"""Put small random faults into the code, one at a time, and see whether the tests near them fail.

    python tools/mutate.py --seed 1 --count 60

Faults are drawn by the seed from all places of `finlab/core/*.c` and `finlab/allocation` where one of these
can be made (`tools/faults.py`), half of them in C and half in Python:

- sign: plus for minus, minus for plus, or a minus left out;
- comparison: its opposite, such as `>=` for `<`;
- bound: the least for the greatest of two, or a loop that ends one step early;
- index: another element, such as `[1]` for `[0]`.

Each is made in a copy of the tree, whose core is compiled again where the fault is in C, and the tests that
`tools/near_tests.py` chooses for the file run until one fails. A test that hangs and a process that dies have
found the fault, too. What is printed as missed is to be read: some faults change no behaviour, such as that
of a bound that is never met.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tools.faults import Fault, drawn_faults
from tools.import_graph import ImportGraph
from tools.near_tests import ROOT, SECONDS, SLOW, NearTest, near_tests, one_thread, pytest_words

FIRST = 100
"""How many quick near tests run before the rest of them: most faults are found by them."""
HANG = 100
"""Seconds after which one test counts as hung."""
LOADED = (
    "numpy",
    "scipy.optimize",
    "scipy.linalg",
    "scipy.interpolate",
    "yaml",
    "msgspec",
    "hypothesis",
    "pytest",
)
"""What tests import that no fault changes: a process loads it once, and each fault begins from there."""


class Worker:
    """A process that makes faults in a copy of the tree, and is told them one by one."""

    def __init__(self, folder: Path) -> None:
        """Copies what tests need, and starts the process there.

        Args:
            folder: where to, a folder that is not there yet.
        """
        skipped = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "runs", "test-results")
        shutil.copytree(ROOT, folder, ignore=skipped)
        environment = one_thread() | {"PYTHONPATH": str(folder)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        self.process = subprocess.Popen(
            [sys.executable, "tools/mutate.py", "--worker"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def found_by(self, fault: Fault) -> str:
        """What finds a fault: the compiler, or the first test that fails; nothing where all pass."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(json.dumps(asdict(fault)) + "\n")
        self.process.stdin.flush()
        return str(json.loads(self.process.stdout.readline()))

    def stop(self) -> None:
        """Ends the process."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def work() -> None:
    """What the process of a `Worker` does: a fault comes in a line, and what finds it goes out in one."""
    for name in LOADED:
        import_module(name)
    graph = ImportGraph(ROOT)
    compile_core()
    for line in sys.stdin:
        fault = Fault(**json.loads(line))
        print(json.dumps(_found_by(fault, graph)), flush=True)


def compile_core() -> bool:
    """Compiles the core of this tree; returns whether the compiler took it."""
    return subprocess.run([sys.executable, "hatch_build.py"], cwd=ROOT, capture_output=True).returncode == 0


def _found_by(fault: Fault, graph: ImportGraph) -> str:
    path = ROOT / fault.file
    source = path.read_text(encoding="utf-8")
    in_c = path.suffix == ".c"
    path.write_text(fault.applied(source), encoding="utf-8")
    try:
        if in_c and not compile_core():
            return "the compiler"
        tests = near_tests(graph, [fault.file], SECONDS)
        first = [test for test in tests if test.seconds <= SLOW][:FIRST]
        rest = [test for test in tests if test not in first]
        return _failure(first) or _failure(rest)
    finally:
        path.write_text(source, encoding="utf-8")
        if in_c:
            compile_core()


def _failure(tests: list[NearTest]) -> str:
    """The first of some tests that fails, or what is said where a process dies; nothing where all pass."""
    if not tests:
        return ""
    options = ["-x", "-q", "--tb=no", "-o", f"faulthandler_timeout={HANG}", "-p", "no:cacheprovider"]
    words = [*options, *pytest_words(sorted(tests, key=lambda test: test.file))]
    with tempfile.TemporaryFile("w+") as output:
        child = os.fork()
        if child == 0:
            _run_pytest(words, output.fileno())
        _, status = os.waitpid(child, 0)
        with suppress(ProcessLookupError):  # what a test has started and not ended
            os.killpg(child, signal.SIGKILL)
        output.seek(0)
        said = output.read()
    if status == 0:
        return ""
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.M)
    return failed[0] if failed else f"the end of its process: {said[-200:]}"


def _run_pytest(words: list[str], output: int) -> None:
    """Runs tests in a process of their own, which ends here."""
    os.setsid()
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    code = 1
    try:
        code = int(import_module("pytest").main(words))
    finally:
        sys.stdout.flush()
        os._exit(code)


def judged(faults: list[Fault], jobs: int) -> Iterator[tuple[Fault, str]]:
    """Faults and what finds each, tried by so many processes at once."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        workers = SimpleQueue[Worker]()
        started = [Worker(Path(folder) / f"tree{job}") for job in range(jobs)]
        for worker in started:
            workers.put(worker)

        def found_by(fault: Fault) -> str:
            worker = workers.get()
            try:
                return worker.found_by(fault)
            finally:
                workers.put(worker)

        yield from zip(faults, pool.map(found_by, faults), strict=True)
        for worker in started:
            worker.stop()


def main() -> int:
    """Make faults and print which tests find them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of faults; by default all")
    parser.add_argument("--jobs", type=int, default=2, help="faults that are tried at once")
    parser.add_argument("--list", action="store_true", help="print the faults and make none")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work()
        return 0
    numbered = dict(enumerate(drawn_faults(ROOT, options.count, options.seed)))
    wanted = {number: numbered[number] for number in options.only or numbered}
    shown = {number: fault.shown((ROOT / fault.file).read_text("utf-8")) for number, fault in wanted.items()}
    if options.list:
        print(*(f"{number} {text}" for number, text in shown.items()), sep="\n")
        return 0
    missed = list[int]()
    for number, (_, found) in zip(wanted, judged(list(wanted.values()), options.jobs), strict=True):
        print(f"{number} {shown[number]}\n    {'found by ' + found if found else 'MISSED'}", flush=True)
        if not found:
            missed.append(number)
    print(f"{len(wanted) - len(missed)} of {len(wanted)} faults were found; missed:", *missed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
