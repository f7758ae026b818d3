"""`finlab layout optimize`: move chosen fins until a goal is as good as it gets. Never loads torch."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.json_file import JsonFile, check_json_file, put_json

if TYPE_CHECKING:
    from finlab.analysis import Improvement

Wrench = tuple[float, float, float, float, float, float]


def optimize(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    fins: Annotated[tuple[str, ...], arg(metavar="NAME...")],
    output: Annotated[Path, arg(metavar="FILE.yaml", aliases=["-o"])],
    goal: Annotated[str, arg(metavar="NAME")] = "weakest_direction",
    reach: Annotated[float, arg(metavar="M")] = 0.05,
    turn: Annotated[float, arg(metavar="DEG")] = 90.0,
    mirror: bool = True,
    wrench: Annotated[UseAppendAction[tuple[Wrench, ...]], arg(metavar="FX FY FZ TX TY TZ")] = (),
    rounds: Annotated[int, arg(metavar="N")] = 40,
    seed: Annotated[int, arg(metavar="N")] = 0,
    json: JsonFile = None,
) -> None:
    """Move fins within bounds to raise a goal, and write the layout that results.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        fins: fins that may move; mirrored twins follow.
        output: layout file to write.
        goal: weakest_direction, mission_power or worst_single_failure.
        reach: how far each fin may go from where it is, either way along x, y and z [m].
        turn: how far each shaft may turn from where it points, either way [deg].
        mirror: keep fins that are each other's mirror image so.
        wrench: a wrench of the mission for mission_power [N, N m]; may be given several times.
        rounds: most rounds of the search.
        seed: same arguments and seed, same layout.
        json: file for one JSON object; it is printed in place of the table where no file is named.
    """
    from tqdm import tqdm

    from finlab.analysis import Bounds, Progress, optimize_layout
    from finlab.analysis.goals import MISSION
    from finlab.cli.inputs import check_positive, open_robot
    from finlab.errors import FinlabError
    from finlab.layout import save_layout

    check_json_file(json)
    check_json_file(output, "output")
    check_positive(rounds=rounds)
    robot = open_robot(layout, fins_for="layout optimize").layout
    if not (0.0 <= reach < math.inf and 0.0 <= turn <= 180.0):
        raise FinlabError(
            f"expected --reach from 0 m and --turn from 0 to 180 degrees, got {reach:g}, {turn:g}"
        )
    space = {name: Bounds.around(robot.fins[robot.index(name)], reach, math.radians(turn)) for name in fins}
    bar = tqdm(total=rounds, desc=goal, unit="round", disable=None, leave=False, file=sys.stderr)

    def report(progress: Progress) -> None:
        bar.update()
        bar.set_postfix_str(f"{progress.before:.4g} -> {progress.best:.4g}")

    with bar:
        found = optimize_layout(
            robot,
            fins,
            space,
            goal,
            None if mirror else (),
            mission=wrench or MISSION,
            rounds=rounds,
            seed=seed,
            progress=report,
        )
    save_layout(found.layout, output)
    put_json(improvement_record(found), json, improvement_text(found, output))


def improvement_record(found: Improvement) -> dict[str, object]:
    """The JSON object of `finlab layout optimize --json`."""
    from finlab.layout import layout_to_dict

    return {
        "goal": found.goal,
        "improved": found.improved,
        "value_before": found.value_before,
        "value_after": found.value_after,
        "moved": list(found.moved),
        "before": found.card_before.to_dict(),
        "after": found.card_after.to_dict(),
        "layout": layout_to_dict(found.layout),
    }


def improvement_text(found: Improvement, output: Path) -> str:
    """Where the fins went, the card after it, and where the layout was written."""
    from finlab.cli.score_card import score_card_text

    lines = [f"{found.goal}: {found.value_before:.4g} -> {found.value_after:.4g}", ""]
    for name in found.moved:
        fin = found.layout.fins[found.layout.index(name)]
        place = "  ".join(f"{value:6.3f}" for value in fin.position)
        lines.append(f"{name:<16}  {place} m  {math.degrees(fin.shaft_azimuth):7.1f} deg")
    lines += ["", score_card_text(found.card_after), ""]
    lines.append(
        f"{output}: written." if found.improved else f"{output}: written unchanged, nothing better was found."
    )
    return "\n".join(lines)
