"""Markup of an answer: six bars of the wrench, and the table of commands, a row per actuator.

The panel of the wrench (`panels/wrench_tab.py`) shows both. The command line has tables of its own
for them (`finlab/allocation/report.py`), with words in place of bars, loads and colours. These are
written at every step of a slider, so rows are joined as plain strings of ours, which need no
escaping, in few calls.
"""

import math
from functools import cache

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.axes import AXES, MOTIONS
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from webapp.markup.words import damage_words, html, saturated
from webapp.theme import DEAD, css, fin_color, ink

FIN_HEADER = Markup(
    "<tr><th>{}</th>"
    "<th title='half amplitude'>A [°]</th>"
    "<th title='frequency'>f [Hz]</th>"
    "<th title='zero direction'>dir. [°]</th>"
    "<th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)
"""Columns of a robot that has fins; the first one is headed by what its actuators are called."""
PLAIN_HEADER = Markup(
    "<tr><th>{}</th>"
    "<th colspan='3'>actuator</th>"
    "<th>force [N]</th>"
    "<th title='share of the full thrust'>load</th></tr>"
)
"""Columns of a robot without fins."""
BARS_HEADER = Markup(
    "<span class='dim scale'>{}</span>"
    "<b class='right asked'>asked</b>"
    "<b class='right given'>delivered</b>"
    "<b class='right missing'>missing</b>"
)
"""Heads of the bars; the first one says what the ends of a bar stand for."""
MIDDLE = "<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>"
"""Where nothing is asked, in the track of bars."""
LEAST_FORCE_SCALE = 2.0
"""Least force at the end of a bar [N]."""
LEAST_TORQUE_SCALE = 0.5
"""Least torque at the end of a bar [N m]."""
LEAST_MISSING_BAR = 0.02
"""Share of a bar's scale up to which a missing component is not drawn."""


def bars_of(
    shown_allocation: Allocation | None, target: tuple[float, ...], layout: Layout, busy: bool
) -> str:
    """The bars of an answer; one to an earlier question stands beside what was demanded then.

    Args:
        shown_allocation: the answer that is on the robot, if any.
        target: the present target wrench (6,) [N, N m].
        layout: the present robot, which says which axes count.
        busy: whether the answer is one to an earlier question.
    """
    if shown_allocation is None:
        return wrench_bars(np.where(layout.commanded, target, np.nan), None)
    demanded = shown_allocation.target if busy else np.where(layout.commanded, target, np.nan)
    return wrench_bars(demanded, shown_allocation.wrench)


def wrench_bars(demanded: ArrayLike, delivered: ArrayLike | None) -> str:
    """The bars of all six axes.

    Args:
        demanded: wrench (6,) [N, N m], NaN where an axis is free.
        delivered: wrench (6,) [N, N m]; None while there is no answer.
    """
    demanded = np.asarray(demanded, dtype=float)
    delivered = None if delivered is None else np.asarray(delivered, dtype=float)
    target = np.nan_to_num(demanded)
    values = np.array([target, target if delivered is None else delivered])
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse
    # steps only.
    force_scale = max(nice_limit(np.abs(values[:, :3]).max()), LEAST_FORCE_SCALE)
    torque_scale = max(nice_limit(np.abs(values[:, 3:]).max()), LEAST_TORQUE_SCALE)
    rows = []
    for axis in range(6):
        axis_demand = None if np.isnan(demanded[axis]) else float(demanded[axis])
        axis_delivery = None if delivered is None else float(delivered[axis])
        scale = force_scale if axis < 3 else torque_scale
        rows.append(_bar_row(axis, axis_demand, axis_delivery, scale))
    header = BARS_HEADER.format(f"±{force_scale:g} N, ±{torque_scale:g} N m")
    return html("<div class='fl'><div class='bars'>{}{}</div></div>", header, Markup("".join(rows)))


def nice_limit(value: float) -> float:
    """The next of 1, 2, 5, 10, ... above 1.2 times `value`: a scale's end."""
    if value < 1e-6:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(1.2 * value))
    mantissa = 1.2 * value / decade
    for step in (1.0, 2.0, 5.0):
        if mantissa <= step:
            return decade * step
    return decade * 10.0


def _bar_row(axis: int, demanded: float | None, delivered: float | None, scale: float) -> str:
    """Name, bars and figures of one axis [N or N m], of which nothing is demanded where it is free;
    a bar as long as half the track stands for `scale`."""
    missing = None if demanded is None or delivered is None else demanded - delivered
    bars = []  # start and end [N or N m], px from the track's upper edge, colour
    if demanded is not None:
        bars.append((0.0, demanded, 1, "asked"))
    if delivered is not None:
        bars.append((0.0, delivered, 8, "delivered"))
    is_missing = missing is not None and abs(missing) > LEAST_MISSING_BAR * scale
    if demanded is not None and delivered is not None and is_missing:
        bars.append((delivered, demanded, 8, "missing"))
    markup = [
        f"<span>{MOTIONS[axis]} <span class='dim'>{AXES[axis]}</span></span>"
        f"<div class='track'>{MIDDLE}"
    ]
    for start, end, top, color in bars:
        start_share = min(max(start / scale, -1.0), 1.0)
        end_share = min(max(end / scale, -1.0), 1.0)
        left = 50 + 50 * min(start_share, end_share)
        width = 50 * (max(start_share, end_share) - min(start_share, end_share))
        box = f"left:{left:.2f}%;width:{width:.2f}%;top:{top}px;height:5px"
        markup.append(f"<i style='{box};background:var(--fl-{color})'></i>")
    markup.append("</div>")
    columns = (("asked", demanded, "free"), ("given", delivered, "–"), ("missing", missing, "–"))
    digits = 2 if axis < 3 else 3
    for style, value, placeholder in columns:
        rounded = 0.0 if value is None else round(value, digits)
        if value is None:
            text = placeholder
        elif rounded:
            text = f"{rounded:+.{digits}f}".replace("-", "−")
        else:
            text = f"{0:.{digits}f}"
        if style == "missing" and not rounded:
            style = "dim"
        markup.append(f"<span class='right {style}'>{text}</span>")
    return "".join(markup)


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
    layout: Layout,
    damage: Damage,
    allocation: Allocation | None,
    full_thrust: Array,
    selected: str | None,
) -> str:
    """All actuators with their commands.

    Args:
        layout: the robot.
        damage: what is wrong with its actuators.
        allocation: the answer that is on the robot, if any.
        full_thrust: largest force (n,) of each actuator [N].
        selected: name of the selected actuator, whose row is marked.
    """
    limits = None if allocation is None else saturated(allocation)
    is_damaged = damage != NO_DAMAGE
    rows = []
    for i, actuator in enumerate(layout.actuators):
        is_lost = allocation is not None and not np.isfinite(allocation.command[i, 0])
        style = " ".join(["dead"] * is_lost + ["chosen"] * (actuator.name == selected))
        faults = ""
        if is_damaged and not is_lost:
            faults = damage_words(damage, actuator.name, actuator.KIND.sticks_at_angle)
        remark = html("<div class='missing damage'>{}</div>", faults) if faults else ""
        if allocation is None or limits is None:
            cells: str = Markup("<td>–</td>") * 5
        elif is_lost:
            cells = Markup("<td colspan='5'>lost</td>")
        else:
            force = float(np.linalg.norm(allocation.forces[i]))
            load = min(force / max(full_thrust[i], 1e-9), 1.0)
            bar = f"width:{100 * load:.0f}%;background:{css(fin_color(i))}"
            meter = Markup(f"<span class='meter'><i style='{bar}'></i></span>")
            if isinstance(actuator, Fin):
                cells = _fin_cells(allocation.command[i], limits[i], force, meter)
            else:
                cells = _plain_cells(actuator, allocation.command[i], limits[i], force, meter)
        row = "<tr class='{}'><td>{}<span class='name' title='{}'>{}</span>{}</td>{}</tr>"
        name = actuator.name
        rows.append(html(row, style, swatch(i, is_lost), name, name, remark, cells))
    template = FIN_HEADER if layout.fins else PLAIN_HEADER
    header = html(template, "fin" if layout.is_of_fins else "")
    return html("<div class='fl'><table class='fins'>{}{}</table></div>", header, rows)


def _fin_cells(command: Array, limits: NDArray[np.bool_], force: float, meter: Markup) -> str:
    """Half amplitude, frequency and zero direction of a fin, its force [N] and its load; those of
    the first two that are at a limit (2,) are marked."""
    amplitude, frequency, direction = command.tolist()
    amplitude_style = "full" if limits[0] else ""
    frequency_style = "full" if limits[1] else ""
    angle = f"{round(math.degrees(direction)):+d}".replace("-", "−")
    return Markup(
        f"<td class='{amplitude_style}'>{math.degrees(amplitude):.1f}</td>"
        f"<td class='{frequency_style}'>{frequency:.2f}</td>"
        f"<td>{angle}</td><td>{force:.2f}</td><td>{meter}</td>"
    )


def _plain_cells(
    actuator: Actuator, command: Array, limits: NDArray[np.bool_], force: float, meter: Markup
) -> str:
    """Type of an actuator that is no fin, its angle where it has one, its force [N] and its load;
    the force is marked where a number of its command is at a limit."""
    along = command[0]
    remark = actuator.type
    if actuator.KIND.sticks_at_angle:
        along = force
        angle = round(math.degrees(command[actuator.KIND.stuck_number]))
        remark = f"{actuator.type}, {angle:+d}°".replace("-", "−")
    return html(
        "<td colspan='3' class='words'>{}</td><td class='{}'>{}</td><td>{}</td>",
        remark,
        "full" if limits.any() else "",
        f"{round(along, 2) + 0.0:.2f}".replace("-", "−"),
        meter,
    )
