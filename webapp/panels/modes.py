"""Why one wrench has many answers: the mixture's candidates, and the settings that draw them."""

from functools import partial

import viser

from finlab.allocation.methods import METHODS
from webapp.handles import on_user_change, put
from webapp.markup.modes import MOST_ROWS, mode_table
from webapp.panels.host import Host
from webapp.plots import CandidatePlot
from webapp.state import CANDIDATE_RANGE, GAMMA_RANGE, TEMPERATURE_RANGE
from webapp.words import mode_names


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
        self._plot = CandidatePlot(gui, height=260)
        self._choice = gui.add_dropdown("Show", ("1",), hint="Which candidate moves the fins.")
        on_user_change(self._choice, self._choose)
        self._table = gui.add_html("")

    def _set(self, key: str, value: object) -> None:
        self._host.do(partial(self._host.session.set_setting, key, value))

    def _choose(self, entry: str) -> None:
        index = int(entry.split(" ")[0]) - 1 if entry[:1].isdigit() else 0
        self._host.do(partial(self._host.session.show_candidate, index))

    def refresh(self) -> None:
        """Write settings and candidates."""
        state, best, shown = self._host.session.state, self._host.best, self._host.session.candidate
        put(self._method, value=state.method)
        put(self._count, value=state.n_candidates)
        put(self._temperature, value=state.temperature)
        put(self._gamma, value=state.gamma)
        candidates = None if best is None else best.candidates
        self._plot.refresh(best, shown)
        entries: tuple[str, ...] = ("1 only answer",)
        if candidates is not None and len(candidates.energy):
            entries = tuple(f"{k + 1} {name}" for k, name in enumerate(mode_names(candidates)[:MOST_ROWS]))
        put(self._choice, options=entries)
        put(self._choice, value=entries[min(shown, len(entries) - 1)])
        put(self._table, content=mode_table(candidates, shown))
