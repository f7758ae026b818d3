"""`finlab eval NAME`, a verb made from each experiment, `finlab eval report` and `finlab bench`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg
from tyro.extras import SubcommandApp

from finlab.cli.shared_options import STDOUT, Cluster, Count, JsonFile, check_json_file, put_json
from finlab.errors import DataError

if TYPE_CHECKING:
    from finlab.research.evaluation.experiment import Experiment, Size


def verbs(argv: Sequence[str]) -> SubcommandApp:
    """All verbs of `finlab eval`, from the arguments after `finlab`.

    Only the experiment that these name is imported, or all for `finlab eval --help`; the others
    have no options here.
    """
    from finlab.research.evaluation.experiment import EXPERIMENTS, load_experiment

    app = SubcommandApp()
    name_asked = argv[1] if argv[:1] == ["eval"] and len(argv) > 1 else ""
    for name in EXPERIMENTS:
        is_asked = name == name_asked or name_asked.startswith("-")
        app.command(name=name)(verb_of(load_experiment(name)) if is_asked else lambda: None)
    app.command(report)
    return app


def verb_of(experiment: Experiment) -> Callable[..., None]:
    """Returns a function whose signature tells the parser the options of an experiment."""
    from finlab.display.figures import check_figure_file, write_figure
    from finlab.research.evaluation.document import to_text
    from finlab.research.evaluation.experiment import begin
    from finlab.research.executor import on_cluster

    options = experiment.options()

    def verb(json: Path | None, cluster: str | None, **typed: Any) -> None:
        plot = typed.pop("plot", None)
        check_json_file(json)
        check_figure_file(plot)
        begin(experiment.name)
        chosen = {name: _parsed_option(name, options[name], value) for name, value in typed.items()}
        hidden = None
        if plot is not None:
            needed = experiment.for_picture
            # What the picture needs beside the table stays out of it, unless it was asked for.
            if any(chosen[name] != value for name, value in needed.items()):
                hidden = experiment.only_for_picture
            chosen |= needed
        rows = []
        shown = []
        with on_cluster(cluster):
            for row in experiment.each_row(**chosen):
                rows.append(row)
                if hidden is None or not hidden(row):
                    shown.append(row)
                if json != STDOUT:  # so that they are there if it is stopped
                    put_json({"rows": shown}, json)
        put_json({"rows": shown}, json, to_text(*experiment.words(), *experiment.results(shown)))
        picture = experiment.picture
        if plot is not None and picture is not None:
            write_figure(lambda: picture(rows), plot)

    parameters = {name: _parser_option(option) for name, option in options.items()}
    rows_file = Annotated[
        JsonFile, arg(help="file for the rows, {'rows': [...]}; the rows alone without one")
    ]
    files: dict[str, Any] = {"json": rows_file, "cluster": Cluster}
    if experiment.picture is not None:
        help_text = "file for a picture, .png, .svg or .pdf (needs matplotlib, extra plot)"
        files["plot"] = Annotated[Path | None, arg(metavar="FILE", help=help_text)]
    for name, kind in files.items():
        parameters[name] = inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind
        )
    arguments = (
        inspect.cleandoc(experiment.run.__doc__ or "").partition("Args:")[2].partition("\n\n")[0]
    )
    verb.__doc__ = f"{experiment.question}\n\nArgs:{arguments}"
    verb.__signature__ = inspect.Signature(list(parameters.values()))  # type: ignore[attr-defined]
    verb.__annotations__ = {name: option.annotation for name, option in parameters.items()}
    return verb


def examples_of(name: str) -> tuple[str, ...]:
    """Two lines for a shell: an experiment as the quick report runs it, and with its rows in a
    file.

    Args:
        name: the experiment, one of `EXPERIMENTS`; for another name those of `wrench`.
    """
    from finlab.research.evaluation.experiment import EXPERIMENTS, load_experiment

    experiment = load_experiment(name if name in EXPERIMENTS else "wrench")
    return experiment.command(experiment.quick), f"finlab eval {experiment.name} --json rows.json"


def _parser_option(option: inspect.Parameter) -> inspect.Parameter:
    """An option as the parser takes it: lists are texts with commas between."""
    from finlab.research.evaluation.experiment import item_type

    kind = option.annotation
    default = option.default
    item, is_list = item_type(kind)
    if is_list:
        text = None if default is None else ",".join(map(str, default))
        kind = Annotated[str if text else str | None, arg(metavar="A,B,...")]
        default = text
    elif (word := {int: "N", float: "X", str: "NAME"}.get(item)) is not None:
        kind = Annotated[kind, arg(metavar=word)]
    if option.name == "layout":
        kind = Annotated[kind, Positional, arg(metavar="LAYOUT")]
    return option.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)


def _parsed_option(name: str, option: inspect.Parameter, value: Any) -> Any:
    """The value of an option as its experiment takes it: a text with commas becomes a tuple."""
    from finlab.research.evaluation.experiment import item_type

    kind, is_list = item_type(option.annotation)
    if not is_list or value is None:
        return value
    with suppress(ValueError):
        words = dict.fromkeys(kind(word) for word in map(str.strip, value.split(",")) if word)
        if words:
            return tuple(words)
    expected = "names" if kind is str else "numbers"
    raise DataError(
        f"{name.replace('_', '-')}: expected {expected} with commas between, got {value!r:.60}"
    )


def report(
    output: Annotated[Path, arg(metavar="DIR", aliases=["-o"])],
    quick: bool = False,
    full: bool = False,
    sections: Annotated[str, arg(metavar="A,B,...")] = "all",
    seed: Count = 6143,
) -> None:
    """Run every experiment and make one page of them in Markdown, and a file of their rows.

    Beside each figure that the paper prints the page says whether it is reproduced, and why. What
    is done is kept in DIR: a report that was stopped goes on when it is asked for again, and what
    has not changed since is not run again.

    Args:
        output: folder for the report.
        quick: a look on few cases, in minutes; the usual one takes an hour of one core.
        full: the paper's own sizes, in a day.
        sections: run only these experiments.
        seed: of all draws.
    """
    if output.exists() and not output.is_dir():
        raise DataError(f"output: expected a folder, got the file {output}")
    if quick and full:
        raise DataError("quick, full: expected at most one of them, got both")
    from finlab.research.evaluation.report_page import make_report

    names = [name.strip() for name in sections.split(",") if name.strip()]
    size: Size = "quick" if quick else "full" if full else "usual"
    print(make_report(output, size=size, seed=seed, names=names))


QUICK_SPLITS = ("id", "ood", "limits", "failure")
"""Splits of a quick run of `finlab bench`."""


def bench(
    methods: Annotated[Positional[tuple[str, ...]], arg(metavar="METHOD")] = ("dual",),
    quick: bool = False,
    splits: Annotated[str | None, arg(metavar="A,B,...")] = None,
    seed: Count = 8821,
    json: JsonFile = None,
    cluster: Cluster = None,
) -> None:
    """Measure allocation methods, yours or finlab's, on the same robots and wrenches: error, power,
    time.

    Example: finlab bench my_method.py:allocate dual --quick

    Args:
        methods: a method of finlab (dual, analytic, ipopt, ...), or a Python function as
            module:function or file.py:function.
        quick: four splits of robots, five of each, in seconds.
        splits: sets of robots, as in `finlab eval wrench`.
        seed: of robots and wrenches.
    """
    check_json_file(json)
    from finlab.research.evaluation.document import to_text
    from finlab.research.evaluation.experiments.robots import HARD
    from finlab.research.evaluation.experiments.wrench import experiment
    from finlab.research.executor import on_cluster

    names = tuple(splits.split(",")) if splits else QUICK_SPLITS if quick else HARD
    size = {"layouts": 5, "targets": 4} if quick else {"layouts": 20, "targets": 10}
    with on_cluster(cluster):
        rows = experiment.rows(split=names, methods=methods, seed=seed, **size)
    put_json({"rows": rows}, json, to_text(*experiment.results(rows)))
