"""The question and its answer: target wrench, failures, bars, and the table of commands."""

from functools import partial
from html import escape

import numpy as np
import viser

from finlab.allocation.policy import AXES, KINDS
from finlab.layout import Layout
from webapp.handles import on_user_change, put
from webapp.markup.bars import wrench_bars
from webapp.markup.fins import fin_table
from webapp.markup.picking import button_colors
from webapp.panels.host import Host
from webapp.panels.mode_picker import ModePicker
from webapp.state import AXIS_UNITS, AXIS_WORDS
from webapp.targets import PRESETS, axis_reach, full_thrust, slider_end
from webapp.theme import DEAD, css, fin_color
from webapp.words import authority_sentence, rest_sentence


class WrenchPanel:
    """Target sliders with what comes of them below."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._presets = gui.add_button_group("Preset", tuple(PRESETS), hint="Target wrenches to start from.")
        on_user_change(self._presets, lambda name: host.do(partial(host.session.set_preset, name)))
        self._sliders = [
            gui.add_slider(
                f"{AXES[k]} [{AXIS_UNITS[k]}]",
                -10.0,
                10.0,
                0.01 if k < 3 else 0.001,
                0.0,
            )
            for k in range(6)
        ]
        for k, slider in enumerate(self._sliders):
            on_user_change(slider, partial(self._set_target, k))
        self._paint = gui.add_html("")
        self._failures = gui.add_button_group(
            "Fail a fin", ("1",), hint="Press a fin's number: fail or repair it."
        )
        on_user_change(self._failures, self._toggle_failure)
        self._bars = gui.add_html("")
        self._table = gui.add_html("")
        self._picker = ModePicker(gui, host, 150, "fl-wrench-modes")
        with gui.add_folder("More", expand_by_default=False):
            self._grips = gui.add_checkbox(
                "Drag in 3D",
                False,
                hint="Handles on the blue arrows, for the force and the torque.",
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
        self._ranges_for: tuple[Layout, tuple[str, ...]] | None = None
        self._reach = np.ones(6)
        self._full = np.ones(1)

    def _set_target(self, axis: int, value: float) -> None:
        self._host.do(partial(self._host.session.set_target, axis, value))

    def _set_grips(self, value: bool) -> None:
        self._host.do(partial(self._host.session.set_display, "grips", value))

    def _toggle_failure(self, button: str) -> None:
        names = self._host.session.state.layout.names
        index = int("".join(c for c in button if c.isdigit()) or 0) - 1
        if 0 <= index < len(names):
            self._host.do(partial(self._host.session.toggle_failure, names[index]))

    def refresh(self) -> None:
        """Write target, failures and answer."""
        host, state = self._host, self._host.session.state
        self._refresh_ranges()
        for slider, value in zip(self._sliders, state.target, strict=True):
            low, high = min(slider.min, value), max(slider.max, value)
            put(slider, min=low, max=high)
            put(slider, value=value)
        put(self._policy, value=state.policy)
        put(self._grips, value=host.session.display.grips)
        put(
            self._failures,
            options=tuple(
                f"{i + 1} ✕" if n in state.failed else str(i + 1) for i, n in enumerate(state.layout.names)
            ),
        )
        colors = [
            (css(DEAD), "#fff") if n in state.failed else (css(fin_color(i)), "#111")
            for i, n in enumerate(state.layout.names)
        ]
        put(self._paint, content=button_colors("fl-fails", colors))
        self._picker.refresh()
        answer = host.shown
        sentence = "" if answer is None else rest_sentence(answer)
        if answer is not None and not answer.reachable:
            told = escape("; ".join((*answer.binding, *answer.notes)))
            sentence = f"{sentence} {100 * answer.scale:.0f} % of what is asked, {told}."
        blind = authority_sentence(state.layout, state.failed, self._reach)
        if blind is not None:
            sentence = f"<span class='missing'>{blind}</span> {sentence}"
        put(
            self._bars, content=wrench_bars(state.target, None if answer is None else answer.wrench, sentence)
        )
        fitting = answer if answer is not None and answer.layout.names == state.layout.names else None
        put(self._table, content=fin_table(state.layout, fitting, self._full, host.session.selected))

    def _refresh_ranges(self) -> None:
        """Slider ranges and reach marks follow the layout and its failures."""
        state = self._host.session.state
        if self._ranges_for == (state.layout, state.failed):
            return
        self._ranges_for = (state.layout, state.failed)
        self._reach = axis_reach(state.layout, state.failed)
        self._full = full_thrust(state.layout)
        for k, slider in enumerate(self._sliders):
            end, reach = slider_end(float(self._reach[k])), self._reach[k]
            put(slider, min=-end, max=end)
            put(
                slider,
                hint=f"{AXIS_WORDS[k].capitalize()}: the fins give at most ±{reach:.3g} {AXIS_UNITS[k]}.",
            )
