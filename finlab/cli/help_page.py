"""`--help` of every verb: plain characters, with an example at its end."""

import io
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout

EXAMPLES = {
    "": "finlab allocate A --wrench 1 0 0.5 0 0 0.1",
    "allocate": "finlab allocate A --wrench 1 0 0.5 0 0 0.1 --failed front_right --json",
    "layout": "finlab layout show A",
    "layout check": "finlab layout check my_robot.yaml",
    "layout show": "finlab layout show A --failed front_right",
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
    "simulate": "finlab simulate A --duration 30 -o swim",
    "export": "finlab export A -o my_robot",
    "app": "finlab app --layout A --port 8080",
}
"""An example for each verb, and for each group of them."""


def asks_for_help(argv: Sequence[str]) -> bool:
    """Whether arguments ask for a page of help, or are too few for anything else."""
    return "--help" in argv or "-h" in argv


def help_page(argv: Sequence[str], write: Callable[[], int]) -> tuple[int, str]:
    """The page that `write` prints for arguments, with its example; before it the exit code."""
    caught = io.StringIO()
    with redirect_stdout(caught):  # what is no terminal gets no boxes
        code = write()
    return code, f"{caught.getvalue().rstrip().replace('•', '-')}\n\nexample: {example(argv)}"


def example(argv: Sequence[str]) -> str:
    """The example of the verb that arguments begin with."""
    words = [word for word in argv if not word.startswith("-")]
    if words[:1] == ["eval"] and len(words) > 1 and " ".join(words[:2]) not in EXAMPLES:
        return f"finlab eval {words[1]} --json rows.json"
    names = (" ".join(words[:count]) for count in range(len(words), -1, -1))
    return next(EXAMPLES[name] for name in names if name in EXAMPLES)
