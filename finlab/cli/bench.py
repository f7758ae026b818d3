"""`finlab bench`: any method on the shipped problems, beside the stored results of finlab's own."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.json_file import JsonFile, check_json_file, put_json
from finlab.errors import DataError

if TYPE_CHECKING:
    from finlab.bench.runner import BenchMethod


def bench(
    methods: Annotated[Positional[tuple[str, ...]], arg(metavar="METHOD")] = (),
    command: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="COMMAND")] = (),
    quick: bool = False,
    sets: Annotated[str, arg(metavar="A,B,...")] = "all",
    limit: Annotated[float, arg(metavar="SECONDS")] = 1.0,
    cpu: bool = False,
    json: JsonFile = None,
) -> None:
    """Measure allocation methods, yours or finlab's, on the same problems: error, power, turn, time.

    Example: finlab bench my_method.py:allocate --quick

    Args:
        methods: a method of finlab (dual, analytic, ipopt-32, sqp-effort, ...), or a Python function as
            module:function or file.py:function; method dual where nothing is named.
        command: a program that speaks JSON lines on stdin and stdout, with its arguments.
        quick: the first robot of each set and the first paths, within a minute.
        sets: sets of robots with commas between, such as paper,tiny.
        limit: longest time for one target; a later answer is a failure.
        cpu: time Python functions by the processor's time, which other work on the machine does not prolong.
        json: file for the results; they are printed in place of the table where no file is named.
    """
    from tqdm import tqdm

    if not limit > 0.0:
        raise DataError(f"limit: expected a number of seconds above 0, got {limit}")
    check_json_file(json)
    with tqdm(desc="bench", unit="target", disable=None, leave=False, file=sys.stderr) as bar:
        from finlab.bench.metrics import figures
        from finlab.bench.problems import open_problems
        from finlab.bench.runner import LIMIT_S, run_method

        asked = open_problems()
        part = asked if sets == "all" else asked.of_sets([name.strip() for name in sets.split(",")])
        chosen = part.quick() if quick else part
        tested, found = _tested(methods, command, cpu), []
        for method in tested:
            bar.set_description(method.name, refresh=False)
            bar.reset(len(chosen.targets.robot) + chosen.sequences.best_error.size)
            found.append(figures(chosen, run_method(method, chosen, limit, bar.update)))

    from finlab.bench.results import results, stored
    from finlab.bench.table import text

    words = ["finlab", "bench", *methods, *(word for each in command for word in ("--command", each))]
    words += ["--sets", sets] * (part is not asked) + ["--quick"] * quick
    words += ["--cpu"] * cpu + ["--limit", f"{limit:g}"] * (limit != LIMIT_S)
    run = results(found, asked, quick=quick, limit_s=limit, command=shlex.join(words))
    beside = stored(asked, quick=quick) if part is asked else None
    table = text(run, beside)
    try:
        put_json(run, json, table)
    except DataError:  # a full disk does not cost the table
        print(table)
        raise


def _tested(methods: tuple[str, ...], commands: tuple[str, ...], cpu: bool) -> list[BenchMethod]:
    """The methods that were named, each of another name."""
    from finlab.bench.runner import BenchMethod
    from finlab.evaluation.method_specs import load_method_specs

    if own := [name for name in methods if ":" not in name]:
        load_method_specs(",".join(own))  # a wrong name costs no time
    tested = [BenchMethod.of(name, cpu) for name in methods or (() if commands else ("dual",))]
    for text in commands:
        words = shlex.split(text)
        if not words:
            raise DataError("command: expected a program and its arguments, got nothing")
        tested.append(BenchMethod(" ".join(Path(word).name for word in words), tuple(words)))
    names = [method.name for method in tested]
    if len(set(names)) < len(names):
        raise DataError(f"methods: expected different names, got {', '.join(names)}")
    return tested
