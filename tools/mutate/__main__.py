"""Mutation testing: which small changes of the source would no test notice?

Draws places in the source at random, makes one of the changes there that cosmic-ray's operators know, and
runs the tests that touch the changed line until one fails. Prints the survivors and the share of mutants
killed in each room: `make mutate MUTANTS=300 SEED=0`. Equivalent mutants are listed in `equivalent.yaml`.
"""

import argparse
import dataclasses
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import yaml
from mutants import ROOT, Mutant, find_places
from suite import STORE, Suite, all_tests, copy_tree, measure, start_tests
from tqdm import tqdm

ROOMS = ("allocation", "forces", "physics", "deploy")
EQUIVALENT = Path(__file__).with_name("equivalent.yaml")
SURVIVORS = STORE / "survivors.yaml"


def is_equivalent(mutant: Mutant) -> bool:
    """Whether the list knows the change: parts of the lines before and after, and perhaps the file."""
    before, after = mutant.change()
    return any(
        entry["before"] in before
        and entry["after"] in after
        and entry.get("file", mutant.file) == mutant.file
        for entry in yaml.safe_load(EQUIVALENT.read_text())
    )


def draw(only: list[str], count: int, seed: int) -> list[Mutant]:
    """Mutants at places drawn without replacement; known equivalent ones are passed over."""
    files = sorted(
        p for name in only for p in ([ROOT / name] if name.endswith(".py") else (ROOT / name).rglob("*.py"))
    )
    places = [place for path in files for place in find_places(path.relative_to(ROOT).as_posix())]
    dice = random.Random(seed)
    drawn: list[Mutant] = []
    for place in dice.sample(places, len(places)):
        mutant = dice.choice(place)
        if len(drawn) < count and not is_equivalent(mutant):
            drawn.append(mutant)
    return drawn


def judge(mutants: list[Mutant], copies: list[Path]) -> Iterator[tuple[Mutant, str]]:
    """Each mutant with `killed`, `timeout` or `survived`, in the order in which they end."""
    suite, waiting, free = Suite(), mutants[::-1], copies[:]
    running: dict[int, tuple[Mutant, Path, float]] = {}
    while waiting or running:
        while waiting and free:
            mutant = waiting.pop()
            tests = suite.tests_of(mutant)
            if not tests:
                yield mutant, "survived"
                continue
            copy = free.pop()
            (copy / mutant.file).write_text(mutant.source())
            limit = 30.0 + 4.0 * suite.cost(tests)  # the machine may be busy, and loading takes its time
            running[start_tests(copy, tests)] = mutant, copy, time.monotonic() + limit
        time.sleep(0.02)
        for child, (mutant, copy, end) in list(running.items()):
            done, status = os.waitpid(child, os.WNOHANG)
            late = not done and time.monotonic() > end
            if late:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
            if done or late:
                code = os.waitstatus_to_exitcode(status)
                output = (copy / "tests.log").read_text(errors="replace")
                if code in (5, 70) or "ERROR: not found" in output:
                    raise RuntimeError(f"a test that was measured is not there for {mutant}:\n{output}")
                del running[child]
                (copy / mutant.file).write_text(mutant.original)
                free.append(copy)
                yield mutant, "timeout" if late else "killed" if code else "survived"


def report(judged: list[tuple[Mutant, str]]) -> float:
    """Print survivors and shares; returns the percentage killed."""
    survivors = sorted((m for m, verdict in judged if verdict == "survived"), key=lambda m: (m.file, m.line))
    for mutant in survivors:
        before, after = mutant.change()
        print(f"{mutant.file}:{mutant.line}\n  - {before}\n  + {after}")
    rooms: dict[str, list[str]] = {}
    for mutant, verdict in judged:
        rooms.setdefault("/".join(Path(mutant.file).parts[:2]), []).append(verdict)
    for room, verdicts in [*sorted(rooms.items()), ("all", [verdict for _, verdict in judged])]:
        killed = len(verdicts) - verdicts.count("survived")
        share = 100.0 * killed / len(verdicts)
        print(f"{room:20} {killed:4} of {len(verdicts):4} killed: {share:5.1f} %", end="")
        print(f" ({verdicts.count('timeout')} by running out of time)")
    SURVIVORS.write_text(yaml.safe_dump([dataclasses.asdict(mutant) for mutant in survivors]))
    return share


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mutants", type=int, default=300, help="how many to draw")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", nargs="+", default=[f"finlab/{room}" for room in ROOMS], help="files, folders"
    )
    parser.add_argument("--tests", nargs="+", default=all_tests(), help="files, folders of tests that judge")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--reuse", action="store_true", help="keep what the last run measured of the tests")
    parser.add_argument("--again", action="store_true", help="judge only the last run's survivors")
    parser.add_argument("--at-least", type=float, default=85.0, help="percent killed; less is a failure")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copies = [copy_tree(Path(folder) / str(job)) for job in range(given.jobs)]
        if given.again:
            mutants = [Mutant(**entry) for entry in yaml.safe_load(SURVIVORS.read_text())]
        else:
            mutants = draw(given.only, given.mutants, given.seed)
        if not given.reuse:
            measure(copies[0], given.jobs, given.tests)
        judged = list(tqdm(judge(mutants, copies), total=len(mutants), disable=None, unit="mutant"))
    return int(report(judged) < given.at_least)


if __name__ == "__main__":
    sys.exit(main())
