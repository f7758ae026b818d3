"""Why one wrench has many answers: the mixture's candidates, and the settings that draw them."""

from functools import partial

import viser

from finlab.allocation.methods import METHODS
from webapp.handles import Changes, on_user_change, on_user_click, put
from webapp.markup.figures import small, three_digits
from webapp.markup.mode_table import mode_table
from webapp.panels.density import DensityPanel
from webapp.panels.host import Host
from webapp.panels.mode_picker import ModePicker
from webapp.session.state import CANDIDATE_RANGE, GAMMA_RANGE, TEMPERATURE_RANGE
from webapp.tasks.refinement import STEPS


class ModesTab:
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
        on_user_click(self._play, lambda: host.do(host.playback.start))
        self._step = gui.add_html("")
        self._density = DensityPanel(gui)
        self._changes = Changes()

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
        answering, picker = host.answering, self._picker
        if self._changes(answering.modes, answering.searching, picker.shown):
            table = mode_table(answering.modes, answering.searching, picker.shown, picker.name)
            put(self._table, content=table)
        put(self._step, content=_step_words(host))
        self._density.refresh(None if answering.reply is None else answering.reply.densities)


def _step_words(host: Host) -> str:
    """What is on the robot while it is neither the answer nor one of its modes."""
    frame, sample, shown = host.playback.frame, host.session.sample, host.shown
    if shown is None or (frame is None and sample is None):
        return ""
    if frame is not None:
        words = {0: "Best raw candidate", STEPS + 1: "Answer, the cheapest of all exact ones"}
        text = words.get(frame, f"Step {frame} of {STEPS}")
    else:
        text = f"Raw sample {sample}"
        nearest = host.answering.modes.of_samples
        if nearest is not None and sample is not None and sample < len(nearest):
            text += f", nearest to mode {nearest[sample] + 1}"
    error, energy = small(shown.err_norm), three_digits(shown.energy)
    return f"<div class='fl step'><b>{text}</b>: error {error} σ, energy {energy}</div>"
