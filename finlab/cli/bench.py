"""`finlab bench`: any method on the shipped problems, beside the stored results of finlab's own."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.eval_arguments import Names, Output
from finlab.errors import DataError

if TYPE_CHECKING:
    from finlab.bench.runner import Method


def bench(
    methods: Annotated[Positional[tuple[str, ...]], arg(metavar="METHOD")] = (),
    command: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="COMMAND")] = (),
    quick: bool = False,
    sets: Names = "all",
    limit: Annotated[float, arg(metavar="SECONDS")] = 1.0,
    cpu: bool = False,
    together: bool = False,
    problems: Annotated[Path | None, arg(metavar="FILE")] = None,
    page: Annotated[Path | None, arg(metavar="FILE")] = None,
    json: Annotated[Path | None, arg(metavar="FILE")] = None,
) -> None:
    """Measure allocation methods, yours or finlab's, on the same problems: error, power, turn, time.

    Args:
        methods: a method of finlab (search, analytic, ipopt-32, search-effort, ...), or a Python function as
            module:function or file.py:function; method search where nothing is named.
        command: a program that speaks JSON lines on stdin and stdout, with its arguments.
        quick: the first robot of each set and the first paths, within a minute.
        sets: sets of robots with commas between, such as paper,tiny.
        limit: longest time for one target; a later answer is a failure.
        cpu: time Python functions by the processor's time, which other work on the machine does not prolong.
        together: ask for all targets of a robot in one call.
        problems: file of problems; the shipped one by default.
        page: file for a page that needs nothing else.
        json: file for the results.
    """
    from finlab.bench.metrics import figures
    from finlab.bench.page import document, rows_of, summary_blocks
    from finlab.bench.problems import FILE, open_problems
    from finlab.bench.results import comparable, results, save_results
    from finlab.bench.runner import LIMIT_S, run_method
    from finlab.evaluation.report.text import to_text

    if not limit > 0.0:
        raise DataError(f"limit: expected a number of seconds above 0, got {limit}")
    for file in (page, json):
        Output(file)
    if page is not None:
        from finlab.evaluation.report.pages import to_html  # what a page needs is missed before the run
    asked = open_problems(problems or FILE)
    part = asked if sets == "all" else asked.of_sets([name.strip() for name in sets.split(",")])
    chosen = part.quick() if quick else part
    tested = _tested(methods, command, cpu)
    found = [figures(chosen, run_method(method, chosen, limit, together)) for method in tested]
    words = ["finlab", "bench", *methods, *(word for each in command for word in ("--command", each))]
    words += ["--sets", sets] * (part is not asked) + ["--quick"] * quick + ["--together"] * together
    words += ["--cpu"] * cpu + ["--limit", f"{limit:g}"] * (limit != LIMIT_S)
    run = results(found, asked, quick=quick, together=together, limit_s=limit, command=shlex.join(words))
    stored = comparable(asked, quick=quick, together=together) if part is asked else None
    if json is not None:
        save_results(run, json)
    if page is not None:
        page.write_text(to_html(document(run, stored, asked)), "utf-8")
    print(to_text(*summary_blocks(rows_of(run, stored), stored)))


def _tested(methods: tuple[str, ...], commands: tuple[str, ...], cpu: bool) -> list[Method]:
    """The methods that were named, each of another name."""
    from finlab.bench.runner import Method
    from finlab.evaluation.method_specs import load_method_specs

    if own := [name for name in methods if ":" not in name]:
        load_method_specs(",".join(own))  # a wrong name costs no time
    tested = [Method.of(name, cpu) for name in methods or (() if commands else ("search",))]
    for text in commands:
        words = shlex.split(text)
        if not words:
            raise DataError("command: expected a program and its arguments, got nothing")
        tested.append(Method(" ".join(Path(word).name for word in words), tuple(words)))
    names = [method.name for method in tested]
    if len(set(names)) < len(names):
        raise DataError(f"methods: expected different names, got {', '.join(names)}")
    return tested
