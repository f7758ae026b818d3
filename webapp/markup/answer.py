"""Markup of an answer: six bars of the wrench, and the table of commands, a row per actuator.

The panel of the wrench (`panels/wrench_tab.py`) shows both. The command line has tables of its own
for them (`finlab/allocation/report.py`), with words in place of bars, loads and colours. These are
written at every step of a slider, so rows are joined as plain strings of ours, which need no
escaping, in few calls.
"""

import math
from collections.abc import Sequence
from functools import cache, lru_cache

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.axes import AXES, MOTIONS
from finlab.display import LARGEST_PLAIN, prefix_of
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from webapp.markup.words import damage_words, html, prefixed, saturated, signed_degrees
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
NO_CELLS = "<td>–</td>" * 5
"""Beside the name of an actuator that there is no command for."""
LOST_CELLS = "<td colspan='5'>lost</td>"
"""Beside the name of an actuator that is lost."""
MIDDLE = "<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>"
"""Where nothing is asked, in the track of bars."""
LEAST_FORCE_SCALE = 2.0
"""Least force at the end of a bar [N]."""
LEAST_TORQUE_SCALE = 0.5
"""Least torque at the end of a bar [N m]."""
PLACES = 7
"""Places behind the point to which wrenches are rounded before they are drawn [N, N m]."""
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
    if shown_allocation is not None and busy:
        demanded = shown_allocation.target.tolist()
    else:
        counts = layout.commanded.tolist()
        demanded = [target[axis] if counts[axis] else math.nan for axis in range(6)]
    delivered = None if shown_allocation is None else shown_allocation.wrench.tolist()
    return wrench_bars(demanded, delivered)


def wrench_bars(demanded: Sequence[float], delivered: Sequence[float] | None) -> str:
    """The bars of all six axes.

    Args:
        demanded: wrench (6,) [N, N m], NaN where an axis is free.
        delivered: wrench (6,) [N, N m]; None while there is no answer.
    """
    demands = [None if math.isnan(value) else round(value, PLACES) for value in demanded]
    deliveries: list[float | None] = [None] * 6
    if delivered is not None:
        deliveries = [round(value, PLACES) for value in delivered]
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse
    # steps only.
    sizes = [max(abs(demands[axis] or 0.0), abs(deliveries[axis] or 0.0)) for axis in range(6)]
    force_scale = max(nice_limit(max(sizes[:3])), LEAST_FORCE_SCALE)
    torque_scale = max(nice_limit(max(sizes[3:])), LEAST_TORQUE_SCALE)
    rows = []
    for axis in range(6):
        scale = force_scale if axis < 3 else torque_scale
        rows.append(_bar_row(axis, demands[axis], deliveries[axis], scale))
    header = _bars_header(force_scale, torque_scale)
    return Markup(f"<div class='fl'><div class='bars'>{header}{''.join(rows)}</div></div>")


@lru_cache(maxsize=32)
def _bars_header(force_scale: float, torque_scale: float) -> str:
    """What stands above the bars, whose ends stand for a force [N] and a torque [N m]."""
    ends = f"±{_end(force_scale, 'N')}, ±{_end(torque_scale, 'N m')}"
    return BARS_HEADER.format(ends)


def _end(scale: float, unit: str) -> str:
    """What the end of a bar stands for."""
    prefix = prefix_of(scale)
    return f"{scale / prefix.factor:g} {prefix.symbol}{unit}"


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


@lru_cache(maxsize=256)
def _bar_row(axis: int, demanded: float | None, delivered: float | None, scale: float) -> str:
    """Name, bars and figures of one axis [N or N m], of which nothing is demanded where it is free;
    a bar as long as half the track stands for `scale`. Rows are kept: a step of a slider changes
    one or two."""
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
    factor = prefix_of(scale).factor  # all figures of the axis are as its scale is
    if factor > 1.0:
        digits = 1
    for style, value, placeholder in columns:
        rounded = 0.0 if value is None else round(value / factor, digits)
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
    is_damaged = damage != NO_DAMAGE
    rows = []
    cells = [NO_CELLS] * layout.n
    is_lost = [False] * layout.n
    if allocation is not None:
        cells = _cells(layout, allocation, full_thrust)
        is_lost = [row == LOST_CELLS for row in cells]
    for i, actuator in enumerate(layout.actuators):
        name = actuator.name
        faults = ""
        if is_damaged and not is_lost[i]:
            faults = damage_words(damage, name, actuator.KIND.sticks_at_angle)
        rows.append(f"{_row_head(i, name, is_lost[i], name == selected, faults)}{cells[i]}</tr>")
    template = FIN_HEADER if layout.fins else PLAIN_HEADER
    header = html(template, "fin" if layout.is_of_fins else "")
    return Markup(f"<div class='fl'><table class='fins'>{header}{''.join(rows)}</table></div>")


@lru_cache(maxsize=256)
def _row_head(index: int, name: str, is_lost: bool, is_selected: bool, faults: str) -> str:
    """How the row of an actuator begins: its number and name, and what is wrong with it."""
    style = " ".join(["dead"] * is_lost + ["chosen"] * is_selected)
    remark = html("<div class='missing damage'>{}</div>", faults) if faults else ""
    row = "<tr class='{}'><td>{}<span class='name' title='{}'>{}</span>{}</td>"
    return html(row, style, swatch(index, is_lost), name, name, remark)


def _cells(layout: Layout, allocation: Allocation, full_thrust: Array) -> list[str]:
    """The cells beside the name of each actuator: its command, its force and its load."""
    limits = saturated(allocation)
    commands = allocation.command.tolist()
    forces = allocation.forces.tolist()
    most = full_thrust.tolist()
    cells = []
    for i, actuator in enumerate(layout.actuators):
        command = commands[i]
        if not math.isfinite(command[0]):
            cells.append(LOST_CELLS)
            continue
        force = math.hypot(*forces[i])
        load = min(force / max(most[i], 1e-9), 1.0)
        bar = f"width:{100 * load:.0f}%;background:{css(fin_color(i))}"
        meter = f"<span class='meter'><i style='{bar}'></i></span>"
        if isinstance(actuator, Fin):
            cells.append(_fin_cells(command, limits[i], force, meter))
        else:
            cells.append(_plain_cells(actuator, command, limits[i], force, meter))
    return cells


def _fin_cells(
    command: Sequence[float], limits: tuple[bool, bool], force: float, meter: str
) -> str:
    """Half amplitude, frequency and zero direction of a fin, its force [N] and its load; those of
    the first two that are at a limit are marked."""
    amplitude, frequency, direction = command
    amplitude_style = "full" if limits[0] else ""
    frequency_style = "full" if limits[1] else ""
    angle = signed_degrees(direction)
    return (
        f"<td class='{amplitude_style}'>{math.degrees(amplitude):.1f}</td>"
        f"<td class='{frequency_style}'>{frequency:.2f}</td>"
        f"<td>{angle}</td><td>{force:.2f}</td><td>{meter}</td>"
    )


def _force_digits(force: float) -> str:
    """A force [N] in its column, with an SI prefix where it is large."""
    if abs(force) >= LARGEST_PLAIN:
        return "".join(prefixed(force))
    return f"{round(force, 2) + 0.0:.2f}".replace("-", "−")


def _plain_cells(
    actuator: Actuator,
    command: Sequence[float],
    limits: tuple[bool, bool],
    force: float,
    meter: str,
) -> str:
    """Type of an actuator that is no fin, its angle where it has one, its force [N] and its load;
    the force is marked where a number of its command is at a limit."""
    along = command[0]
    remark = actuator.type
    if actuator.KIND.sticks_at_angle:
        along = force
        remark = f"{actuator.type}, {signed_degrees(command[actuator.KIND.stuck_number])}°"
    return html(
        "<td colspan='3' class='words'>{}</td><td class='{}'>{}</td><td>{}</td>",
        remark,
        "full" if any(limits) else "",
        _force_digits(along),
        Markup(meter),
    )
