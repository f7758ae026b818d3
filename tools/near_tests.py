#!/usr/bin/env python3
"""Runs the tests near a change: `make test-near`, `tools/near_tests.py [PATH...] [-- PYTEST ARGS]`.

The change is what differs from the branch `main` (from the last commit while on it) and what git
does not track yet, or the paths that are given.

Near is a test whose file imports a changed file, and nearer the fewer imports lie between the two
(`tools/import_graph.py`). Of a changed file that no import names, such as a table or a style sheet,
the files in its folder count as changed. Tests that are called after a changed file, and those in
the folder of tests that mirrors its package, are nearer than their imports say.

Of near tests so many are run as fit into a minute on two cores, by what each took when `make
test-durations` was last run: the quicker and the nearer one first. A test file that was changed
itself runs whole.
"""

import argparse
import ast
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tools.import_graph import ImportGraph

ROOT = Path(__file__).resolve().parents[1]
"""The top of the tree."""
DURATIONS = ROOT / "tests" / "durations.json"
WHOLE_PROGRAM_TESTS = ("tests/browser/", "tests/packaging/")
"""Folders with tests of the whole program, which run where they were changed themselves."""
SECONDS = 80.0
"""Sum of the recorded seconds of what is run, by two processes; start and collection take the
rest."""
DEFAULT_SECONDS = 0.5
"""Seconds of a test that was never timed."""
QUICK_SECONDS = 0.1
"""Seconds below which a test is as good as one that takes less."""
COLLECTION_SECONDS = 0.5
"""Seconds that the import of one more test file takes, in both processes."""
SLOW_SECONDS = 2.0
"""Seconds above which a test runs after all others."""
DISTANCE_FACTOR = 3.0
"""Factor by which a test one import farther off has to be faster to run first."""
FOLDER_DISTANCE = 2
"""Largest distance of tests in the folder that mirrors the changed one [imports]."""
CALLS_THE_CORE = {
    "tests/core": 1,
    "tests/allocation/test_contract.py": 1,
    "tests/allocation/dual": 1,
    "tests/allocation": 2,
    "tests/interaction": 1,
    "tests/forces": 2,
}
"""Tests of what calls the core in C, and how many imports they are off a C file at most."""


@dataclass(frozen=True)
class NearTest:
    """A test, or a function whose cases are quick, with its distance and time."""

    file: str
    name: str
    distance: int
    """Imports between its file and the change."""
    seconds: float
    """Processor time when it was timed [s]."""

    @property
    def node(self) -> str:
        """Its node id for pytest."""
        return f"{self.file}::{self.name}"

    @property
    def order(self) -> tuple[float, str, str]:
        """The key by which tests are sorted: the first one runs first."""
        return (
            max(self.seconds, QUICK_SECONDS) * DISTANCE_FACTOR**self.distance,
            self.file,
            self.name,
        )


def main() -> int:
    """Print which tests are near, and run them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("paths", nargs="*", help="changed files; by default what differs from main")
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, help="of tests, by their recorded durations"
    )
    parser.add_argument("--list", action="store_true", help="print the tests and run none")
    argv = sys.argv[1:]
    split = argv.index("--") if "--" in argv else len(argv)
    options = parser.parse_args(argv[:split])
    changed = options.paths or changed_files()
    tests = near_tests(ImportGraph(ROOT), changed, options.seconds)
    if not tests:
        print("no tests are near what was changed:", *(changed or ["nothing"]))
        return 0
    if options.list:
        for test in tests:
            print(f"{test.distance} {test.seconds:6.2f} {test.file}::{test.name}")
        return 0
    total = sum(test.seconds for test in tests)
    files = {test.file for test in tests}
    print(
        f"{len(tests)} tests in {len(files)} files are near; they took {total:.0f} s when they "
        "were timed"
    )
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n",
        "2",
        "--dist",
        "worksteal",
        *argv[split + 1 :],
    ]
    return subprocess.run(
        [*command, *pytest_words(by_halves(tests))], cwd=ROOT, env=one_thread()
    ).returncode


def one_thread() -> dict[str, str]:
    """The environment, with one thread for each process."""
    return os.environ | dict.fromkeys(
        ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
    )


def pytest_words(tests: list[NearTest]) -> list[str]:
    """Returns the arguments of pytest for some tests: their functions in this order, and the timed
    cases to leave out."""
    chosen = {test.node for test in tests}
    functions = list(dict.fromkeys(node.split("[")[0] for node in (test.node for test in tests)))
    left_out = [name for name in durations() if "[" in name and name not in chosen]
    functions_run = set(functions)
    return [
        *functions,
        *(f"--deselect={name}" for name in left_out if name.split("[")[0] in functions_run),
    ]


def by_file(tests: list[NearTest]) -> list[NearTest]:
    """Tests file by file, the nearest file first; slow tests after all others."""
    files = list(dict.fromkeys(test.file for test in tests))
    ordered = [test for file in files for test in tests if test.file == file]
    return sorted(ordered, key=lambda test: test.seconds > SLOW_SECONDS)


def by_halves(tests: list[NearTest]) -> list[NearTest]:
    """Tests in the order in which two processes take them.

    Each begins with one half of what it is told, so every second test file is put into the second
    half: the nearest come first in both. Slow tests come after all others.
    """
    files = list(dict.fromkeys(test.file for test in tests))
    halves = [[test for test in tests if test.file in half] for half in (files[::2], files[1::2])]
    return [test for half in halves for test in by_file(half)]


def changed_files() -> list[str]:
    """Paths that differ from where this branch left `main`, and those that git does not track."""
    base = git("merge-base", "HEAD", "main") or ["HEAD"]
    return sorted(
        {*git("diff", "--name-only", base[0]), *git("ls-files", "--others", "--exclude-standard")}
    )


def git(*words: str) -> list[str]:
    """The lines that a git command prints; none where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else []


def near_tests(graph: ImportGraph, changed: list[str], seconds: float = SECONDS) -> list[NearTest]:
    """The tests near changed files that fit into a time, the first to run first.

    Args:
        graph: the imports of the tree.
        changed: paths from its top.
        seconds: sum of their recorded durations. Tests of changed test files run in any case.
    """
    recorded = durations()
    cases: dict[str, list[str]] = {}
    for node in recorded:
        if "[" in node:
            cases.setdefault(node.split("[")[0], []).append(node.split("::")[1])
    sources = [source for path in changed for source in sources_of(graph, path)]
    distances = graph.distances(sources)
    candidates = list[NearTest]()
    for file, tree in graph.trees.items():
        if not is_test_file(file) or (file.startswith(WHOLE_PROGRAM_TESTS) and file not in changed):
            continue
        distance = min(
            [distances.get(file, 99), *(distance_by_name(file, source) for source in sources)]
        )
        if distance == 99:
            continue
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
                names = cases.get(f"{file}::{node.name}", [node.name])
                for name in names:
                    test_seconds = recorded.get(f"{file}::{name}", DEFAULT_SECONDS)
                    candidates.append(NearTest(file, name, distance, test_seconds))
    chosen = list[NearTest]()
    files = set[str]()
    seconds_left = seconds
    for test in sorted(candidates, key=lambda test: test.order):
        cost = test.seconds + (0.0 if test.file in files else COLLECTION_SECONDS)
        if test.file in changed or cost <= seconds_left:
            chosen.append(test)
            files.add(test.file)
            seconds_left -= cost
    return chosen


@cache
def durations() -> dict[str, float]:
    """Seconds of tests by their node ids, as `tools/durations.py` writes them."""
    return dict(json.loads(DURATIONS.read_text(encoding="utf-8"))) if DURATIONS.exists() else {}


def sources_of(graph: ImportGraph, path: str) -> list[str]:
    """The files of the graph that a changed path stands for: itself, or those in its folder or
    above it."""
    if path in graph.trees or path in graph.c_files:
        return [path]
    for folder in Path(path).parents:
        siblings = [file for file in graph.trees if Path(file).parent == folder]
        if siblings:
            return siblings
    return []


def is_test_file(file: str) -> bool:
    """Whether a path is that of tests."""
    return file.startswith("tests/") and Path(file).name.startswith("test_")


def distance_by_name(test: str, source: str) -> int:
    """Returns the distance of a test file by its name and folder.

    It is 0 where it is called after the changed file and its folder mirrors that file's,
    FOLDER_DISTANCE where the folder alone does, and 99 elsewhere. Of C files, whose tests stand in
    several folders, the name is enough; for other tests of them see CALLS_THE_CORE.

    Args:
        test: the test file.
        source: the changed file.
    """
    if source.endswith((".c", ".h")):
        if Path(test).stem == f"test_{Path(source).stem}" and not test.startswith("tests/webapp/"):
            return 0
        distances = [
            distance
            for prefix, distance in CALLS_THE_CORE.items()
            if Path(test).is_relative_to(prefix)
        ]
        return min(distances, default=99)
    folders = Path(source).parent.parts
    mirror = Path("tests", *(folders[1:] if folders[:1] == ("finlab",) else folders))
    while mirror.parts != ("tests",) and not (ROOT / mirror).is_dir():
        mirror = mirror.parent
    if mirror.parts == ("tests",) or not Path(test).is_relative_to(mirror):
        return 99
    return 0 if Path(test).stem == f"test_{Path(source).stem}" else FOLDER_DISTANCE


if __name__ == "__main__":
    sys.exit(main())
