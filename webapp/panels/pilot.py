"""Steer the wrench by hand: a stick for two axes, handles in the view, and what to do out of reach."""

from functools import partial
from typing import NamedTuple

import viser

from finlab.allocation.policy import KINDS
from webapp.handles import put
from webapp.markup.picking import add_channel, send
from webapp.page import Page
from webapp.session.state import AXIS_WORDS
from webapp.session.targets import axis_reach
from webapp.theme import ASKED, css

RADIUS = 70
"""Radius of the field [px]."""
EVERY_MS = 60
"""Least time between two words to the server; the page drops what comes quicker than 50 ms."""

CHANNEL = "fl-stick"
SHARE = 0.4
"""Share of the largest wrench along an axis that the stick gives at its end."""


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


class PilotPanel:
    """The stick and its settings."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        policies = "Come closest, keep the direction, or serve axes by priority, heave first."
        self._axes = gui.add_dropdown("Stick for", tuple(PADS), hint="What up and sideways mean.")
        page.on_change(self._axes, lambda _: None)
        self._spring = gui.add_checkbox(
            "Spring back", True, hint="Let go, and what was asked before comes back."
        )
        page.on_change(self._spring, lambda _: None)
        self._pad = gui.add_html("")
        add_channel(gui, CHANNEL, self._steer)
        grips = "Handles on the blue arrows in the view, for the force and the torque."
        page.bind_display(gui.add_checkbox("Drag in 3D (G)", False, hint=grips), "grips")
        page.bind(
            gui.add_dropdown("Out of reach", KINDS, hint=policies),
            partial(page.session.set_setting, "policy"),
            lambda: page.session.state.policy,
        )

    def _steer(self, word: list[str]) -> None:
        """`left,up` as shares of the stick's way, or `off`."""
        session = self._page.session
        if word[0] == "off":
            self._page.do(partial(session.release, bool(self._spring.value)))
            return
        try:
            left, up = (min(max(float(part), -1.0), 1.0) for part in word)
        except ValueError:  # not from our own page
            return
        found = PADS.get(self._axes.value)
        if found is None or left != left or up != up:
            return
        reach = axis_reach(session.state.able, session.state.failed)
        values = {
            axis: share * sign * SHARE * float(reach[axis])
            for share, axis, sign in ((up, found.up, 1.0), (left, found.left, found.left_sign))
        }
        self._page.do(partial(session.steer, values))

    def refresh(self) -> None:
        """Write the stick."""
        name = self._axes.value if self._axes.value in PADS else next(iter(PADS))
        put(self._pad, content=pad(PADS[name], CHANNEL, bool(self._spring.value)))
