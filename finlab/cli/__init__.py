"""The `finlab` command: one file per verb; each parses, calls one library function and prints.

A module holds one function named after its verb, or `verbs`, a `SubcommandApp` of several. It imports the
library only inside its functions, so that `finlab --help` stays fast and `finlab layout check` never
loads torch. It writes its files before it prints, so that a reader that goes away (`finlab ... | head`) costs
none of them; `main` ends quietly then.
"""

import os
import sys
from collections.abc import Sequence

from tyro.extras import SubcommandApp

from finlab.errors import FinlabError

_INTERRUPTED = 130
"""128 + SIGINT, as shells report it."""
_BROKEN_PIPE = 141
"""128 + SIGPIPE, as shells report it."""

_EXTRAS = {"torch": "train", "viser": "app", "trimesh": "app", "yourdfpy": "urdf"}
_EXTRAS |= {"matplotlib": "plot", "markdown_it": "plot"}
"""Packages that some verbs need beside the base install, and the extra that brings each."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0, or 2 after one plain sentence on stderr.

    Args:
        argv: the arguments after the program's name; those of this process by default.
    """
    try:
        code = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except FinlabError as error:
        return _fail(str(error))
    except ModuleNotFoundError as error:
        package = str(error.name).split(".")[0]
        if package not in _EXTRAS:
            raise
        return _fail(f"{package} is not installed; pip install 'finlab[{_EXTRAS[package]}]'")
    except KeyboardInterrupt:
        return _INTERRUPTED
    except OSError as error:
        if error.filename is not None:
            return _fail(f"{error.filename}: {error.strerror}")
        # Our output cannot be written: its reader went away (`finlab ... | head`) or the disk is full. Python
        # flushes stdout once more at exit; give it somewhere to write.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            return _BROKEN_PIPE
        return _fail(f"cannot print: {error.strerror}")
    return code


def _run(argv: list[str]) -> int:
    """Parse and run; turn the parser's exit into a code."""
    try:
        code = _command_line(argv).cli(prog="finlab", description=_DESCRIPTION, args=argv)
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else 2
    return code or 0


def _fail(sentence: str) -> int:
    print(f"finlab: error: {sentence}", file=sys.stderr)
    return 2


_DESCRIPTION = "Control allocation for fin-actuated underwater robots: a target wrench in, commands out."


def _command_line(argv: Sequence[str]) -> SubcommandApp:
    """All verbs; a function may return an exit code, None means 0."""
    from finlab.cli import allocate, app, bench, evaluate, export, fit, layout, simulate, train

    root = SubcommandApp()
    root.command(allocate.allocate)
    root.command(layout.verbs, name="layout", help="Check, show and optimize layout files.")
    root.command(train.verbs, name="train", help="Train the surrogate and the allocator.")
    root.command(evaluate.verbs(argv), name="eval", help="Measure methods against the analytic fin model.")
    root.command(bench.bench)
    root.command(fit.verbs, name="fit", help="Fit fins to measurements.")
    root.command(simulate.simulate)
    root.command(export.export)
    root.command(app.app)
    return root
