"""`finlab eval ...`: a verb for every experiment, and `report`, which runs them all."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.eval_verb import add_experiments
from finlab.errors import DataError


def report(
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    quick: bool = False,
    sections: Annotated[str, arg(metavar="A,B,...")] = "all",
    seed: Annotated[int, arg(metavar="N")] = 6143,
) -> None:
    """Run every experiment and make one page of them in Markdown, and a file of their rows.

    What is done is in DIR if it is stopped.

    Args:
        out: folder for the report.
        quick: a look on few cases, in minutes; the whole takes half an hour.
        sections: run only these experiments.
        seed: of all draws.
    """
    if out.exists() and not out.is_dir():
        raise DataError(f"out: expected a folder, got the file {out}")
    from finlab.evaluation.report.make import make_report

    names = [name.strip() for name in sections.split(",") if name.strip()]
    print(make_report(out, size="quick" if quick else "full", seed=seed, names=names))


def verbs(argv: Sequence[str]) -> SubcommandApp:
    """All verbs of `finlab eval`, from the arguments after `finlab`."""
    found = SubcommandApp()
    add_experiments(found, argv)
    found.command(report)
    return found
