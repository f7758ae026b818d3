"""What is asked and delivered: six bars, and the table of commands with one row per fin."""

import math

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.policy import AXES
from finlab.arrays import Array
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import Damage
from webapp.markup.words import damage_words, html, saturated
from webapp.session.state import AXIS_WORDS
from webapp.session.targets import nice_limit
from webapp.theme import DEAD, css, fin_color, ink

HEADER = Markup(
    "<tr><th>{}</th><th title='half amplitude'>A [°]</th><th title='frequency'>f [Hz]</th>"
    "<th title='zero direction'>dir. [°]</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)
PLAIN_HEADER = Markup(
    "<tr><th>{}</th><th colspan='3'>actuator</th><th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)


def wrench_bars(demanded: ArrayLike, got: ArrayLike | None) -> str:
    """The bars of all six axes: wrenches (6,) [N, N m], demanded (NaN where free) and got, if anything."""
    demanded = np.asarray(demanded, dtype=float)
    got = None if got is None else np.asarray(got, dtype=float)
    wanted = np.nan_to_num(demanded)
    values = np.array([wanted, wanted if got is None else got])
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse steps only.
    scales = [
        max(nice_limit(np.abs(values[:, part]).max()), least)
        for part, least in ((slice(0, 3), 2), (slice(3, 6), 0.5))
    ]
    rows = [html("<span class='dim scale'>±{:g} N, ±{:g} N m</span>", *scales)]
    words = (("asked", "asked"), ("given", "delivered"), ("missing", "missing"))
    rows += [html("<b class='right {}'>{}</b>", *word) for word in words]
    for k in range(6):
        scale = scales[k // 3]
        rows.append(html("<span>{} <span class='dim'>{}</span></span>", AXIS_WORDS[k], AXES[k]))
        free = np.isnan(demanded[k])
        rows.append(_track(None if free else demanded[k] / scale, None if got is None else got[k] / scale))
        rest = None if got is None or free else _value(demanded[k] - got[k], k)
        kind = "missing" if rest is not None and float(rest.replace("−", "-")) else "dim"
        delivered = "–" if got is None else _value(got[k], k)
        wish = "free" if free else _value(demanded[k], k)
        cells = (("asked", wish), ("given", delivered), (kind, rest or "–"))
        rows += [html("<span class='right {}'>{}</span>", *cell) for cell in cells]
    return html("<div class='fl'><div class='bars'>{}</div></div>", rows)


def _value(value: float, axis: int) -> str:
    digits = 2 if axis < 3 else 3
    rounded = round(value, digits)
    return f"{rounded:+.{digits}f}".replace("-", "−") if rounded else f"{0:.{digits}f}"


def _track(demanded: float | None, got: float | None) -> str:
    parts: list[str] = [
        Markup("<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>")
    ]
    if demanded is not None:
        parts.append(_bar(0.0, demanded, 1, 5, "var(--fl-asked)"))
    if got is not None:
        parts.append(_bar(0.0, got, 8, 5, "var(--fl-delivered)"))
        if demanded is not None and abs(demanded - got) > 0.02:
            parts.append(_bar(got, demanded, 8, 5, "var(--fl-missing)"))
    return html("<div class='track'>{}</div>", parts)


def _bar(start: float, end: float, top: int, height: int, color: str) -> str:
    low, high = sorted((float(np.clip(start, -1, 1)), float(np.clip(end, -1, 1))))
    place = f"left:{50 + 50 * low:.2f}%;width:{50 * (high - low):.2f}%;top:{top}px;height:{height}px"
    return html("<i style='{};background:{}'></i>", place, color)


def swatch(index: int, failed: bool = False) -> str:
    """The fin's number on its colour."""
    color = DEAD if failed else fin_color(index)
    return html(
        "<span class='swatch' style='background:{};color:{}'>{}</span>", css(color), ink(color), index + 1
    )


def fin_table(
    layout: Layout, damage: Damage, allocation: Allocation | None, full: Array, selected: str | None
) -> str:
    """All fins with their commands; `full` is the full thrust (n,) of each [N]."""
    limits = None if allocation is None else saturated(allocation)
    rows = []
    for i, fin in enumerate(layout.actuators):
        failed = allocation is not None and not np.isfinite(allocation.command[i, 0])
        kind = " ".join(["dead"] * failed + ["chosen"] * (fin.name == selected))
        first = html("{}<span class='name' title='{}'>{}</span>", swatch(i, failed), fin.name, fin.name)
        if not failed and (remark := damage_words(damage, fin.name)):
            first += html("<div class='missing damage'>{}</div>", remark)
        if allocation is None or limits is None:
            cells: str = Markup("<td>–</td>") * 5
        elif failed:
            cells = Markup("<td colspan='5'>failed</td>")
        else:
            force = float(np.linalg.norm(allocation.forces[i]))
            cells = _cells(fin, allocation.command[i], limits[i], force, full[i], i)
        rows.append(html("<tr class='{}'><td>{}</td>{}</tr>", kind, first, cells))
    header = html(HEADER if layout.fins else PLAIN_HEADER, "fin" if layout.is_of_fins else "")
    return html("<div class='fl'><table class='fins'>{}{}</table></div>", header, rows)


def _cells(
    part: Actuator, command: Array, limits: NDArray[np.bool_], force: float, full: float, index: int
) -> str:
    amplitude, frequency, direction = command
    share = min(force / max(full, 1e-9), 1.0)
    bar = f"width:{100 * share:.0f}%;background:{css(fin_color(index))}"
    meter = html("<span class='meter'><i style='{}'></i></span>", bar)
    at_limit = ["full" if one else "" for one in limits]
    if not isinstance(part, Fin):
        along = force if part.TURNS else command[0]
        remark = f"{part.type}, {_degrees(command[part.HELD])}°" if part.TURNS else part.type
        words = html("<td colspan='3' class='words'>{}</td>", remark)
        cell = html(
            "<td class='{}'>{}</td>",
            "full" if limits.any() else "",
            f"{round(along, 2) + 0.0:.2f}".replace("-", "−"),
        )
        return html("{}{}<td>{}</td>", words, cell, meter)
    bounded = "<td class='{}'>{:.1f}</td><td class='{}'>{:.2f}</td>"
    first = html(bounded, at_limit[0], math.degrees(amplitude), at_limit[1], frequency)
    return html("{}<td>{}</td><td>{:.2f}</td><td>{}</td>", first, _degrees(direction), force, meter)


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle)):+d}".replace("-", "−")
