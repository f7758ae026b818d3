"""`finlab layout check|show|optimize|import|export`: look at layout files, improve and exchange them.

Torch is loaded only where a fin follows a table of forces.
"""

from __future__ import annotations

import json as json_format
import math
import sys
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg
from tyro.extras import SubcommandApp

from finlab.cli.exchange import export_layout, import_layout
from finlab.cli.optimize import optimize

if TYPE_CHECKING:
    from finlab.layout import Layout

verbs = SubcommandApp()
verbs.command(optimize)
verbs.command(name="import")(import_layout)
verbs.command(name="export")(export_layout)


@verbs.command
def check(layouts: Annotated[Positional[tuple[str, ...]], arg(metavar="LAYOUT...")]) -> int:
    """Say of each layout file whether it is valid, and if not, which key is wrong and why.

    Args:
        layouts: files or names of shipped layouts.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import FinlabError

    if not layouts:
        raise FinlabError("layout check: expected at least one file or name of a shipped layout, got none")
    n_bad = 0
    for text in layouts:
        try:
            layout = open_robot(text).layout
        except FinlabError as error:
            print(f"finlab: error: {error}", file=sys.stderr)
            n_bad += 1
        else:
            print(f"{text}: ok, layout {layout.name} with {layout.n_fins} fins")
    return 2 if n_bad else 0


@verbs.command
def show(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    json: bool = False,
) -> None:
    """Print the fins of a layout and its score card: what it can do, what that costs, what it can lose.

    Args:
        layout: layout file, layout graph file, or the name of a shipped layout.
        failed: name of a fin that does not work.
        json: print one JSON object instead of tables.
    """
    from finlab.analysis import score_card
    from finlab.cli.inputs import open_robot
    from finlab.cli.score_card import score_card_text

    robot = open_robot(layout)
    card = score_card(robot.layout, robot.with_failed(failed))
    if json:
        print(json_format.dumps(card.to_dict(), allow_nan=False))
    else:
        print(layout_text(robot.layout), score_card_text(card), sep="\n\n")


def layout_text(layout: Layout) -> str:
    """A layout in words and a table: what it is, and its fins."""
    width = max(len("fin"), *(len(name) for name in layout.names))
    lines = [f"{layout.name}: {layout.description}" if layout.description else layout.name, ""]
    lines.append(
        f"{'fin':<{width}}   x [m]   y [m]   z [m]  angle [deg]  A max [rad]  f max [Hz]"
        "  directions [deg]  model"
    )
    for fin in layout.fins:
        low, high = (math.degrees(angle) for angle in fin.limits.zero_direction)
        directions = "any" if high - low >= 360.0 - 1e-6 else f"{low:.0f}..{high:.0f}"
        position = "  ".join(f"{value:6.3f}" for value in fin.position)
        lines.append(
            f"{fin.name:<{width}}  {position}  {math.degrees(fin.mounting_angle):11.1f}"
            f"  {fin.limits.amplitude[1]:11.3f}  {fin.limits.frequency[1]:10.3f}  {directions:>16}"
            f"  {fin.model.type}"
        )
    return "\n".join(lines)
