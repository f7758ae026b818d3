#!/usr/bin/env python3
"""Put small random faults into the code, one at a time, and see whether the tests near them fail.

    python tools/mutate.py --seed 1 --count 60

Faults are drawn by the seed from all places of `finlab/core/src` and `finlab/allocation` where one
of these can be made (`tools/faults.py`), half of them in C and half in Python:

- sign: plus for minus, minus for plus, or a minus left out;
- comparison: its opposite, such as `>=` for `<`;
- bound: the least for the greatest of two, or a loop that ends one step early;
- index: another element, such as `[1]` for `[0]`.

Each is made in a copy of the tree, whose core is compiled again where the fault is in C, and the
tests that `tools/near_tests.py` chooses for the file run until one fails. A test that hangs and a
process that dies have found the fault, too. What is printed as missed is to be read: some faults
change no behaviour, such as that of a bound that is never met.
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

from hatch_build import FLAGS, target
from tools.faults import Fault, drawn_fault, drawn_faults
from tools.import_graph import ImportGraph
from tools.near_tests import ROOT, SECONDS, by_file, near_tests, one_thread, pytest_words

FIRST = 10.0
"""Seconds of the nearest and quickest tests, which run before all others: they find most faults."""
NOTHING = "nothing"
"""What is said to have found a fault where a test fails without it, too."""
HANG = 100
"""Seconds after which one test counts as hung."""
LOADED = ("numpy", "scipy.optimize", "scipy.linalg", "hypothesis", "pytest")
"""What tests import that no fault changes: a process loads it once, and each fault begins from
there."""
LOADED_FOR_C = (
    "finlab.allocation.dual.method",
    "finlab.cli",
    "finlab.analysis.authority",
    "finlab.fit",
)
"""What no fault in C changes besides."""


class Worker:
    """A process that makes faults in a copy of the tree, and is told them one by one."""

    def __init__(self, folder: Path, objects: Path) -> None:
        """Copies what tests need, and starts the process there.

        Args:
            folder: where to, a folder that is not there yet.
            objects: what the C files of the core are compiled to, without a fault.
        """
        skipped = shutil.ignore_patterns(
            ".*", "__pycache__", "build", "dist", "runs", "test-results"
        )
        shutil.copytree(ROOT, folder, ignore=skipped)
        environment = one_thread() | {"PYTHONPATH": str(folder)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        self.process = subprocess.Popen(
            [sys.executable, "tools/mutate.py", "--worker", str(objects)],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def found_by(self, fault: Fault, stages: list[list[str]]) -> str:
        """What finds a fault: the compiler, or the first test that fails; nothing where all pass.

        Args:
            fault: which.
            stages: what pytest is told to run the nearest tests, then all that are near.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(json.dumps([asdict(fault), stages]) + "\n")
        self.process.stdin.flush()
        return str(json.loads(self.process.stdout.readline()))

    def stop(self) -> None:
        """Ends the process."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def work(objects: Path) -> None:
    """What the process of a `Worker` does: a fault comes in a line, and what finds it goes out in
    one."""
    for name in LOADED:
        import_module(name)
    library = Path(next((ROOT / "finlab" / "core").glob("libfinlab.*")))
    whole = library.read_bytes()
    for number, line in enumerate(sys.stdin, start=1):
        about, stages = json.loads(line)
        fault = Fault(**about)
        path = ROOT / fault.file
        source = path.read_text(encoding="utf-8")
        written = path.stat().st_mtime
        path.write_text(fault.applied(source), encoding="utf-8")
        # Bytecode is known by the second and size of its source: each fault gets its own second.
        os.utime(path, (written, written + number))
        is_built = path.suffix != ".c" or built(path, objects, library)
        loaded = LOADED_FOR_C if path.suffix == ".c" else ()
        found = "" if is_built else "the compiler"
        for words in stages:
            found = found or failure(words, loaded)
        path.write_text(source, encoding="utf-8")
        os.utime(path, (written, written))
        if path.suffix == ".c":
            library.unlink()
            library.write_bytes(whole)
        if found.startswith("tests/") and failure([found], ()):
            found = f"{NOTHING}: {found} fails without it, too"
        print(json.dumps(found), flush=True)


def compiled(path: Path, made: Path) -> bool:
    """Compiles one C file to an object file; returns whether the compiler took it."""
    flags = [flag for flag in FLAGS if flag != "-shared"]
    command = [
        *target()[0],
        *flags,
        f"-I{ROOT / 'finlab' / 'core'}",
        "-c",
        str(path),
        "-o",
        str(made),
    ]
    return subprocess.run(command, capture_output=True).returncode == 0


def built(path: Path, objects: Path, library: Path) -> bool:
    """Builds the core with one C file that was changed; returns whether the compiler took it."""
    with tempfile.TemporaryDirectory() as folder:
        changed = Path(folder) / f"{path.stem}.o"
        if not compiled(path, changed):
            return False
        others = [str(made) for made in sorted(objects.glob("*.o")) if made.name != changed.name]
        library.unlink(missing_ok=True)
        command = [*target()[0], *FLAGS, str(changed), *others, "-o", str(library), "-lm"]
        return subprocess.run(command, capture_output=True).returncode == 0


def failure(words: list[str], loaded: tuple[str, ...]) -> str:
    """The first of some tests that fails, or what is said where a process dies; nothing where all
    pass.

    Args:
        words: arguments of pytest that choose the tests, such as paths and node ids.
        loaded: names of modules that are imported here, before the process of the tests is forked:
            it then need not load them itself. They may not load the code with the fault.
    """
    for name in loaded:
        import_module(name)
    options = [
        "-x",
        "-q",
        "--tb=no",
        "-o",
        f"faulthandler_timeout={HANG}",
        "-p",
        "no:cacheprovider",
    ]
    with tempfile.TemporaryFile("w+") as output:
        child = os.fork()
        if child == 0:
            _run_pytest([*options, *words], output.fileno())
        _, status = os.waitpid(child, 0)
        with suppress(ProcessLookupError):  # what a test has started and not ended
            os.killpg(child, signal.SIGKILL)
        output.seek(0)
        said = output.read()
    if status == 0:
        return ""
    failed = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", said, re.M)
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


def judged(faults: list[Fault], jobs: int, seconds: float) -> Iterator[tuple[Fault, str]]:
    """Faults and what finds each.

    Args:
        faults: those of Python first, since a process loads more before those of C.
        jobs: how many processes try them at once.
        seconds: of the near tests of each.
    """
    graph = ImportGraph(ROOT)
    stages = {
        file: [pytest_words(by_file(near_tests(graph, [file], most))) for most in (FIRST, seconds)]
        for file in {fault.file for fault in faults}
    }
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        objects = Path(folder) / "objects"
        objects.mkdir()
        for path in sorted((ROOT / "finlab/core/src").glob("*.c")):
            if not compiled(path, objects / f"{path.stem}.o"):
                sys.exit(f"{path} does not compile")
        workers = SimpleQueue[Worker]()
        started = [Worker(Path(folder) / f"tree{job}", objects) for job in range(jobs)]
        for worker in started:
            workers.put(worker)

        def found_by(fault: Fault) -> str:
            worker = workers.get()
            try:
                return worker.found_by(fault, stages[fault.file])
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
    parser.add_argument("--files", nargs="*", help="draw one fault in each of these files instead")
    parser.add_argument("--only", type=int, nargs="*", help="numbers of faults; by default all")
    parser.add_argument("--jobs", type=int, default=2, help="faults that are tried at once")
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, help="of near tests, as they were timed"
    )
    parser.add_argument("--list", action="store_true", help="print the faults and make none")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker)
        return 0
    if options.files:
        faults = [drawn_fault(ROOT, file, options.seed) for file in options.files]
    else:
        faults = drawn_faults(ROOT, options.count, options.seed)
    numbered = dict(enumerate(faults))
    numbers = sorted(
        options.only or numbered, key=lambda number: numbered[number].file.endswith(".c")
    )
    wanted = {number: numbered[number] for number in numbers}
    shown = {
        number: fault.shown((ROOT / fault.file).read_text("utf-8"))
        for number, fault in wanted.items()
    }
    of_tolerance = {
        number
        for number, fault in wanted.items()
        if fault.is_of_tolerance((ROOT / fault.file).read_text("utf-8"))
    }
    if options.list:
        print(*(f"{number} {text}" for number, text in shown.items()), sep="\n")
        return 0
    missed = list[int]()
    for number, (_, found) in zip(
        wanted, judged(list(wanted.values()), options.jobs, options.seconds), strict=True
    ):
        verdict = f"found by {found}" if found else "MISSED"
        if not found and number in of_tolerance:
            verdict = "MISSED (the sign of a tolerance)"
        print(f"{number} {shown[number]}\n    {verdict}", flush=True)
        if not found or found.startswith(NOTHING):
            missed.append(number)
    print(f"{len(wanted) - len(missed)} of {len(wanted)} faults were found; missed:", *missed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
