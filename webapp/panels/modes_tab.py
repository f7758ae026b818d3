"""Why one wrench has many answers: its modes, the mixture's candidates, and the settings that draw them."""

from functools import partial
from typing import Any

import viser

from finlab.allocation.methods import METHODS
from webapp.handles import Changes, numbered, on_user_change, put
from webapp.markup.modes import SAMPLES, mode_plot, mode_table
from webapp.markup.picking import add_channel, chosen_button, marker
from webapp.markup.words import small, three_digits
from webapp.page import Page
from webapp.panels.line_plot import FIN_LINES, LinePlot
from webapp.session.state import CANDIDATE_RANGE, GAMMA_RANGE, TEMPERATURE_RANGE
from webapp.tasks.solver import STEPS, Densities

TITLES = ("amplitude [°]", "frequency [Hz]", "zero direction [°]")


class ModesTab:
    """Plot, table and settings of the candidates."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        stray, count = "How far draws stray from the mixture's means.", "Draws from the mixture."
        weight = "How much energy counts in the ranking."
        self._settings: dict[str, Any] = {
            "method": gui.add_dropdown("Method", tuple(METHODS), hint="Who answers."),
            "n_candidates": gui.add_slider("Candidates K", *CANDIDATE_RANGE, 1, 64, hint=count),
            "temperature": gui.add_slider("Temperature T", *TEMPERATURE_RANGE, 0.01, 0.02, hint=stray),
            "gamma": gui.add_slider("Energy weight γ", *GAMMA_RANGE, 0.005, 0.01, hint=weight),
        }
        for key, widget in self._settings.items():
            page.on_change(widget, partial(page.session.set_setting, key))
        self._picker = ModePicker(gui, page, 250, "fl-modes")
        self._table = gui.add_html("")
        play = gui.add_button(
            "Play the refinement",
            icon=viser.Icon.PLAYER_PLAY,
            hint="From the best raw candidate, step by step.",
        )
        page.on_click(play, page.playback.start)
        self._step = gui.add_html("")
        self._density = DensityPanel(gui)
        self._changes = Changes()

    def refresh(self) -> None:
        """Write settings and candidates."""
        page, state = self._page, self._page.session.state
        for key, widget in self._settings.items():
            put(widget, value=getattr(state, key))
        self._picker.refresh()
        answering, picker = page.answering, self._picker
        if self._changes(answering.modes, answering.searching, picker.shown):
            table = mode_table(answering.modes, answering.searching, picker.shown, picker.name)
            put(self._table, content=table)
        put(self._step, content=_step_words(page))
        self._density.refresh(None if answering.reply is None else answering.reply.densities)


def _step_words(page: Page) -> str:
    """What is on the robot while it is neither the answer nor one of its modes."""
    frame, sample, shown = page.playback.frame, page.session.sample, page.shown
    if shown is None or (frame is None and sample is None):
        return ""
    if frame is not None:
        words = {0: "Best raw candidate", STEPS + 1: "Answer, the cheapest of all exact ones"}
        text = words.get(frame, f"Step {frame} of {STEPS}")
    else:
        text = f"Raw sample {sample}"
        nearest = page.answering.modes.of_samples
        if nearest is not None and sample is not None and sample < len(nearest):
            text += f", nearest to mode {nearest[sample] + 1}"
    error, energy = small(shown.err_norm), three_digits(shown.energy)
    return f"<div class='fl step'><b>{text}</b>: error {error} σ, energy {energy}</div>"


class ModePicker:
    """Plot and buttons."""

    def __init__(self, gui: viser.GuiApi, page: Page, height: int, name: str) -> None:
        """Build them; `height` of the plot in pixels, `name` marks the buttons on the page."""
        self._page = page
        self._height = height
        self.name = name
        self._changes = Changes()
        self._plot = gui.add_html("")
        add_channel(gui, f"{name}-{SAMPLES}", self._choose_sample)
        self._chosen = gui.add_html(marker(name))
        self._choice = gui.add_button_group(
            "Mode",
            ("1",),
            hint="Which mode moves the fins. A click on a dot does it too, on a small one for a raw sample.",
        )
        on_user_change(self._choice, self._choose)

    def _choose(self, entry: str) -> None:
        index = numbered(entry, len(self._page.answering.modes.shown))
        if index is not None:
            self._page.do(partial(self._page.session.show_mode, index))

    def _choose_sample(self, word: list[str]) -> None:
        best = self._page.answering.best
        count = 0 if best is None or best.samples is None else len(best.samples.energy)
        if word[0].isdecimal() and int(word[0]) < count:
            self._page.do(partial(self._page.session.show_sample, int(word[0])))

    @property
    def shown(self) -> int | None:
        """The mode on the robot; None while a raw sample is."""
        session, modes = self._page.session, self._page.answering.modes.shown
        return None if session.sample is not None else min(session.mode, max(len(modes) - 1, 0))

    def refresh(self) -> None:
        """Write the modes of the newest answer."""
        answering, sample = self._page.answering, self._page.session.sample
        best, modes = answering.best, answering.modes
        if not self._changes(best, modes, self.shown, sample):
            return
        put(self._choice, options=tuple(str(k + 1) for k in range(len(modes.shown))) or ("1",))
        put(self._chosen, content=chosen_button(self.name, self.shown))
        plot = ""
        if best is not None:
            plot = mode_plot(best, modes, self.shown, sample, self._height, self.name)
        put(self._plot, content=plot)


class DensityPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build the plots, empty. The number of lines is fixed: lines without a fin hold no numbers."""
        self._changes = Changes()
        with gui.add_folder("What the network proposes", expand_by_default=False) as self._folder:
            gui.add_html(
                "<div class='fl dim'>How likely each command is, in the fin's colour; every curve has its "
                "highest point at the top.</div>"
            )
            # Fins that do the same have the same curve: each next line is thinner, so that all are seen.
            self._plots = [
                LinePlot(gui, FIN_LINES, "", title, height=112, widths=(6.0, 4.5, 3.0, 1.5), visible=True)
                for title in TITLES
            ]

    def refresh(self, densities: Densities | None) -> None:
        """Draw densities, or hide the plots where the method has none."""
        put(self._folder, visible=densities is not None)
        if densities is None or not self._changes(densities):
            return
        for k, plot in enumerate(self._plots):
            plot.draw(densities.places[k], list(densities.curves[:, k]), (0.0, 1.08))
