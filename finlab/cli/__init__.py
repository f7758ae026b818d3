"""The `finlab` command: verbs that parse, call one library function and print, and their pages of help.

A function is named after its verb; `verbs` is a `SubcommandApp` of several. A module imports the library only
inside its functions, so that `finlab --help` stays fast and `finlab layout check` never loads torch. It
writes its files before it prints, so that a reader that goes away (`finlab ... | head`) costs none of them.
"""

import io
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout

from tyro.extras import SubcommandApp

from finlab import __version__
from finlab.assets import EXTRAS, install
from finlab.cli.shared_options import with_json_file
from finlab.command_end import FAILED, exit_code
from finlab.errors import FinlabError

EXAMPLES = {
    "": "finlab allocate A --wrench 1 0 0.5 0 0 0.1",
    "allocate": "finlab allocate A --wrench 1 0 0.5 0 0 0.1 --lost front_right --json",
    "layout": "finlab layout show A",
    "layout check": "finlab layout check my_robot.yaml",
    "layout show": "finlab layout show A --lost front_right",
    "layout optimize": "finlab layout optimize A --fins front_right front_left -o better.yaml",
    "layout convert": "finlab layout convert robot.urdf my_robot.yaml",
    "data": "finlab data generate -o runs/data --layouts 200 --commands 500",
    "train": "finlab train mdn -o runs/mine --preset smoke",
    "train mdn": "finlab train mdn -o runs/mine --preset smoke",
    "train surrogate": "finlab train surrogate -o runs/surrogate --preset smoke",
    "train allocator": "finlab train allocator -o runs/paper --surrogate runs/surrogate --preset smoke",
    "eval": "finlab eval wrench --split id --layouts 10 --targets 10 --methods dual,sqp",
    "eval report": "finlab eval report -o runs/report --quick",
    "bench": "finlab bench dual analytic --quick --json bench.json",
    "fit": "finlab fit fin cell.csv -o fin.csv",
    "fit actuator": "finlab fit actuator bench.csv -o thruster.csv",
    "fit fin": "finlab fit fin cell.csv -o fin.csv",
    "fit robot": "finlab fit robot my_robot.yaml swim.npz -o fitted.yaml",
    "log": "finlab log dive.ulg --robot bluerov2_heavy --plot dive.png",
    "simulate": "finlab simulate A --duration 30 -o swim",
    "export": "finlab export A -o my_robot",
    "app": "finlab app --layout A --port 8080",
}
"""An example for each verb, and for each group of them."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command, by the arguments after the program's name, those of this process by default; the exit
    code, 0, or 2 after one plain sentence on stderr."""
    return exit_code("finlab", lambda: _run(list(sys.argv[1:] if argv is None else argv)))


def _run(argv: list[str]) -> int:
    if argv == ["--version"]:
        print(f"finlab {__version__}")
        return 0
    if not {"--help", "-h"}.isdisjoint(argv):
        caught = io.StringIO()
        with redirect_stdout(caught):  # what is no terminal gets no boxes
            code = _parsed(argv)
        print(f"{caught.getvalue().rstrip().replace('•', '-')}\n\nexample: {example(argv)}")
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
    about = "Control allocation for underwater robots: a target wrench in, commands out."
    try:
        code: int | None = _command_line(argv).cli(prog="finlab", description=about, args=argv)
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else FAILED
    return code or 0


def _command_line(argv: Sequence[str]) -> SubcommandApp:
    """All verbs; a function may return an exit code, None means 0."""
    from finlab.cli import eval_verbs, fit, layout_verbs, log_verb, robot_verbs, simulate, train_verbs

    root = SubcommandApp()
    root.command(robot_verbs.allocate)
    root.command(layout_verbs.verbs, name="layout", help="Check, show and optimize layout files.")
    root.command(train_verbs.data_verbs, name="data", help="Generate what the paper's networks learn from.")
    root.command(train_verbs.verbs, name="train", help="Train the networks of methods `mdn` and `paper`.")
    root.command(eval_verbs.verbs(argv), name="eval", help="Measure methods by the fins' own models.")
    root.command(eval_verbs.bench)
    root.command(fit.verbs, name="fit", help="Fit actuators and robots to measurements.")
    root.command(log_verb.log)
    root.command(simulate.simulate)
    root.command(robot_verbs.export)
    root.command(robot_verbs.app)
    return root


def example(argv: Sequence[str]) -> str:
    """The example of the verb that arguments begin with."""
    words = [word for word in argv if not word.startswith("-")]
    if words[:1] == ["eval"] and len(words) > 1 and " ".join(words[:2]) not in EXAMPLES:
        return f"finlab eval {words[1]} --json rows.json"
    names = (" ".join(words[:count]) for count in range(len(words), -1, -1))
    return next(EXAMPLES[name] for name in names if name in EXAMPLES)
