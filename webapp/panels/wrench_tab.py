"""The question and its answer: target wrench, failures, bars, and the table of commands."""

from functools import partial
from html import escape

import viser

from webapp.handles import put
from webapp.markup.bars import wrench_bars
from webapp.markup.fins import fin_table
from webapp.markup.words import authority_sentence, rest_sentence
from webapp.panels.damage import DamagePanel
from webapp.panels.fin_buttons import FinButtons
from webapp.panels.host import Host
from webapp.panels.mode_picker import ModePicker
from webapp.panels.pilot import PilotPanel
from webapp.panels.sweep import SweepPanel
from webapp.panels.target import TargetPanel
from webapp.session.targets import full_thrust


class WrenchTab:
    """Target sliders with what comes of them below."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._target = TargetPanel(gui, host)
        self._failures = FinButtons(
            gui,
            "Fail a fin",
            "Press a number to fail or repair a fin; F does it to the selected one.",
            "fl-fails",
            lambda name: host.do(partial(host.session.toggle_failure, name)),
        )
        self._bars = gui.add_html("")
        self._table = gui.add_html("")
        self._picker = ModePicker(gui, host, 150, "fl-wrench-modes")
        self._damage = DamagePanel(gui, host)
        self._pilot = PilotPanel(gui, host, self._target)
        self._sweep = SweepPanel(gui, host)

    def refresh(self) -> None:
        """Write target, failures and answer."""
        host, state = self._host, self._host.session.state
        self._target.refresh()
        self._failures.refresh(state.layout.names, state.failed)
        self._picker.refresh()
        self._damage.refresh()
        self._pilot.refresh()
        self._sweep.refresh()
        answer = host.shown
        given = None if answer is None else answer.wrench
        put(self._bars, content=wrench_bars(state.target, given, self._sentence()))
        fitting = answer if answer is not None and answer.layout.names == state.layout.names else None
        put(self._table, content=fin_table(state, fitting, full_thrust(state.able), host.session.selected))

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
