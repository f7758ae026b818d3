"""The tests that judge mutants: what each one covers and costs, and runs of them in a copy of the tree."""

import json
import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

from coverage import CoverageData
from mutants import ROOT, Mutant

STORE = ROOT / ".mutate"
"""What was measured of the tests, and the last run's survivors."""
IGNORED = ("browser", "distill", "evaluation", "examples", "packaging", "training", "webapp", "__pycache__")
"""Folders of tests that judge no mutants: slow ones of what lies far above the mutated rooms."""
BUDGET_S = 60.0
"""Longest time of all tests for one mutant, as measured without a change."""
MEMORY_BYTES = 24 << 30
"""What a child may address, so that a changed size does not take the machine down."""

HEAVY = ("numpy", "scipy.optimize", "torch", "hypothesis", "safetensors", "pytest")
"""Loaded once before the children are forked, instead of once per mutant."""


class Suite:
    """Which tests there are, what they cover and what they cost in seconds."""

    def __init__(self) -> None:
        stored = json.loads((STORE / "tests.json").read_text())
        self.seconds: dict[str, float] = stored["seconds"]
        self.lines: dict[str, dict[str, list[str]]] = stored["lines"]

    def tests_of(self, mutant: Mutant) -> list[str]:
        """The tests that touch the line, then those that touch the file, each the quickest first."""
        lines = self.lines.get(mutant.file, {})
        touching = set(lines.get(str(mutant.line), ()))
        others = {test for tests in lines.values() for test in tests} - touching
        chosen: list[str] = []
        for tests in (touching, others):
            for test in sorted(tests, key=lambda test: (self.seconds[test], test)):
                if not chosen or self.cost([*chosen, test]) <= BUDGET_S:
                    chosen.append(test)
        return chosen

    def cost(self, tests: list[str]) -> float:
        return sum(self.seconds[test] for test in tests)


def copy_tree(target: Path) -> Path:
    """A copy of all files that git would keep: mutants never touch the tree itself."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    for name in listed.stdout.split("\0"):
        if name and (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)
    return target


def _environment(copy: Path) -> dict[str, str]:
    threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}


def all_tests() -> list[str]:
    """The folders of tests that judge mutants where nothing else is said."""
    folders = sorted(path for path in (ROOT / "tests").iterdir() if path.is_dir())
    return [f"tests/{path.name}" for path in folders if path.name not in IGNORED]


def measure(copy: Path, jobs: int, tests: list[str]) -> None:
    """Run tests once without a mutant; store what passed, how long it took and which lines it touched."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-vv",
        "-rpfE",
        "--durations=0",
        f"-n{jobs}",
        "--dist=loadfile",
    ]
    command += ["--cov=finlab", "--cov-context=test", "--cov-report=", *tests]
    output = subprocess.run(command, cwd=copy, env=_environment(copy), capture_output=True, text=True).stdout
    STORE.mkdir(exist_ok=True)
    (STORE / "measured.log").write_text(output)
    for line in re.findall(r"^(?:FAILED|ERROR) .+$", output, re.MULTILINE):
        print(f"left out, since it fails without a mutant: {line}", file=sys.stderr)
    seconds = dict.fromkeys(re.findall(r"^PASSED (.+)$", output, re.MULTILINE), 0.0)
    for taken, test in re.findall(r"^([\d.]+)s (?:call|setup|teardown) +(.+)$", output, re.MULTILINE):
        if test in seconds:
            seconds[test] += float(taken)
    data = CoverageData(str(copy / ".coverage"))
    data.read()
    lines = {
        Path(file).relative_to(copy).as_posix(): {
            line: sorted({context.split("|")[0] for context in contexts} & seconds.keys())
            for line, contexts in data.contexts_by_lineno(file).items()
        }
        for file in data.measured_files()
    }
    (STORE / "tests.json").write_text(json.dumps({"seconds": seconds, "lines": lines}))


def start_tests(copy: Path, tests: list[str]) -> int:
    """Run tests in a child of this process, up to the first failure; returns its process id."""
    for name in HEAVY:
        __import__(name)
    child = os.fork()
    if child:
        return child
    try:
        os.setsid()
        os.chdir(copy)
        os.environ.update(_environment(copy))
        sys.path[0] = str(copy)
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        log = os.open(copy / "tests.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        import pytest

        os._exit(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]))
    finally:
        os._exit(70)
