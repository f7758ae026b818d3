"""Why one wrench has many answers: the mixture's candidates, and the settings that draw them."""

from functools import partial

import viser

from finlab.allocation.methods import METHODS
from webapp.figures import small
from webapp.handles import on_user_change, on_user_click, put
from webapp.markup.modes import mode_table
from webapp.panels.density import DensityPanel
from webapp.panels.host import Host
from webapp.panels.mode_picker import ModePicker
from webapp.refinement import STEPS
from webapp.state import CANDIDATE_RANGE, GAMMA_RANGE, TEMPERATURE_RANGE


class ModesPanel:
    """Plot, table and settings of the candidates."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._method = gui.add_dropdown("Method", tuple(METHODS), hint="Who answers.")
        self._count = gui.add_slider("Candidates K", *CANDIDATE_RANGE, 1, 64, hint="Draws from the mixture.")
        self._temperature = gui.add_slider(
            "Temperature T",
            *TEMPERATURE_RANGE,
            0.01,
            0.02,
            hint="How far draws stray from the mixture's means.",
        )
        self._gamma = gui.add_slider(
            "Energy weight γ", *GAMMA_RANGE, 0.005, 0.01, hint="How much energy counts in the ranking."
        )
        for key, widget in (
            ("method", self._method),
            ("n_candidates", self._count),
            ("temperature", self._temperature),
            ("gamma", self._gamma),
        ):
            on_user_change(widget, partial(self._set, key))
        self._picker = ModePicker(gui, host, 250, "fl-modes")
        self._table = gui.add_html("")
        self._play = gui.add_button(
            "Play the refinement",
            icon=viser.Icon.PLAYER_PLAY,
            hint="From the best raw candidate, step by step.",
        )
        on_user_click(self._play, lambda: host.do(host.play_refinement))
        self._step = gui.add_html("")
        self._density = DensityPanel(gui)

    def _set(self, key: str, value: object) -> None:
        self._host.do(partial(self._host.session.set_setting, key, value))

    def refresh(self) -> None:
        """Write settings and candidates."""
        host, state = self._host, self._host.session.state
        put(self._method, value=state.method)
        put(self._count, value=state.n_candidates)
        put(self._temperature, value=state.temperature)
        put(self._gamma, value=state.gamma)
        self._picker.refresh()
        candidates = None if host.best is None else host.best.candidates
        put(self._table, content=mode_table(candidates, host.modes, self._picker.shown, self._picker.name))
        put(self._step, content=_step_words(host))
        self._density.refresh(host.densities)


def _step_words(host: Host) -> str:
    """Where the refinement stands while it is played."""
    if host.frame is None or host.shown is None:
        return ""
    words = {0: "Best raw candidate", STEPS + 1: "Answer, the cheapest of all exact ones"}
    text = words.get(host.frame, f"Step {host.frame} of {STEPS}")
    return f"<div class='fl step'><b>{text}</b>: error {small(host.shown.err_norm)} σ</div>"
