"""`finlab bench`: any method on the shipped problems, beside the stored results of finlab's own."""

import shlex
import sys
from typing import Annotated

from tyro.conf import Positional, arg

from finlab.cli.json_file import JsonFile, check_json_file, put_json
from finlab.errors import DataError


def bench(
    methods: Annotated[Positional[tuple[str, ...]], arg(metavar="METHOD")] = ("dual",),
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
            module:function or file.py:function.
        quick: the first robot of each set and the first paths, within a minute.
        sets: sets of robots with commas between, such as paper,tiny.
        limit: longest time for one target; a later answer is a failure.
        cpu: time calls by the processor's time, which other work on the machine does not prolong.
        json: file for the results; they are printed in place of the table where no file is named.
    """
    import time

    from tqdm import tqdm

    if not limit > 0.0:
        raise DataError(f"limit: expected a number of seconds above 0, got {limit}")
    if len(set(methods)) < len(methods):
        raise DataError(f"methods: expected different names, got {', '.join(methods)}")
    check_json_file(json)
    with tqdm(desc="bench", unit="target", disable=None, leave=False, file=sys.stderr) as bar:
        from finlab.bench.methods import bench_method
        from finlab.bench.metrics import figures
        from finlab.bench.problems import open_problems
        from finlab.bench.runner import LIMIT_S, run_method

        tested, asked, found = [bench_method(name) for name in methods], open_problems(), []
        part = asked if sets == "all" else asked.of_sets([name.strip() for name in sets.split(",")])
        chosen, clock = part.quick() if quick else part, time.process_time if cpu else time.perf_counter
        for method in tested:
            bar.set_description(method.name, refresh=False)
            bar.reset(len(chosen.targets.robot) + chosen.sequences.best_error.size)
            found.append(figures(chosen, run_method(method, chosen, limit, bar.update, clock)))

    from finlab.bench.results import results, stored
    from finlab.bench.table import text

    words = ["finlab", "bench", *methods, *["--sets", sets] * (part is not asked), *["--quick"] * quick]
    words += ["--cpu"] * cpu + ["--limit", f"{limit:g}"] * (limit != LIMIT_S)
    run = results(found, asked, quick=quick, limit_s=limit, command=shlex.join(words))
    table = text(run, stored(asked, quick=quick) if part is asked else None)
    try:
        put_json(run, json, table)
    except DataError:  # a full disk does not cost the table
        print(table)
        raise
