"""What is asked and delivered: six bars, and the table of commands with one row per fin."""

import math
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.policy import AXES
from finlab.arrays import Array
from webapp.markup.words import damage_words, saturated
from webapp.session.state import AXIS_WORDS, State
from webapp.session.targets import nice_limit
from webapp.theme import DEAD, css, fin_color, ink

HEADER = (
    "<tr><th>fin</th><th title='half amplitude'>A [°]</th><th title='frequency'>f [Hz]</th>"
    "<th title='zero direction'>dir. [°]</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)


def wrench_bars(asked: ArrayLike, given: ArrayLike | None, sentence: str) -> str:
    """The bars of all six axes.

    Args:
        asked: target wrench (6,) [N, N m].
        given: delivered wrench (6,), None while there is none.
        sentence: what is left undone, in words.
    """
    asked = np.asarray(asked, dtype=float)
    given = None if given is None else np.asarray(given, dtype=float)
    values = np.array([asked, asked if given is None else given])
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse steps only.
    scales = [
        max(nice_limit(np.abs(values[:, part]).max()), least)
        for part, least in ((slice(0, 3), 2), (slice(3, 6), 0.5))
    ]
    rows = [_header(scales)]
    for k in range(6):
        scale = scales[k // 3]
        rows.append(f"<span>{AXIS_WORDS[k]} <span class='dim'>{AXES[k]}</span></span>")
        rows.append(_track(asked[k] / scale, None if given is None else given[k] / scale))
        rows.append(f"<span class='right asked'>{_value(asked[k], k)}</span>")
        rows.append(f"<span class='right given'>{'–' if given is None else _value(given[k], k)}</span>")
        rest = None if given is None else _value(asked[k] - given[k], k)
        kind = "missing" if rest is not None and float(rest.replace("−", "-")) else "dim"
        rows.append(f"<span class='right {kind}'>{'–' if rest is None else rest}</span>")
    return f"<div class='fl'><div class='bars'>{''.join(rows)}</div><div class='said'>{sentence}</div></div>"


def _header(scales: list[float]) -> str:
    scale = f"±{scales[0]:g} N, ±{scales[1]:g} N m"
    return (
        f"<span class='dim scale'>{scale}</span>"
        "<b class='right asked'>asked</b><b class='right given'>delivered</b>"
        "<b class='right missing'>missing</b>"
    )


def _value(value: float, axis: int) -> str:
    digits = 2 if axis < 3 else 3
    rounded = round(value, digits)
    return f"{rounded:+.{digits}f}".replace("-", "−") if rounded else f"{0:.{digits}f}"


def _track(asked: float, given: float | None) -> str:
    parts = ["<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>"]
    parts.append(_bar(0.0, asked, 1, 5, "var(--fl-asked)"))
    if given is not None:
        parts.append(_bar(0.0, given, 8, 5, "var(--fl-delivered)"))
        if abs(asked - given) > 0.02:
            parts.append(_bar(given, asked, 8, 5, "var(--fl-missing)"))
    return f"<div class='track'>{''.join(parts)}</div>"


def _bar(start: float, end: float, top: int, height: int, color: str) -> str:
    low, high = sorted((float(np.clip(start, -1, 1)), float(np.clip(end, -1, 1))))
    return (
        f"<i style='left:{50 + 50 * low:.2f}%;width:{50 * (high - low):.2f}%;"
        f"top:{top}px;height:{height}px;background:{color}'></i>"
    )


def swatch(index: int, failed: bool = False) -> str:
    """The fin's number on its colour."""
    color = DEAD if failed else fin_color(index)
    return f"<span class='swatch' style='background:{css(color)};color:{ink(color)}'>{index + 1}</span>"


def fin_table(state: State, allocation: Allocation | None, full: Array, selected: str | None) -> str:
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


def _cells(command: Array, limits: NDArray[np.bool_], force: float, full: float, index: int) -> str:
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
