"""`finlab eval NAME`: one verb made from one experiment, whatever it is."""

from __future__ import annotations

import inspect
import json as json_text
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg
from tyro.extras import SubcommandApp

from finlab.errors import DataError

if TYPE_CHECKING:
    from finlab.evaluation.experiment import Experiment

JSON = "file for the rows, {'rows': [...]}; - prints them in place of the table."
PICTURE = "file for a picture of the rows, .png or .svg."


def add_experiments(verbs: SubcommandApp, argv: Sequence[str]) -> Sequence[str]:
    """Add a verb for each experiment.

    Only the one that is asked for is imported, or all for `finlab eval --help`; the others have no options
    here.

    Args:
        verbs: those of `finlab eval`.
        argv: the arguments after `finlab`.

    Returns:
        Their names.
    """
    from finlab.evaluation.experiment import EXPERIMENTS, load_experiment

    asked = argv[1] if argv[:1] == ["eval"] and len(argv) > 1 else ""
    for name in EXPERIMENTS:
        if name == asked or asked.startswith("-"):
            verbs.command(verb_of(load_experiment(name)), name=name)
        else:
            verbs.command(_not_asked, name=name)
    return list(EXPERIMENTS)


def _not_asked() -> None:
    """An experiment that is not imported."""


def verb_of(experiment: Experiment) -> Callable[..., None]:
    """A function whose signature says to the parser which options there are."""
    from finlab.evaluation.report.text import to_text

    options = experiment.options()

    def verb(**given: Any) -> None:
        json, picture = given.pop("json"), given.pop("picture", None)
        _check_file("json", json)
        _check_file("picture", picture)
        chosen = {name: _parsed(name, options[name], value) for name, value in given.items()}
        rows = experiment.rows(**chosen)
        content = json_text.dumps({"rows": rows}, indent=1, allow_nan=False)
        if json is not None and json != Path("-"):
            from finlab.whole_file import write_whole

            write_whole(json, content + "\n", DataError)
        if picture is not None and experiment.draw is not None:
            experiment.draw(rows).save(picture)
        print(content if json == Path("-") else to_text(*experiment.words(), *experiment.results(rows)))

    shown = {name: _shown(each) for name, each in options.items()}
    files = {"json": JSON} | ({"picture": PICTURE} if experiment.draw is not None else {})
    for name, words in files.items():
        kind = Annotated[Path | None, arg(metavar="FILE", help=words)]
        how = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
        shown[name] = how
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
        kind, default = (str | None if default is None else str), text
        kind = Annotated[kind, arg(metavar="A,B,...")]
    else:
        names = {int: "N", float: "X", str: "NAME"}
        if (word := names.get(plain_type(kind))) is not None:
            kind = Annotated[kind, arg(metavar=word)]
    if option.name == "layout":
        kind = Positional[Annotated[kind, arg(metavar="LAYOUT")]]
    return option.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)


def _parsed(name: str, option: inspect.Parameter, value: Any) -> Any:
    """What `run` gets for what was typed."""
    from finlab.evaluation.experiment import is_list, plain_type

    if not is_list(option.annotation) or value is None:
        return value
    words = [word.strip() for word in value.split(",") if word.strip()]
    kind, what = (
        plain_type(option.annotation),
        "whole numbers" if plain_type(option.annotation) is int else "names",
    )
    wrong = [word for word in words if kind is int and not word.isdecimal()]
    if wrong or not words:
        got = wrong[0] if wrong else value
        raise DataError(f"{name.replace('_', '-')}: expected {what} with commas between, got {got!r:.60}")
    return tuple(dict.fromkeys(kind(word) for word in words))


def _check_file(option: str, path: Path | None) -> None:
    """Refuse a file that cannot be written before the work, not after it."""
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise DataError(f"{option}: expected a file in an existing folder, got {path}")
