"""The legend over the 3D view: what the arrows mean, and what else is drawn at the moment."""

import math
from html import escape

from finlab.allocation.allocation import Allocation
from webapp.markup.figures import three_digits
from webapp.scene.attainable_nodes import set_scale
from webapp.tasks.analyst import Findings
from webapp.theme import ASKED, DEAD, DELIVERED, TORQUE_SCALE, css, look, overlay_color

ARROWS = (("asked", 0.65), ("delivered", 1.0), ("missing", 1.0))
"""Words and opacities of the three arrows."""


def legend(newtons: float, also: tuple[str, ...]) -> str:
    """Arrows, scales, and rows of more.

    Args:
        newtons: force [N] that an arrow of 0.1 m stands for.
        also: rows as `overlay_row` and the others here make them; empty ones are left out.
    """
    # By name, so that the dark theme can lighten them.
    rows = [f"{_arrow(f'var(--fl-{word})', alpha)}<span>{word}</span>" for word, alpha in ARROWS]
    turn = math.degrees(TORQUE_SCALE)
    return (
        f"<div class='fl-legend'>{''.join(rows)}{''.join(also)}</div><div class='dim scales'>"
        f"arrow 0.1 m = {newtons:g} N<br>ring {turn:.0f}° = 1 N m</div>"
    )


def overlay_row(other: Allocation | None, dark: bool) -> str:
    """Whose forces lie over those of the robot."""
    if other is None:
        return ""
    return f"{_arrow(css(overlay_color(dark)), 1.0)}<span>fins, {escape(other.method)}</span>"


def graph_row(shown: bool, weighed: bool, dark: bool) -> str:
    """The edges of the fin graph; `weighed` by attention, or plain for methods without a network."""
    if not shown:
        return ""
    line = f"<path d='M0 3L44 3.8V6.2L0 7Z' fill='{css(look(dark).line)}'/>"
    return f"<svg width='44' height='10'>{line}</svg><span>{'attention' if weighed else 'graph'}</span>"


def set_rows(findings: Findings | None) -> str:
    """The bodies of what can be attained, and their scale."""
    if findings is None or findings.now is None:
        return ""
    rows = [f"{_patch(css(DELIVERED, 0.5))}<span>working fins</span>"]
    if findings.whole is not None:
        word = "all fins" if findings.question.failed else findings.question.beside.name
        rows.append(f"{_patch(css(DEAD, 0.45))}<span>{escape(word)}</span>")
    ball = f"<svg width='44' height='12'><circle cx='22' cy='6' r='5' fill='{css(ASKED)}'/></svg>"
    unit = "N" if findings.now.kind == "force" else "N m"
    scale = f"body 0.1 m = {three_digits(0.1 / set_scale(findings))} {unit}"
    rows.append(f"{ball}<span>asked in it</span><span class='dim wide'>{scale}</span>")
    return "".join(rows)


def _patch(color: str) -> str:
    return f"<svg width='44' height='12'><rect x='8' width='28' height='12' rx='3' fill='{color}'/></svg>"


def _arrow(color: str, opacity: float) -> str:
    return (
        f"<svg width='44' height='10' opacity='{opacity}'>"
        f"<rect x='0' y='3' width='33' height='4' fill='{color}'/>"
        f"<path d='M32 0 L44 5 L32 10 Z' fill='{color}'/></svg>"
    )
