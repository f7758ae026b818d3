"""`finlab layout optimize`: move chosen actuators until a goal is as good as it gets. Never loads torch."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.json_file import check_json_file

if TYPE_CHECKING:
    from finlab.analysis import Improvement

Wrench = tuple[float, float, float, float, float, float]
Flow = tuple[float, float, float, float, float, float]


def optimize(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    actuators: Annotated[tuple[str, ...], arg(metavar="NAME...", aliases=["--fins"])],
    output: Annotated[Path, arg(metavar="FILE.yaml", aliases=["-o"])],
    goal: Annotated[str, arg(metavar="NAME")] = "weakest_direction",
    reach: Annotated[float, arg(metavar="M")] = 0.05,
    turn: Annotated[float, arg(metavar="DEG")] = 90.0,
    mirror: bool = True,
    axes: Annotated[tuple[str, ...], arg(metavar="AXIS...")] = (),
    flow: Annotated[Flow | None, arg(metavar="VX VY VZ WX WY WZ")] = None,
    wrench: Annotated[UseAppendAction[tuple[Wrench, ...]], arg(metavar="FX FY FZ TX TY TZ")] = (),
    rounds: Annotated[int, arg(metavar="N")] = 40,
    seed: Annotated[int, arg(metavar="N")] = 0,
) -> None:
    """Move actuators within bounds to raise a goal, and write the layout that results.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        actuators: those that may move; mirrored twins follow.
        output: layout file to write.
        goal: weakest_direction, mission_power or worst_single_failure.
        reach: how far each may go from where it is, either way along x, y and z [m].
        turn: how far each may turn about the vertical, either way [deg]; all but fins with a mounting angle
            also tilt.
        mirror: keep actuators that are each other's mirror image so.
        axes: surge, sway, heave, roll, pitch, yaw: those whose directions count; all that there are actuators
            enough for by default.
        flow: velocity of the robot relative to the water, body frame [m/s, rad/s]; it is at rest by default.
        wrench: a wrench of the mission for mission_power [N, N m]; may be given several times.
        rounds: most rounds of the search.
        seed: same arguments and seed, same layout.
    """
    from tqdm import tqdm

    from finlab.analysis import Bounds, Progress, optimize_layout
    from finlab.analysis.goals import MISSION
    from finlab.cli.inputs import check_positive, open_robot
    from finlab.errors import FinlabError
    from finlab.layout import save_layout

    check_json_file(output, "output")
    check_positive(rounds=rounds)
    robot = open_robot(layout)[0]
    if not (0.0 <= reach < math.inf and 0.0 <= turn <= 180.0):
        raise FinlabError(
            f"expected --reach from 0 m and --turn from 0 to 180 degrees, got {reach:g}, {turn:g}"
        )
    parts = [robot.actuators[i] for i in robot.indices(actuators)]
    space = {part.name: Bounds.around(part, reach, math.radians(turn)) for part in parts}
    bar = tqdm(total=rounds, desc=goal, unit="round", disable=None, leave=False, file=sys.stderr)

    def report(progress: Progress) -> None:
        bar.update()
        bar.set_postfix_str(f"{progress.before:.4g} -> {progress.best:.4g}")

    with bar:
        found = optimize_layout(
            robot,
            actuators,
            space,
            goal,
            None if mirror else (),
            mission=wrench or MISSION,
            rounds=rounds,
            seed=seed,
            axes=axes or None,
            flow=flow,
            progress=report,
        )
    save_layout(found.layout, output)
    print(improvement_text(found, output))


def improvement_text(found: Improvement, output: Path) -> str:
    """Where the actuators went, the card after it, and where the layout was written."""
    from finlab.cli.layout_table import direction_text
    from finlab.cli.score_card import score_card_text

    lines = [f"{found.goal}: {found.value_before:.4g} -> {found.value_after:.4g}", ""]
    for name in found.moved:
        part = found.layout.actuators[found.layout.index(name)]
        place = "  ".join(f"{value:6.3f}" for value in part.position)
        lines.append(f"{name:<16}  {place} m  {direction_text(part)}")
    lines += ["", score_card_text(found.card_after), ""]
    lines.append(
        f"{output}: written." if found.improved else f"{output}: written unchanged, nothing better was found."
    )
    return "\n".join(lines)
