"""A stick: a round field with a knob that is dragged, and springs back or stays."""

from typing import NamedTuple

from webapp.panels.channel import send
from webapp.session.state import AXIS_WORDS
from webapp.theme import ASKED, css

RADIUS = 70
"""Radius of the field [px]."""
EVERY_MS = 60
"""Least time between two words to the server; the page drops what comes quicker than 50 ms."""


class Pad(NamedTuple):
    """What the stick's two ways mean."""

    up: int
    """Axis that grows upwards."""
    left: int
    """Axis that changes sideways."""
    left_sign: float
    """1 where it grows to the left, -1 where it grows to the right."""


PADS = {
    "surge and yaw": Pad(0, 5, 1.0),
    "surge and sway": Pad(0, 1, 1.0),
    "heave and sway": Pad(2, 1, 1.0),
    "pitch and roll": Pad(4, 3, -1.0),
}
"""Sticks by what they steer. Sway and yaw are positive to the left, roll to the right, pitch nose down."""


def pad(axes: Pad, channel: str, spring: bool) -> str:
    """The field; dragging sends `left,up` through a channel, letting go sends `off`."""
    knob = "this.querySelector('.knob')"
    place = (
        f"const r = this.getBoundingClientRect(), k = {knob};"
        "let x = (event.clientX - r.left) / r.width * 250 - 125,"
        " y = (event.clientY - r.top) / r.height * 172 - 89;"
        f"const far = Math.max(1, Math.hypot(x, y) / {RADIUS}); x /= far; y /= far;"
        "k.setAttribute('cx', x); k.setAttribute('cy', y);"
    )
    word = f"(-x / {RADIUS}).toFixed(3) + ',' + (-y / {RADIUS}).toFixed(3)"
    tell = (
        f"if (!(event.timeStamp - (this.told || 0) < {EVERY_MS})) "
        f"{{ this.told = event.timeStamp; {send(channel, word)} }}"
    )
    home = f"const k = {knob}; k.setAttribute('cx', 0); k.setAttribute('cy', 0);" if spring else ""
    down = f"this.setPointerCapture(event.pointerId); this.held = 1; {place}{tell}"
    move = f"if (this.held) {{ {place}{tell} }}"
    off = send(channel, "'off,' + Date.now()")
    up = f"if (this.held) {{ this.held = 0; this.told = 0; {home}{off} }}"
    words = (
        f"<text x='0' y='-{RADIUS + 3}' text-anchor='middle'>{AXIS_WORDS[axes.up]} +</text>"
        f"<text x='{-RADIUS - 4}' y='4' text-anchor='end'>{_side(axes, 1.0)}</text>"
        f"<text x='{RADIUS + 4}' y='4'>{_side(axes, -1.0)}</text>"
    )
    return (
        f"<div class='fl'><svg class='pad' viewBox='-125 -89 250 172' "
        f'onpointerdown="{down}" onpointermove="{move}" onpointerup="{up}" onpointercancel="{up}">'
        f"<circle r='{RADIUS}' class='field'/>"
        f"<path d='M-{RADIUS} 0H{RADIUS}M0 -{RADIUS}V{RADIUS}' class='grid'/>"
        f"{words}<circle class='knob' r='13' fill='{css(ASKED)}'/></svg></div>"
    )


def _side(axes: Pad, left: float) -> str:
    return f"{AXIS_WORDS[axes.left]} {'+' if left * axes.left_sign > 0 else '−'}"
