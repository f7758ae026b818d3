"""`finlab layout check|show`: look at layout files. Loads numpy, never torch."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg
from tyro.extras import SubcommandApp

if TYPE_CHECKING:
    from finlab.layout import Layout

verbs = SubcommandApp()

_AXES = {"Fx": "surge", "Fy": "sway", "Fz": "heave", "Tx": "roll", "Ty": "pitch", "Tz": "yaw"}


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
def show(layout: Annotated[Positional[str], arg(metavar="LAYOUT")]) -> None:
    """Print the fins of a layout, the rank of their forces, and the axes out of their reach.

    Args:
        layout: file or name of a shipped layout.
    """
    from finlab.cli.inputs import open_robot

    print(layout_text(open_robot(layout).layout))


def layout_text(layout: Layout) -> str:
    """A layout in words and a table: what it is, its fins, what they can push."""
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
    return "\n".join([*lines, "", *authority_text(layout)])


def authority_text(layout: Layout) -> list[str]:
    """Which axes the fins push at all, and which they push alone, before any limit."""
    import numpy as np

    from finlab.layout.arrays import layout_effectiveness

    effectiveness = layout_effectiveness(layout)
    rank = int(np.linalg.matrix_rank(effectiveness, tol=1e-9))
    # Onto the span of what the fins can give: an axis that the span holds whole can be pushed alone.
    projector = effectiveness @ np.linalg.pinv(effectiveness, rcond=1e-9)
    pushed = np.abs(effectiveness).max(axis=1) > 1e-9
    alone = np.abs(projector - np.eye(6)).max(axis=0) < 1e-6
    names = list(_AXES.values())
    lines = [f"{layout.n_fins} fins push in {rank} of 6 independent directions."]
    missing = [n for n, p in zip(names, pushed, strict=True) if not p]
    if missing:
        lines.append("Out of reach: " + ", ".join(missing) + ".")
    coupled = [n for n, p, a in zip(names, pushed, alone, strict=True) if p and not a]
    if coupled:
        lines.append("Only together with other axes: " + ", ".join(coupled) + ".")
    return lines
