"""The lower left corner of the 3D view: the status line of an answer or a swim, and the legend of
what is drawn."""

from functools import lru_cache

import numpy as np
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.report import is_proved_least
from finlab.axes import AXES, UNITS
from finlab.display import LARGEST_PLAIN, prefix_of
from finlab.layout import Layout
from finlab.physics.objective import REACHED
from webapp.handles import set_properties
from webapp.markup.two_robots import status_of_both
from webapp.markup.verdict import COLORS, WORKING, verdict_of, verdict_sentence
from webapp.markup.words import (
    ROUNDING,
    error_digits,
    html,
    parts_word,
    signed,
    three_digits,
    time_digits,
    with_unit,
)
from webapp.page import Page
from webapp.scene.stage import arrow_size
from webapp.scene.two_robots import pair_arrow_size
from webapp.scene.wrench_nodes import Scale, set_scale
from webapp.session.looking import Display
from webapp.session.state import LEAST, State
from webapp.session.two_robots import Pair
from webapp.tasks.analysing import Analysis
from webapp.tasks.solver import Modes, Reply
from webapp.tasks.swimmer import ERROR, Moment, Swimmer
from webapp.theme import ASKED, DEAD, DELIVERED, REACH, TAKEN, WATER, css

LONG = 24
"""Characters of a verdict above which it takes a line of its own in a small view."""
ARROWS = ("asked", "delivered", "missing")
"""Arrows of the legend by name."""
NOTHING_ASKED = (0.0,) * 6
"""The wrench [N, N m] of a robot that rests."""
AT_REST = 1e-3
"""Error [1] and power [W] of a robot that rests up to which the status says no more than that they
are as small: fins that idle give a little of both."""
NEXT_TO_NOTHING = "≤ 0.001"
"""`AT_REST` in words."""
SLOWEST_WATER = 5e-4
"""Speed of the water from which it is in the legend of a swim [m/s]."""


def add_corner(page: Page) -> None:
    """Adds status line and legend to a page; both disappear where they cannot be written."""

    def fail(error: Exception | None) -> None:
        if error is not None:
            set_properties(content, content="")

    page.board.group(fail)
    content = page.add_html(_corner_of_facts)


def _corner_of_facts(
    swimmer: Swimmer | None,
    moment: Moment | None,
    pace: str,
    state: State,
    display: Display,
    analysis: Analysis | None,
    scale: Scale,
    shown_allocation: Allocation | None,
    best: Allocation | None,
    busy: bool,
    error: str | None,
    in_reach: bool,
    step: int | None,
    modes: Modes,
    mode: int,
    task: str,
    pair: Pair | None,
    left_reply: Reply | None,
    right_reply: Reply | None,
    pair_busy: bool,
) -> str:
    """The corner as the facts of a page have it, which are the arguments by name."""
    if swimmer is not None and moment is not None:
        return swim_corner(swimmer, moment, pace, scale, display.arrow_length)
    if pair is not None:
        keys = legend(scale, pair_arrow_size(pair), display.arrow_length, "")
        return _cards(keys, status_of_both(pair, (left_reply, right_reply), pair_busy))
    size = arrow_size(state.layout)
    has_sets = display.drawn != "none" and task == "Design"
    keys = legend(scale, size, display.arrow_length, set_rows(analysis if has_sets else None, size))
    if state.layout.interaction is not None:
        keys += JETS
    is_best = shown_allocation is best
    refined = ""
    badge = ""
    if not is_best:
        if step is not None:
            refined = f"Step {step} of {modes.steps}"
        if mode < len(modes.visible):
            shown_mode = modes.visible[mode]
            badge = shown_mode.badge
            if shown_mode.mode.err_norm > REACHED:
                refined = shown_mode.name.capitalize()
    return corner(state, keys, shown_allocation, busy, error, is_best, in_reach, refined, badge)


@lru_cache(maxsize=32)
def legend(scale: Scale, size: float, arrow_length: float, more_rows: str) -> str:
    """Keys of the arrows, and scales of arrows and rings.

    Args:
        scale: what arrows and rings stand for where `size` is 1.
        size: factor of the length of arrows on this robot.
        arrow_length: the factor that the user has chosen.
        more_rows: markup of further keys.
    """
    # By name, so that the dark theme can lighten them.
    rows = []
    for name in ARROWS:
        rows.append(_key(_arrow(f"var(--fl-{name})", 1.0), name))
    return html(
        "<div class='fl-legend'>{}{}</div>{}",
        rows,
        more_rows,
        scale_words(scale, size * arrow_length),
    )


def scale_words(scale: Scale, size: float, has_rings: bool = True) -> str:
    """What the lengths of arrows and the radii of rings say; actuators have a scale of their own.

    Args:
        scale: what they stand for where `size` is 1.
        size: factor of their length.
        has_rings: whether there are rings.
    """
    length = f"{0.1 * size:.3g} m"
    parts = [html("<span>{} = {}</span>", length, in_unit(scale.newtons, "N"))]
    if has_rings:
        torque = in_unit(scale.torque, "N m")
        parts.append(html("<span>ring {}</span>", torque))
    parts.append(html("<span>actuator {}</span>", in_unit(scale.actuator, "N")))
    return html("<div class='dim scales'>{}</div>", parts)


def in_unit(value: float, unit: str) -> str:
    """A value in a unit, or in thousands or millions of it where it is that large."""
    if value < 1000.0:
        return f"{value:g} {unit}"
    # A scale is a round number: 5000 N is told as 5 kN.
    prefix = prefix_of(max(value, LARGEST_PLAIN))
    return f"{value / prefix.factor:g} {prefix.symbol}{unit}"


def set_rows(analysis: Analysis | None, size: float) -> str:
    """The bodies of what can be attained, and their scale."""
    if analysis is None or analysis.now is None:
        return ""
    rows = [_key(_patch(css(REACH, 0.6)), "in reach")]
    if analysis.whole is not None:
        question = analysis.question
        word = "with all" if question.lost else "before"
        rows.append(_key(_patch(css(DEAD, 0.45)), word))
    ball = html(
        "<svg width='44' height='12'><circle cx='22' cy='6' r='5' fill='{}'/></svg>", css(ASKED)
    )
    unit = "N" if analysis.now.kind == "force" else "N m"
    scale = f"body {0.1 * size:g} m = {three_digits(0.1 / set_scale(analysis))} {unit}"
    rows.append(html("{}<span class='dim wide'>{}</span>", _key(ball, "asked in it"), scale))
    return Markup().join(rows)


def _key(sign: str, words: str) -> str:
    """A row of the legend: a sign and what it means."""
    return html("<div class='key'>{}<span>{}</span></div>", sign, words)


def _patch(color: str) -> str:
    """The sign of a surface."""
    box = "<svg width='44' height='12'><rect x='8' width='28' height='12' rx='3' fill='{}'/></svg>"
    return html(box, color)


def _arrow(color: str, opacity: float) -> str:
    """The sign of an arrow."""
    picture = (
        "<svg width='44' height='10' opacity='{}' fill='{}'><path d='M0 3H32V0L44 5L32 "
        "10V7H0Z'/></svg>"
    )
    return html(picture, opacity, color)


JETS = html(
    "<div class='fl-legend'><div class='key'>{}<span>jet</span>{}<span class='wide'>taken by "
    "jets</span>"
    "</div></div>",
    _patch(css(WATER, 0.5)),
    _arrow(css(TAKEN), 1.0),
)
"""Keys of jets; they stay together."""


def corner(
    state: State,
    legend: str,
    allocation: Allocation | None,
    busy: bool,
    error: str | None,
    least: bool = True,
    in_reach: bool = False,
    refined: str = "",
    badge: str = "",
) -> str:
    """Legend and status line of an answer.

    Args:
        state: the present state.
        legend: markup of the legend.
        allocation: what is on the robot, if any.
        busy: whether it is of an earlier question.
        error: why there is no answer; None where there is one.
        least: whether it is the answer itself, not another mode of it.
        in_reach: whether any command of what works gives the target.
        refined: the step of the refinement of that mode; empty at its end.
        badge: where that mode comes from.
    """
    markup = [_working_words(state.layout, state.lost)]
    if error is not None:
        markup.append(html("<span class='missing'>{}</span>", error))
    elif busy or allocation is None:  # an old verdict would be taken for that of the new question
        markup.append(html("<span class='aside'><span class='dim'>{}</span></span>", state.method))
        markup.append(
            html("<span class='pill' style='background:{}'>{}</span>", css(DEAD), WORKING)
        )
    else:
        rests = state.target == NOTHING_ASKED
        markup.append(_figures(allocation, least, in_reach, refined, badge, rests))
    return _cards(legend, markup)


@lru_cache(maxsize=32)
def _working_words(layout: Layout, lost: tuple[str, ...]) -> str:
    """How many of the actuators work."""
    words = f"{layout.n - len(lost)} of {layout.n} {parts_word(layout)}"
    return html("<span class='aside'>{}</span>", words)


def _figures(
    allocation: Allocation, least: bool, in_reach: bool, refined: str, badge: str, rests: bool
) -> str:
    """Error, power, effort, method and verdict of an answer.

    Args:
        allocation: as for `corner`, and the next four likewise.
        least: whether it is the answer itself.
        in_reach: whether any command gives the target.
        refined: the step of the refinement.
        badge: where the mode comes from.
        rests: whether no wrench is asked for.
    """
    color = DEAD if refined else COLORS[verdict_of(allocation, in_reach)]
    sentence = refined or verdict_sentence(allocation, in_reach)
    pill = "pill long" if len(sentence) > LONG else "pill"
    unallocated = allocation.unallocated.tolist()
    missing = zip(AXES, unallocated, UNITS, strict=True)
    rest = ", ".join(
        [
            f"{axis} {signed(value if abs(value) >= ROUNDING else 0.0)} {unit}"
            for axis, value, unit in missing
        ]
    )
    method = allocation.method
    err_norm = allocation.err_norm
    power = allocation.power
    err_digits = NEXT_TO_NOTHING if rests and err_norm <= AT_REST else error_digits(err_norm)
    watts = f"{NEXT_TO_NOTHING} W" if rests and power <= AT_REST else with_unit(power, "W")
    figures = [
        f"<span title='missing, as a share of what the robot can push: {rest}'><span class='dim'>"
        f"error</span> <b class='err'>{err_digits}</b></span>"
    ]
    kinds = (("power", "watts", watts), ("effort", "effort", three_digits(allocation.effort)))
    for word, kind, figure in kinds:
        if word == "effort" and allocation.effort is None:  # it is of fins
            continue
        is_least = least and LEAST.get(kind) == method
        if word == "power":
            is_least = is_least and is_proved_least(allocation)
        label = f"least {word}" if is_least else word
        number, _, unit = figure.partition(" ")
        figures.append(
            f"<span><span class='dim'>{label}</span> <b class='{word}'>{number}</b> {unit}</span>"
        )
    time = time_digits(allocation.solve_ms)
    who = html("<span class='dim'>{}</span> {} ms", method, time) if least else badge or "network"
    figures.append(html("<span class='aside'>{}</span>", who))
    figures.append(
        html("<span class='{}' style='background:{}'>{}</span>", pill, css(color), sentence)
    )
    return Markup("".join(figures))


def swim_corner(
    swimmer: Swimmer, moment: Moment, pace: str, scale: Scale, arrow_length: float
) -> str:
    """Legend and status line of a swim.

    Args:
        swimmer: the robot that swims.
        moment: the moment that the page shows.
        pace: how fast it goes, in words.
        scale: what arrows stand for.
        arrow_length: the factor that the user has chosen.
    """
    line = "<svg width='44' height='10'><path d='M0 5H44' stroke='{}' stroke-width='3.5'/></svg>"
    trails = [
        _key(html(line, css(ASKED)), "the path"),
        _key(html(line, css(DELIVERED)), f"{swimmer.method}, {swimmer.about}"),
    ]
    speed = float(np.linalg.norm(moment.flow))
    if speed >= SLOWEST_WATER:
        trails.append(_key(_arrow(css(WATER), 0.9), f"water, {speed:.3f} m/s"))
    alive = len(swimmer.fins) - len(moment.lost)
    off = f"{float(moment.record[-1, ERROR]):.3f}" if len(moment.record) else "–"
    power = "–" if moment.figures is None else f"{moment.figures.now_w:.1f}"
    markup = [
        html("<span>{} of {} {}</span>", alive, len(swimmer.fins), parts_word(swimmer.layout)),
        html("<span><b>{:.1f}</b> s of {:.0f} s</span>", moment.time, swimmer.duration_s),
        html("<span><span class='dim'>off the path</span> <b>{}</b> m</span>", off),
        html("<span><span class='dim'>power</span> <b>{}</b> W</span>", power),
        html("<span>{}</span>", pace),
    ]
    size = arrow_size(swimmer.layout) * arrow_length
    words = scale_words(scale, size, has_rings=False)
    jets = "" if swimmer.layout.interaction is None else JETS
    return _cards(html("<div class='fl-legend'>{}</div>{}{}", trails, words, jets), markup)


def _cards(legend: str, status: list[str]) -> str:
    """The two cards of the corner."""
    return html(
        "<div class='fl-corner'><div class='fl fl-card fl-legend-card'>{}</div>"
        "<div class='fl fl-card fl-status'>{}</div></div>",
        legend,
        status,
    )
