"""What lies over the 3D view: the status line, and the legend of colours and scales."""

import math
from html import escape

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.policy import AXES
from webapp.markup.swim_card import pace_words, robots
from webapp.markup.verdict import WORKING, verdict_of, verdict_sentence
from webapp.markup.words import error_digits, objective_of, three_digits
from webapp.scene.wrench_nodes import set_scale
from webapp.session.state import AXIS_UNITS, State
from webapp.tasks.analyst import Findings
from webapp.tasks.moment import ERROR
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DEAD, DELIVERED, HALF_TURN, WATER, css, look

LONG = 24
"""Characters of a verdict above which it takes a line of its own in a small view."""
ARROWS = (("asked", 0.65), ("delivered", 1.0), ("missing", 1.0))
"""Words and opacities of the three arrows."""


def legend(newtons: float, torque: float, cut: bool, also: tuple[str, ...]) -> str:
    """Arrows, scales, and rows of more.

    Args:
        newtons: force [N] that an arrow of 0.1 m stands for.
        torque: torque [N m] that half a turn of a ring stands for.
        cut: whether a ring would have to be longer than a turn.
        also: rows as `overlay_row` and the others here make them; empty ones are left out.
    """
    # By name, so that the dark theme can lighten them.
    rows = [_key(_arrow(f"var(--fl-{word})", alpha), word) for word, alpha in ARROWS]
    ring = f"<i>ring </i>{math.degrees(HALF_TURN):.0f}° = {torque:g} N m{', cut off' if cut else ''}"
    return (
        f"<div class='fl-legend'>{''.join(rows)}{''.join(also)}</div><div class='dim scales'>"
        f"<span>{_length(newtons)}</span><span>{ring}</span></div>"
    )


def _length(newtons: float) -> str:
    """What the length of an arrow says; where there is little room, without the word in it."""
    return f"<i>arrow </i>0.1 m = {newtons:g} N"


def overlay_row(other: Allocation | None, dark: bool) -> str:
    """Whose forces lie over those of the robot."""
    if other is None:
        return ""
    return _key(_arrow(css(look(dark).overlay), 1.0), f"fins, {escape(other.method)}")


def set_rows(findings: Findings | None) -> str:
    """The bodies of what can be attained, and their scale."""
    if findings is None or findings.now is None:
        return ""
    rows = [_key(_patch(css(DELIVERED, 0.5)), "working fins")]
    if findings.whole is not None:
        asked = findings.question
        other = "before" if asked.beside.name == asked.layout.name else asked.beside.name
        word = "all fins" if asked.failed else other
        rows.append(_key(_patch(css(DEAD, 0.45)), escape(word)))
    ball = f"<svg width='44' height='12'><circle cx='22' cy='6' r='5' fill='{css(ASKED)}'/></svg>"
    unit = "N" if findings.now.kind == "force" else "N m"
    scale = f"body 0.1 m = {three_digits(0.1 / set_scale(findings))} {unit}"
    rows.append(f"{_key(ball, 'asked in it')}<span class='dim wide'>{scale}</span>")
    return "".join(rows)


def _key(sign: str, words: str) -> str:
    """A row of the legend, which stays together where rows stand beside each other."""
    return f"<div class='key'>{sign}<span>{words}</span></div>"


def _patch(color: str) -> str:
    return f"<svg width='44' height='12'><rect x='8' width='28' height='12' rx='3' fill='{color}'/></svg>"


def _arrow(color: str, opacity: float) -> str:
    return (
        f"<svg width='44' height='10' opacity='{opacity}'>"
        f"<rect x='0' y='3' width='33' height='4' fill='{color}'/>"
        f"<path d='M32 0 L44 5 L32 10 Z' fill='{color}'/></svg>"
    )


def corner(
    state: State,
    legend: str,
    allocation: Allocation | None,
    busy: bool,
    error: str | None,
    least: bool = True,
    in_reach: bool = False,
) -> str:
    """Legend and status line in the lower left corner of the page.

    Args:
        state: what is asked.
        legend: what the view shows, as markup.
        allocation: what is on the robot.
        busy: whether a newer answer is on its way.
        error: why there is no answer.
        least: whether it is the answer itself, not another way to do the same.
        in_reach: whether any command of the working fins gives what is asked.
    """
    fins = f"{len(state.healthy)} of {state.layout.n_fins} fins"
    parts = [f"<span class='aside'>{fins}</span>"]
    if error is not None:
        parts.append(f"<span class='missing'>{escape(error)}</span>")
    elif busy or allocation is None:  # an old verdict would be taken for that of the new question
        parts.append(f"<span class='aside'><span class='dim'>{state.method}</span></span>")
        parts.append(f"<span class='pill' style='background:{css(DEAD)}'>{WORKING}</span>")
    else:
        parts += _figures(allocation, least, in_reach)
    return _cards(legend, parts)


def _figures(allocation: Allocation, least: bool, in_reach: bool) -> list[str]:
    """Error, costs, time and verdict of what is on the robot."""
    color, verdict = verdict_of(allocation, in_reach).color, verdict_sentence(allocation, in_reach)
    pill = "pill long" if len(verdict) > LONG else "pill"
    rest = ", ".join(
        f"{axis} {value:+.2g} {unit}"
        for axis, value, unit in zip(AXES, allocation.unallocated, AXIS_UNITS, strict=True)
    ).replace("-", "−")
    costs = []
    for word, value, unit in (("power", allocation.power, " W"), ("effort", allocation.energy, "")):
        kept = f"least {word}" if word == objective_of(allocation) and least else word
        cost = f"<b class='{word}'>{three_digits(value)}</b>{unit}"
        costs.append(f"<span><span class='dim'>{kept}</span> {cost}</span>")
    method, ms = escape(allocation.method), allocation.solve_ms
    time = f"{ms:.2g}" if ms < 10.0 else f"{ms:.0f}"  # no measurement repeats to a third digit
    return [
        f"<span title='missing, by the fins’ own laws: {rest}'><span class='dim'>error</span> "
        f"<b class='err'>{error_digits(allocation.err_norm)}</b> σ</span>",
        *costs,
        f"<span class='aside'><span class='dim'>{method}</span> {time} ms</span>",
        f"<span class='{pill}' style='background:{css(color)}'>{escape(verdict)}</span>",
    ]


def swim_corner(swimming: Swimming, newtons: float) -> str:
    """The same while robots swim."""
    first, shown = swimming.swimmers[0], swimming.seen[0]
    trails = "".join(
        _key(
            f"<svg width='44' height='10'><path d='M0 5H44' stroke='{css(color)}' stroke-width='3.5'/></svg>",
            escape(word),
        )
        for word, color in (
            ("the path", ASKED),
            *((f"{name}, {robot.about}", color) for robot, _, color, name in robots(swimming)),
        )
    )
    speed = 100.0 * float(np.linalg.norm(shown.flow))
    if speed >= 0.05:
        trails += _key(_arrow(css(WATER), 0.9), f"water, {speed:.1f} cm/s")
    alive = len(first.fins) - len(shown.lost)
    off = f"{100 * float(shown.record[-1, ERROR]):.1f}" if len(shown.record) else "–"
    power = "–" if shown.figures is None else f"{shown.figures.now_w:.1f}"
    parts = [
        f"<span>{alive} of {len(first.fins)} fins</span>",
        f"<span><b>{shown.time:.1f}</b> s of {first.duration_s:.0f} s</span>",
        f"<span><span class='dim'>off the path</span> <b>{off}</b> cm</span>",
        f"<span><span class='dim'>power</span> <b>{power}</b> W</span>",
        f"<span>{pace_words(swimming)}</span>",
    ]
    scale = f"<div class='dim scales'><span>{_length(newtons)}</span></div>"
    return _cards(f"<div class='fl-legend'>{trails}</div>{scale}", parts)


def _cards(legend: str, status: list[str]) -> str:
    return (
        f"<div class='fl-corner'><div class='fl fl-card fl-legend-card'>{legend}</div>"
        f"<div class='fl fl-card fl-status'>{''.join(status)}</div></div>"
    )
