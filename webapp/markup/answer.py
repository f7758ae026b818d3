"""Markup of an answer: six bars of the wrench desired and delivered, and the table of commands with
one row per fin."""

import math
from functools import cache

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import WHOLE, Damage
from webapp.markup.words import damage_words, html, saturated
from webapp.session.state import AXIS_WORDS
from webapp.theme import DEAD, css, fin_color, ink

HEADER = Markup(
    "<tr><th>{}</th><th title='half amplitude'>A [°]</th><th title='frequency'>f [Hz]</th>"
    "<th title='zero direction'>dir. [°]</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)
BARS_HEADER = Markup(
    "<span class='dim scale'>{}</span><b class='right asked'>asked</b><b class='right "
    "given'>delivered</b>"
    "<b class='right missing'>missing</b>"
)
MIDDLE = "<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>"
"""Where nothing is asked, in the track of bars."""
LEAST_FORCE_SCALE = 2.0
"""Least force at the end of a bar [N]."""
LEAST_TORQUE_SCALE = 0.5
"""Least torque at the end of a bar [N m]."""
PLAIN_HEADER = Markup(
    "<tr><th>{}</th><th colspan='3'>actuator</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)


def bars_of(shown: Allocation | None, target: tuple[float, ...], layout: Layout, busy: bool) -> str:
    """The bars of an answer; one to an earlier question stands beside what was asked then."""
    demanded = (
        shown.target if shown is not None and busy else np.where(layout.commanded, target, np.nan)
    )
    return wrench_bars(demanded, None if shown is None else shown.wrench)


def wrench_bars(demanded: ArrayLike, got: ArrayLike | None) -> str:
    """The bars of all six axes: wrenches (6,) [N, N m], demanded (NaN where free) and got, if
    anything."""
    demanded = np.asarray(demanded, dtype=float)
    got = None if got is None else np.asarray(got, dtype=float)
    wanted = np.nan_to_num(demanded)
    values = np.array([wanted, wanted if got is None else got])
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse
    # steps only.
    force_scale = max(nice_limit(np.abs(values[:, :3]).max()), LEAST_FORCE_SCALE)
    torque_scale = max(nice_limit(np.abs(values[:, 3:]).max()), LEAST_TORQUE_SCALE)
    rows = []
    for k in range(6):
        wish = None if np.isnan(demanded[k]) else float(demanded[k])
        scale = force_scale if k < 3 else torque_scale
        rows.append(_bar_row(k, wish, None if got is None else float(got[k]), scale))
    header = BARS_HEADER.format(f"±{force_scale:g} N, ±{torque_scale:g} N m")
    return html("<div class='fl'><div class='bars'>{}{}</div></div>", header, Markup("".join(rows)))


def nice_limit(value: float) -> float:
    """The next of 1, 2, 5, 10, ... above 1.2 times `value`: a scale's end."""
    if value < 1e-6:
        return 1.0
    power = 10.0 ** math.floor(math.log10(1.2 * value))
    share = 1.2 * value / power
    return power * (1.0 if share <= 1.0 else 2.0 if share <= 2.0 else 5.0 if share <= 5.0 else 10.0)


def _bar_row(axis: int, wish: float | None, got: float | None, scale: float) -> str:
    """Name, bars and figures of one axis, of which nothing is wished where it is free."""
    digits = 2 if axis < 3 else 3
    rest = None if wish is None or got is None else wish - got
    bars = [] if wish is None else [(0.0, wish, 1, "asked")]
    if got is not None:
        bars.append((0.0, got, 8, "delivered"))
    if wish is not None and got is not None and abs(wish - got) > 0.02 * scale:
        bars.append((got, wish, 8, "missing"))
    parts = [
        f"<span>{AXIS_WORDS[axis]} <span class='dim'>{AXES[axis]}</span></span><div "
        f"class='track'>{MIDDLE}"
    ]
    for start, end, top, word in bars:
        low, high = sorted((min(max(start / scale, -1.0), 1.0), min(max(end / scale, -1.0), 1.0)))
        place = f"left:{50 + 50 * low:.2f}%;width:{50 * (high - low):.2f}%;top:{top}px;height:5px"
        parts.append(f"<i style='{place};background:var(--fl-{word})'></i>")
    parts.append("</div>")
    for kind, value, none in (("asked", wish, "free"), ("given", got, "–"), ("missing", rest, "–")):
        rounded = 0.0 if value is None else round(value, digits)
        text = f"{rounded:+.{digits}f}".replace("-", "−") if rounded else f"{0:.{digits}f}"
        style = "dim" if kind == "missing" and not rounded else kind
        parts.append(f"<span class='right {style}'>{none if value is None else text}</span>")
    return "".join(parts)


@cache
def swatch(index: int, is_lost: bool = False) -> str:
    """The fin's number on its colour."""
    color = DEAD if is_lost else fin_color(index)
    return html(
        "<span class='swatch' style='background:{};color:{}'>{}</span>",
        css(color),
        ink(color),
        index + 1,
    )


def fin_table(
    layout: Layout, damage: Damage, allocation: Allocation | None, full: Array, selected: str | None
) -> str:
    """All fins with their commands; `full` is the full thrust (n,) of each [N]."""
    limits = None if allocation is None else saturated(allocation)
    is_damaged = damage != WHOLE
    rows = []
    for i, fin in enumerate(layout.actuators):
        is_lost = allocation is not None and not np.isfinite(allocation.command[i, 0])
        kind = " ".join(["dead"] * is_lost + ["chosen"] * (fin.name == selected))
        words = (
            damage_words(damage, fin.name, fin.KIND.sticks_at_angle)
            if is_damaged and not is_lost
            else ""
        )
        remark = html("<div class='missing damage'>{}</div>", words) if words else ""
        if allocation is None or limits is None:
            cells: str = Markup("<td>–</td>") * 5
        elif is_lost:
            cells = Markup("<td colspan='5'>lost</td>")
        else:
            force = float(np.linalg.norm(allocation.forces[i]))
            cells = _cells(fin, allocation.command[i], limits[i], force, full[i], i)
        row = "<tr class='{}'><td>{}<span class='name' title='{}'>{}</span>{}</td>{}</tr>"
        rows.append(html(row, kind, swatch(i, is_lost), fin.name, fin.name, remark, cells))
    header = html(HEADER if layout.fins else PLAIN_HEADER, "fin" if layout.is_of_fins else "")
    return html("<div class='fl'><table class='fins'>{}{}</table></div>", header, rows)


def _cells(
    part: Actuator, command: Array, limits: NDArray[np.bool_], force: float, full: float, index: int
) -> str:
    amplitude, frequency, direction = command.tolist()
    share = min(force / max(full, 1e-9), 1.0)
    bar = f"width:{100 * share:.0f}%;background:{css(fin_color(index))}"
    meter = Markup(f"<span class='meter'><i style='{bar}'></i></span>")
    if not isinstance(part, Fin):
        along = force if part.KIND.sticks_at_angle else command[0]
        angle = (
            round(math.degrees(command[part.KIND.stuck_number])) if part.KIND.sticks_at_angle else 0
        )
        remark = (
            f"{part.type}, {angle:+d}°".replace("-", "−")
            if part.KIND.sticks_at_angle
            else part.type
        )
        words = html("<td colspan='3' class='words'>{}</td>", remark)
        cell = html(
            "<td class='{}'>{}</td>",
            "full" if limits.any() else "",
            f"{round(along, 2) + 0.0:.2f}".replace("-", "−"),
        )
        return html("{}{}<td>{}</td>", words, cell, meter)
    first, second = np.where(limits, "full", "").tolist()
    angles = (
        f"<td class='{first}'>{math.degrees(amplitude):.1f}</td><td "
        f"class='{second}'>{frequency:.2f}</td>"
    )
    turn = f"{round(math.degrees(direction)):+d}".replace("-", "−")
    return Markup(f"{angles}<td>{turn}</td><td>{force:.2f}</td><td>{meter}</td>")
