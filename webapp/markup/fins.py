"""The table of commands: one row per fin."""

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from webapp.markup.words import damage_words, saturated
from webapp.session.state import State
from webapp.theme import DEAD, css, fin_color

HEADER = (
    "<tr><th>fin</th><th title='half amplitude'>A [°]</th><th title='frequency'>f [Hz]</th>"
    "<th title='zero direction'>direction [°]</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)


def swatch(index: int, failed: bool = False) -> str:
    """The fin's number on its colour."""
    color = css(DEAD if failed else fin_color(index))
    return f"<span class='swatch' style='background:{color}'>{index + 1}</span>"


def fin_table(
    state: State, allocation: Allocation | None, full: NDArray[np.float64], selected: str | None
) -> str:
    """All fins with their commands.

    Args:
        state: the robot and its damage.
        allocation: the answer for it, None while there is none.
        full: full thrust (n,) of each fin [N].
        selected: name of the selected fin.
    """
    limits = None if allocation is None else saturated(allocation)
    rows = []
    for i, fin in enumerate(state.layout.fins):
        failed = allocation is not None and not np.isfinite(allocation.command[i, 0])
        kind = " ".join(["dead"] * failed + ["chosen"] * (fin.name == selected))
        first = f"{swatch(i, failed)}<span class='name' title='{escape(fin.name)}'>{escape(fin.name)}</span>"
        if not failed and (told := damage_words(state, fin.name)):
            first += f"<div class='missing damage'>{told}</div>"
        if allocation is None or limits is None:
            cells = "<td>–</td>" * 5
        elif failed:
            cells = "<td colspan='5'>failed</td>"
        else:
            force = float(np.linalg.norm(allocation.fin_forces[i]))
            cells = _cells(allocation.command[i], limits[i], force, full[i], i)
        rows.append(f"<tr class='{kind}'><td>{first}</td>{cells}</tr>")
    return f"<div class='fl'><table class='fins'>{HEADER}{''.join(rows)}</table></div>"


def _cells(
    command: NDArray[np.float64], limits: NDArray[np.bool_], force: float, full: float, index: int
) -> str:
    amplitude, frequency, direction = command
    degrees = f"{round(math.degrees(direction)):+d}".replace("-", "−")
    share = min(force / max(full, 1e-9), 1.0)
    bar = f"width:{100 * share:.0f}%;background:{css(fin_color(index))}"
    meter = f"<span class='meter'><i style='{bar}'></i></span>"
    return (
        f"<td class='{'full' if limits[0] else ''}'>{math.degrees(amplitude):.1f}</td>"
        f"<td class='{'full' if limits[1] else ''}'>{frequency:.2f}</td>"
        f"<td>{_dial(direction)} {degrees}</td><td>{force:.2f}</td><td>{meter}</td>"
    )


def _dial(direction: float) -> str:
    """A small circle with a hand; right is the fin's horizontal thrust axis, up is up."""
    x, y = 7 + 5.5 * math.cos(direction), 7 - 5.5 * math.sin(direction)
    return (
        "<svg width='14' height='14' style='vertical-align:-3px'><circle cx='7' cy='7' r='6' fill='none' "
        "stroke='currentColor' stroke-opacity='.35'/>"
        f"<line x1='7' y1='7' x2='{x:.1f}' y2='{y:.1f}' stroke='currentColor' stroke-width='1.6'/></svg>"
    )
