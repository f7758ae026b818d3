"""The `finlab` command: one file per verb; each parses, calls one library function and prints.

A module holds one function named after its verb, or `verbs`, a `SubcommandApp` of several. It imports the
library only inside its functions, so that `finlab --help` stays fast and `finlab layout check` never
loads torch. It writes its files before it prints, so that a reader that goes away (`finlab ... | head`) costs
none of them.
"""

import sys
from collections.abc import Sequence

from tyro.extras import SubcommandApp

from finlab import __version__
from finlab.assets import EXTRAS, install
from finlab.cli.help_page import asks_for_help, help_page
from finlab.cli.json_file import with_json_file
from finlab.command_end import FAILED, exit_code
from finlab.errors import FinlabError


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0, or 2 after one plain sentence on stderr.

    Args:
        argv: the arguments after the program's name; those of this process by default.
    """
    return exit_code("finlab", lambda: _run(list(sys.argv[1:] if argv is None else argv)))


def _run(argv: list[str]) -> int:
    if argv == ["--version"]:
        print(f"finlab {__version__}")
        return 0
    if asks_for_help(argv):
        code, page = help_page(argv, lambda: _parsed(argv))
        print(page)
        return code
    try:
        return _parsed(with_json_file(argv))
    except ModuleNotFoundError as error:
        package = str(error.name).split(".")[0]
        if package not in EXTRAS:
            raise
        raise FinlabError(f"{package} is not installed; run: {install(EXTRAS[package])}") from None


def _parsed(argv: list[str]) -> int:
    """Parse and run; turn the parser's exit into a code."""
    try:
        code: int | None = _command_line(argv).cli(prog="finlab", description=_DESCRIPTION, args=argv)
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else FAILED
    return code or 0


_DESCRIPTION = "Control allocation for underwater robots: a target wrench in, commands out."


def _command_line(argv: Sequence[str]) -> SubcommandApp:
    """All verbs; a function may return an exit code, None means 0."""
    from finlab.cli import allocate, app, bench, data, evaluate, export, fit, layout, simulate, train

    root = SubcommandApp()
    root.command(allocate.allocate)
    root.command(layout.verbs, name="layout", help="Check, show and optimize layout files.")
    root.command(data.verbs, name="data", help="Generate what the paper's networks learn from.")
    root.command(train.verbs, name="train", help="Train the networks of methods `mdn` and `paper`.")
    root.command(evaluate.verbs(argv), name="eval", help="Measure methods by the fins' own models.")
    root.command(bench.bench)
    root.command(fit.verbs, name="fit", help="Fit actuators and robots to measurements.")
    root.command(simulate.simulate)
    root.command(export.export)
    root.command(app.app)
    return root
