"""`finlab eval NAME`: one verb made from one experiment, whatever it is."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg
from tyro.extras import SubcommandApp

from finlab.cli.json_file import STDOUT, JsonFile, check_json_file, put_json
from finlab.errors import DataError

if TYPE_CHECKING:
    from finlab.evaluation.experiment import Experiment


def add_experiments(verbs: SubcommandApp, argv: Sequence[str]) -> None:
    """Add a verb for each experiment.

    Only the one that is asked for is imported, or all for `finlab eval --help`; the others have no options
    here.

    Args:
        verbs: those of `finlab eval`.
        argv: the arguments after `finlab`.
    """
    from finlab.evaluation.experiment import EXPERIMENTS, load_experiment

    chosen_verb = argv[1] if argv[:1] == ["eval"] and len(argv) > 1 else ""
    for name in EXPERIMENTS:
        if name == chosen_verb or chosen_verb.startswith("-"):
            verbs.command(name=name)(verb_of(load_experiment(name)))
        else:
            verbs.command(name=name)(_not_asked)


def _not_asked() -> None:
    """An experiment that is not imported."""


def verb_of(experiment: Experiment) -> Callable[..., None]:
    """A function whose signature says to the parser which options there are."""
    from finlab.evaluation.plots import check_picture, write_picture
    from finlab.evaluation.progress import begin
    from finlab.evaluation.report.document import to_text

    options = experiment.options()

    def verb(**typed: Any) -> None:
        json, plot = typed.pop("json"), typed.pop("plot", None)
        check_json_file(json)
        check_picture(plot)
        begin(experiment.name)
        chosen = {name: _parsed(name, options[name], value) for name, value in typed.items()}
        if plot is not None:
            chosen |= experiment.for_picture
        rows = []
        for row in experiment.each_row(**chosen):
            rows.append(row)
            if json != STDOUT:  # so that they are there if it is stopped
                put_json({"rows": rows}, json)
        put_json({"rows": rows}, json, to_text(*experiment.words(), *experiment.results(rows)))
        if plot is not None and experiment.picture is not None:
            write_picture(experiment.picture, rows, plot)

    shown = {name: _shown(each) for name, each in options.items()}
    rows_file = Annotated[
        JsonFile, arg(help="file for the rows, {'rows': [...]}; the rows alone without one")
    ]
    files: dict[str, Any] = {"json": rows_file}
    if experiment.picture is not None:
        about = "file for a picture, .png, .svg or .pdf (needs matplotlib, extra plot)"
        files["plot"] = Annotated[Path | None, arg(metavar="FILE", help=about)]
    for name, kind in files.items():
        shown[name] = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
    arguments = inspect.cleandoc(experiment.run.__doc__ or "").partition("Args:")[2].partition("\n\n")[0]
    verb.__doc__ = f"{experiment.question}\n\nArgs:{arguments}"
    verb.__signature__ = inspect.Signature(list(shown.values()))  # type: ignore[attr-defined]
    verb.__annotations__ = {name: each.annotation for name, each in shown.items()}
    return verb


def _shown(option: inspect.Parameter) -> inspect.Parameter:
    """An option as the parser takes it: lists are texts with commas between."""
    from finlab.evaluation.experiment import is_list, plain_type

    kind, default = option.annotation, option.default
    if is_list(kind):
        text = None if default is None else ",".join(map(str, default))
        kind, default = Annotated[str if text else str | None, arg(metavar="A,B,...")], text
    else:
        names = {int: "N", float: "X", str: "NAME"}
        if (word := names.get(plain_type(kind))) is not None:
            kind = Annotated[kind, arg(metavar=word)]
    if option.name == "layout":
        kind = Annotated[kind, Positional, arg(metavar="LAYOUT")]
    return option.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)


def _parsed(name: str, option: inspect.Parameter, value: Any) -> Any:
    """What `run` gets for what was typed."""
    from finlab.evaluation.experiment import is_list, plain_type

    if not is_list(option.annotation) or value is None:
        return value
    words = [word.strip() for word in value.split(",") if word.strip()]
    kind = plain_type(option.annotation)
    try:
        if words:
            return tuple(dict.fromkeys(kind(word) for word in words))
    except ValueError:
        pass
    what = "names" if kind is str else "numbers"
    raise DataError(f"{name.replace('_', '-')}: expected {what} with commas between, got {value!r:.60}")
