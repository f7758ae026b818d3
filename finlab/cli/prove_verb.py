"""`finlab layout prove`: proves or refutes that a robot can give any wrench of a box."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from finlab.cli import shared_options
from finlab.errors import CommandError

if TYPE_CHECKING:
    from finlab.analysis.prove import Verdict

EXIT_CODES: dict[Verdict, int] = {"proved": 0, "refuted": 1, "not settled": 3}
"""What the command exits with; 2 is that of errors."""


def prove_layout(
    layout: shared_options.Robot,
    box: Annotated[shared_options.Wrench | None, arg(metavar="FX FY FZ TX TY TZ")] = None,
    box_share: Annotated[float | None, arg(metavar="SHARE")] = None,
    lost: Annotated[int, arg(metavar="K")] = 1,
    power: Annotated[float | None, arg(metavar="W")] = None,
    free: shared_options.Free = (),
    output: Annotated[Path | None, arg(metavar="FILE", aliases=["-o"])] = None,
    json: shared_options.JsonFile = None,
) -> int:
    """Prove or refute that a robot gives any wrench of a box whichever actuators it loses, in exact
    fractions.

    The proof is a file that a checker of a few hundred lines of plain Python reads; the command
    prints how to run it. Exit code 0: proved, 1: refuted, 3: not settled.

    Args:
        box: half widths of the box [N, N m]; 0 holds an axis at zero.
        box_share: in place of a box, a share of what each axis can alone with everything working.
        lost: how many actuators may be lost at once; fewer are covered, too.
        power: most power of the whole robot [W].
        free: an axis that may take any wrench, such as Ty.
        output: file for the proof, or the counterexample.
    """
    from finlab.analysis import check_proof
    from finlab.analysis import prove as proofs

    shared_options.check_json_file(json)
    shared_options.check_json_file(output, "output")
    robot, gone = shared_options.open_robot(layout)
    if gone:
        robot = robot.without(gone)
    if (box is None) == (box_share is None):
        raise CommandError("expected either --box with six half widths, or --box-share")
    if box_share is not None and not 0.0 < box_share <= 1.0:
        raise CommandError(f"box-share: expected a share above 0, at most 1, got {box_share:g}")
    half_widths: tuple[float, ...] = box or ()
    if box_share is not None:
        half_widths = proofs.box_share(robot, box_share, free)
    shared_options.tell(f"proving {robot.name}")
    result = proofs.prove(robot, half_widths, lost, power, free)
    words = str(result)
    if output is not None and result.proof is not None:
        shared_options.put_json(result.proof, output)
        words += f"\n{output}: check it with: python {check_proof.__file__} {output}"
    shared_options.put_json(result.to_dict(), json, words)
    if result.verdict == "not settled":
        print(f"finlab: not settled: {result.reason}", file=sys.stderr)
    return EXIT_CODES[result.verdict]
