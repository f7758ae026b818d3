"""The `finlab` command: its verbs, each of which parses, calls one library function and prints.

`VERBS` names the function of each verb, by module. A module imports the library only inside its
functions, so that `finlab --help` stays fast and `finlab layout check` never loads torch. It writes
its files before it prints, so that a reader that goes away (`finlab ... | head`) costs none of
them.
"""

import io
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import partial
from pkgutil import resolve_name
from typing import Any

import tyro
from tyro.extras import SubcommandApp

from finlab import __version__
from finlab.assets import EXTRA_OF_PACKAGE, install_command, warning_of_other_distribution
from finlab.cli.shared_options import with_json_file
from finlab.errors import EXIT_ERROR, FinlabError, exit_code

EXAMPLES: dict[str, tuple[str, ...]] = {
    "": ("finlab allocate A --wrench 1 0 0.5 0 0 0.1", "finlab app"),
    "allocate": (
        "finlab allocate A --wrench 1 0 0.5 0 0 0.1 --lost front_right --json",
        "finlab allocate ucat --wrench 9 0 2 0 0 0 --policy direction --weak back_left=0.5",
    ),
    "layout": ("finlab layout show A",),
    "layout check": ("finlab layout check my_robot.yaml", "finlab layout check A B my_robot.yaml"),
    "layout show": (
        "finlab layout show A --lost front_right",
        "finlab layout show A --json card.json",
    ),
    "layout capability": (
        "finlab layout capability bluerov2_heavy --plot polar.png",
        "finlab layout capability catamaran --headings 72 --csv polar.csv",
    ),
    "layout optimize": (
        "finlab layout optimize A --actuators front_right front_left -o better.yaml",
        "finlab layout optimize bluerov2 --actuators front_left --goal worst_single_failure -o "
        "better.yaml",
    ),
    "layout prove": (
        "finlab layout prove bluerov2_heavy --box 20 20 20 1 1 2 --lost 1 -o proof.json",
        "finlab layout prove hexa --box-share 0.15 --power 200",
    ),
    "layout convert": (
        "finlab layout convert robot.urdf my_robot.yaml",
        "finlab layout convert my_robot.yaml robot.params --to px4",
    ),
    "data": ("finlab data generate -o runs/data --layouts 200 --commands 500",),
    "data generate": ("finlab data generate -o runs/data --layouts 200 --commands 500",),
    "data interaction": ("finlab data interaction -o jets.npz --layouts 200",),
    "train": ("finlab train mdn -o runs/mine --preset smoke",),
    "train mdn": (
        "finlab train mdn -o runs/mine --preset smoke",
        "finlab train mdn -o runs/mine --minutes 60 --resume",
    ),
    "train surrogate": ("finlab train surrogate -o runs/surrogate --preset smoke",),
    "train allocator": (
        "finlab train allocator -o runs/paper --surrogate runs/surrogate --preset smoke",
        "finlab train allocator -o runs/paper --surrogate runs/surrogate --resume --device cuda:0",
    ),
    "train interaction": ("finlab train interaction jets.npz -o runs/jets --minutes 20",),
    "train policy": ("finlab train policy -o runs/policy --preset smoke",),
    "eval": ("finlab eval wrench --split id --layouts 10 --targets 10 --methods dual,sqp",),
    "eval report": ("finlab eval report -o runs/report --quick",),
    "bench": ("finlab bench dual analytic --quick --json bench.json",),
    "fit": ("finlab fit fin cell.csv -o fin.csv", "finlab fit thruster bench.csv -o thruster.csv"),
    "fit actuator": ("finlab fit actuator bench.csv -o thruster.csv",),
    "fit thruster": (
        "finlab fit thruster bench.csv -o thruster.csv",
        "finlab fit thruster maker.xlsx -o thruster.csv --voltage 14.8",
    ),
    "fit fin": ("finlab fit fin cell.csv -o fin.csv",),
    "fit interaction": ("finlab fit interaction my_robot.yaml tank.csv -o with_jets.yaml",),
    "fit robot": ("finlab fit robot my_robot.yaml swim.npz -o fitted.yaml",),
    "log": (
        "finlab log dive.ulg --plot dive.png",
        "finlab log dive.bin --robot bluerov2_heavy -o better.yaml",
    ),
    "simulate": (
        "finlab simulate A --duration 30 -o swim",
        "finlab simulate A --lost front_left@45 --plot path.svg",
    ),
    "export": ("finlab export A -o my_robot", "finlab export bluerov2_heavy --c firmware"),
    "app": ("finlab app --layout A --port 8080",),
}
"""Examples of each verb, and of each group of them; those of an experiment are made of its
options."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code: 0, or 2 after one plain sentence on stderr.

    Args:
        argv: the arguments after the program's name; those of this process when None.
    """
    if argv is None and (warning := warning_of_other_distribution()) is not None:
        print(f"finlab: {warning}", file=sys.stderr)
    return exit_code("finlab", lambda: _run(list(sys.argv[1:] if argv is None else argv)))


def _run(argv: list[str]) -> int:
    """Runs a command, or prints the version or a page of help with examples."""
    if argv == ["--version"]:
        print(f"finlab {__version__}")
        return 0
    if not {"--help", "-h"}.isdisjoint(argv):
        caught = io.StringIO()
        with redirect_stdout(caught):  # what is no terminal gets no boxes
            code = _run_parsed(argv)
        print(caught.getvalue().rstrip().replace("•", "-"))
        print()
        for line in examples(argv):
            print(f"example: {line}")
        return code
    try:
        return _run_parsed(with_json_file(argv))
    except ModuleNotFoundError as error:
        package = str(error.name).split(".")[0]
        if package not in EXTRA_OF_PACKAGE:
            raise
        command = install_command(EXTRA_OF_PACKAGE[package])
        raise FinlabError(f"{package} is not installed; run: {command}") from None


def _run_parsed(argv: list[str]) -> int:
    """Parses arguments and runs the verb; turns the parser's exit into a code."""
    try:
        code: int | None = _run_verb(argv)
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else EXIT_ERROR
    return code or 0


VERBS = {
    "allocate": "finlab.cli.robot_verbs:allocate",
    "layout check": "finlab.cli.layout_verbs:check",
    "layout show": "finlab.cli.layout_verbs:show",
    "layout capability": "finlab.cli.layout_verbs:capability",
    "layout prove": "finlab.cli.prove_verb:prove_layout",
    "layout convert": "finlab.cli.layout_verbs:convert_layout",
    "layout optimize": "finlab.cli.layout_verbs:optimize",
    "data generate": "finlab.cli.train_verbs:generate",
    "data interaction": "finlab.cli.train_verbs:interaction_data",
    "train mdn": "finlab.cli.train_verbs:mdn",
    "train surrogate": "finlab.cli.train_verbs:surrogate",
    "train allocator": "finlab.cli.train_verbs:allocator",
    "train interaction": "finlab.cli.train_verbs:interaction",
    "train policy": "finlab.cli.train_verbs:policy",
    "eval": "finlab.cli.eval_verbs:verbs",
    "bench": "finlab.cli.eval_verbs:bench",
    "fit fin": "finlab.cli.fit:fin",
    "fit thruster": "finlab.cli.fit:thruster",
    "fit actuator": "finlab.cli.fit:thruster",
    "fit interaction": "finlab.cli.fit:interaction",
    "fit robot": "finlab.cli.fit_robot:robot",
    "log": "finlab.cli.log_verb:log",
    "simulate": "finlab.cli.simulate:simulate",
    "export": "finlab.cli.robot_verbs:export",
    "app": "finlab.cli.app_verb:app",
}
"""Functions of the verbs by name, as `module:function`; only the one that runs is imported. `eval`
makes its verbs from the registered experiments."""
GROUPS = {
    "layout": "Check, show, optimize layout files, and prove what they can.",
    "data": "Generate what the paper's networks learn from.",
    "train": "Train the networks of methods `mdn` and `paper`.",
    "eval": "Measure methods by the fins' own models.",
    "fit": "Fit actuators and robots to measurements.",
}
"""First words of several verbs, and the line of help of each."""
ALIASES = {"fit actuator": "The same as `fit thruster`, by its earlier name."}
"""Verbs that are others by a further name, and the line of help of each."""


def _run_verb(argv: list[str]) -> Any:
    """Runs the verb that arguments name, which alone is imported; returns its exit code, None for
    0."""
    name = argv[0] if argv else ""
    if name in VERBS or name in GROUPS:
        verb = _verb(name, argv)
        run = verb.cli if isinstance(verb, SubcommandApp) else partial(tyro.cli, verb)
        return run(prog=f"finlab {name}", description=GROUPS.get(name), args=argv[1:])
    summary = "Control allocation for underwater robots: a target wrench in, commands out."
    return _command_line(argv).cli(prog="finlab", description=summary, args=argv)


def _command_line(argv: Sequence[str]) -> SubcommandApp:
    """All verbs."""
    root = SubcommandApp()
    for name in dict.fromkeys(verb.split()[0] for verb in VERBS):
        root.command(_verb(name, argv), name=name, help=GROUPS.get(name))
    return root


def _verb(name: str, argv: Sequence[str]) -> Any:
    """A verb's function, or the group of verbs that begin with a word."""
    if name == "eval":
        return resolve_name(VERBS[name])(argv)
    if name in VERBS:
        return resolve_name(VERBS[name])
    group = SubcommandApp()
    for verb, home in VERBS.items():
        group_name, _, verb_name = verb.partition(" ")
        if group_name == name:
            group.command(resolve_name(home), name=verb_name, help=ALIASES.get(verb))
    return group


def examples(argv: Sequence[str]) -> tuple[str, ...]:
    """Examples of the verb that arguments begin with.

    Args:
        argv: the arguments after the program's name.

    Returns:
        Lines for a shell, at least one; of a group's verb that has none of its own, those of the
        group.
    """
    words = [word for word in argv if not word.startswith("-")]
    if words[:1] == ["eval"] and len(words) > 1 and " ".join(words[:2]) not in EXAMPLES:
        from finlab.cli.eval_verbs import examples_of

        return examples_of(words[1])
    for count in range(len(words), -1, -1):
        verb = " ".join(words[:count])
        if verb in EXAMPLES:
            return EXAMPLES[verb]
    return EXAMPLES[""]
