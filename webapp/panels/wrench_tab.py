"""The question and its answer: target wrench, failures, bars, and the table of commands."""

from functools import partial
from html import escape

import viser

from webapp.handles import numbered, on_user_change, put
from webapp.markup.bars import wrench_bars
from webapp.markup.fins import fin_table
from webapp.markup.picking import button_colors
from webapp.markup.words import authority_sentence, rest_sentence
from webapp.panels.damage import DamagePanel
from webapp.panels.host import Host
from webapp.panels.mode_picker import ModePicker
from webapp.panels.pilot import PilotPanel
from webapp.panels.sweep import SweepPanel
from webapp.panels.target import TargetPanel
from webapp.session.targets import full_thrust
from webapp.theme import DEAD, css, fin_color


class WrenchTab:
    """Target sliders with what comes of them below."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._target = TargetPanel(gui, host)
        self._paint = gui.add_html("")
        self._failures = gui.add_button_group(
            "Fail a fin",
            ("1",),
            hint="Press a number to fail or repair a fin; F does it to the selected one.",
        )
        on_user_change(self._failures, self._toggle_failure)
        self._bars = gui.add_html("")
        self._table = gui.add_html("")
        self._picker = ModePicker(gui, host, 150, "fl-wrench-modes")
        self._damage = DamagePanel(gui, host)
        self._pilot = PilotPanel(gui, host, self._target)
        self._sweep = SweepPanel(gui, host)

    def _toggle_failure(self, button: str) -> None:
        names = self._host.session.state.layout.names
        index = numbered(button, len(names))
        if index is not None:
            self._host.do(partial(self._host.session.toggle_failure, names[index]))

    def refresh(self) -> None:
        """Write target, failures and answer."""
        host, state = self._host, self._host.session.state
        self._target.refresh()
        self._refresh_failures()
        self._picker.refresh()
        self._damage.refresh()
        self._pilot.refresh()
        self._sweep.refresh()
        answer = host.shown
        given = None if answer is None else answer.wrench
        put(self._bars, content=wrench_bars(state.target, given, self._sentence()))
        fitting = answer if answer is not None and answer.layout.names == state.layout.names else None
        put(self._table, content=fin_table(state, fitting, full_thrust(state.able), host.session.selected))

    def _refresh_failures(self) -> None:
        state = self._host.session.state
        names, failed = state.layout.names, state.failed
        options = tuple(f"{i + 1} ✕" if n in failed else str(i + 1) for i, n in enumerate(names))
        put(self._failures, options=options)
        colors = [
            (css(DEAD), "#fff") if n in failed else (css(fin_color(i)), "#111") for i, n in enumerate(names)
        ]
        put(self._paint, content=button_colors("fl-fails", colors))

    def _sentence(self) -> str:
        """What is left undone, and why."""
        answer, state = self._host.shown, self._host.session.state
        sentence = "" if answer is None else rest_sentence(answer)
        if answer is not None and answer.unknown_fins:
            sentence = f"<span class='missing'>{escape('; '.join(answer.notes))}.</span> {sentence}"
        elif answer is not None and not answer.reachable:
            told = escape("; ".join((*answer.binding, *answer.notes)))
            sentence = f"{sentence} {100 * answer.scale:.0f} % of what is asked, {told}."
        blind = authority_sentence(state.layout, state.failed, self._target.reach)
        return sentence if blind is None else f"<span class='missing'>{blind}</span> {sentence}"
