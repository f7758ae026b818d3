"""Steer the wrench by hand: a stick for two axes, handles in the view, and what to do out of reach."""

from functools import partial

import viser

from finlab.allocation.policy import KINDS
from webapp.handles import on_user_change, put
from webapp.markup.pad import PADS, pad
from webapp.panels.channel import Channel
from webapp.panels.host import Host
from webapp.panels.target import TargetPanel

CHANNEL = "fl-stick"
SHARE = 0.4
"""Share of the largest wrench along an axis that the stick gives at its end."""


class PilotPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi, host: Host, target: TargetPanel) -> None:
        """Build the widgets; `target` knows what the fins can give."""
        self._host, self._target = host, target
        with gui.add_folder("Steer by hand", expand_by_default=False):
            self._axes = gui.add_dropdown("Stick for", tuple(PADS), hint="What up and sideways mean.")
            on_user_change(self._axes, lambda _: self.refresh())
            self._spring = gui.add_checkbox(
                "Spring back", True, hint="Let go, and what was asked before comes back."
            )
            on_user_change(self._spring, lambda _: self.refresh())
            self._pad = gui.add_html("")
            Channel(gui, CHANNEL, self._steer)
            self._grips = gui.add_checkbox(
                "Drag in 3D (G)",
                False,
                hint="Handles on the blue arrows in the view, for the force and the torque.",
            )
            on_user_change(
                self._grips, lambda value: host.do(partial(host.session.set_display, "grips", value))
            )
            self._policy = gui.add_dropdown(
                "Out of reach",
                KINDS,
                hint="Come closest, keep the direction, or serve axes by priority, heave first.",
            )
            on_user_change(
                self._policy, lambda value: host.do(partial(host.session.set_setting, "policy", value))
            )

    def _steer(self, word: list[str]) -> None:
        """`left,up` as shares of the stick's way, or `off`."""
        session = self._host.session
        if word[0] == "off":
            self._host.do(partial(session.release, bool(self._spring.value)))
            return
        try:
            left, up = (min(max(float(part), -1.0), 1.0) for part in word)
        except ValueError:  # not from our own page
            return
        found = PADS.get(self._axes.value)
        if found is None or left != left or up != up:
            return
        values = {
            axis: share * sign * SHARE * float(self._target.reach[axis])
            for share, axis, sign in ((up, found.up, 1.0), (left, found.left, found.left_sign))
        }
        self._host.do(partial(session.steer, values))

    def refresh(self) -> None:
        """Write the stick and the switches."""
        state, display = self._host.session.state, self._host.session.display
        name = self._axes.value if self._axes.value in PADS else next(iter(PADS))
        put(self._pad, content=pad(PADS[name], CHANNEL, bool(self._spring.value)))
        put(self._policy, value=state.policy)
        put(self._grips, value=display.grips)
