"""`finlab bench`: methods, yours or finlab's, on the held-out robots of `finlab eval wrench`."""

from typing import Annotated

from tyro.conf import Positional, arg

from finlab.cli.json_file import JsonFile, check_json_file, put_json

QUICK = ("id", "ood", "limits", "failure")
"""Splits of a quick run."""


def bench(
    methods: Annotated[Positional[tuple[str, ...]], arg(metavar="METHOD")] = ("dual",),
    quick: bool = False,
    splits: Annotated[str | None, arg(metavar="A,B,...")] = None,
    seed: Annotated[int, arg(metavar="N")] = 8821,
    json: JsonFile = None,
) -> None:
    """Measure allocation methods, yours or finlab's, on the same robots and wrenches: error, power, time.

    Example: finlab bench my_method.py:allocate dual --quick

    Args:
        methods: a method of finlab (dual, analytic, ipopt, ...), or a Python function as
            module:function or file.py:function.
        quick: four splits of robots, five of each, in seconds.
        splits: sets of robots, as in `finlab eval wrench`.
        seed: of robots and wrenches.
        json: file for the rows; they are printed in place of the table where no file is named.
    """
    check_json_file(json)
    from finlab.evaluation.experiments.wrench import HARD, experiment
    from finlab.evaluation.report.document import to_text

    asked = tuple(splits.split(",")) if splits else QUICK if quick else HARD
    size = {"layouts": 5, "targets": 4} if quick else {"layouts": 20, "targets": 10}
    rows = experiment.rows(split=asked, methods=methods, seed=seed, **size)
    put_json({"rows": rows}, json, to_text(*experiment.results(rows)))
