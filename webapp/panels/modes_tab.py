"""Why one wrench has many answers: the modes, and where they come from."""

from functools import partial

import viser

from finlab.errors import FinlabError
from webapp.handles import Changes, put
from webapp.markup.mode_plot import mode_plot
from webapp.markup.modes import mode_table
from webapp.markup.picking import marker
from webapp.markup.proposals import proposal_discs
from webapp.markup.words import error_digits, three_digits
from webapp.page import Page
from webapp.session.state import CANDIDATE_RANGE, GAMMA_RANGE, TEMPERATURE_RANGE, knows_objective

ORIGINS = {
    "search": "The search knows each fin's own law and draws nothing. It begins with all fins at work and, "
    "for other ways, with some of them at rest.",
    "mdn": "A network proposes ways to share the wrench, drawn from its mixture; the search, by the fins' "
    "own laws, takes each to its exact end. A mode names the components that led to it; all others are the "
    "wider search's alone.",
    "paper": "The paper's network draws candidates; the best are refined by Adam on a learned surrogate, "
    "which leaves an error.",
}
"""Where the answer and its modes come from, by method."""
DRAWN = {"n_candidates": 64.0, "temperature": 0.02, "gamma": 0.01}
"""What the widgets of drawing show at first."""

PLOT_PX = 176
"""Height of the plot [px]."""


class CandidatesPanel:
    """Plot and table, and what is drawn from a mixture."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        stray, count = "How far draws stray from the mixture's means.", "Draws from the mixture."
        weight = "How much effort counts in the ranking."
        session = page.session
        self._plot, self._plotted = gui.add_html(""), Changes()
        page.editables.on_press("mode", lambda key, _held: session.show_mode(placed(key, self._modes)))
        page.editables.on_press("sample", lambda key, _held: session.show_sample(placed(key, self._samples)))
        self._sample = gui.add_html("")
        with gui.add_folder("Draws from the mixture") as self._draws:
            self._settings = {
                key: page.bind_number(
                    gui.add_slider(label, ends[0], ends[1], step, DRAWN[key], hint=hint),
                    partial(session.set_setting, key),
                    partial(self._setting, key),
                    digits,
                )
                for key, label, ends, step, digits, hint in (
                    ("n_candidates", "Candidates K", CANDIDATE_RANGE, 1.0, 0, count),
                    ("temperature", "Temperature T", TEMPERATURE_RANGE, 0.01, 4, stray),
                    ("gamma", "Effort weight γ", GAMMA_RANGE, 0.005, 4, weight),
                )
            }
        self._drawn = Changes()
        with gui.add_folder("What the network proposes", expand_by_default=False) as self._proposals:
            self._discs = gui.add_html("")
        gui.add_html(marker("fl-column"))
        self._table = gui.add_html("")
        self._origin = gui.add_html("")

    def _setting(self, key: str) -> float:
        """A setting in force; what the widget shows at first while the method has none of the kind."""
        return float(self._page.session.state.drawing.get(key, DRAWN[key]))

    @property
    def _modes(self) -> int:
        """How many modes there are."""
        return len(self._page.answering.modes.shown)

    @property
    def _samples(self) -> int:
        """How many samples there are."""
        best = self._page.answering.best
        return 0 if best is None or best.samples is None else len(best.samples.energy)

    @property
    def _shown(self) -> int | None:
        """The mode on the robot; None while a raw sample is."""
        session = self._page.session
        return None if session.sample is not None else min(session.mode, max(self._modes - 1, 0))

    def refresh(self) -> None:
        """Write settings and candidates."""
        page, state = self._page, self._page.session.state
        put(self._origin, content=f"<div class='fl dim'>{_origin_words(state.method)}</div>")
        drawing = state.drawing
        put(self._draws, visible=bool(drawing))
        for key, widget in self._settings.items():
            put(widget, visible=key in drawing)
        answering, shown = page.answering, self._shown
        put(self._table, content=mode_table(answering.modes, answering.searching, shown))
        put(self._sample, content=_sample_words(page))
        answer, modes, sample = answering.best, answering.modes, page.session.sample
        if self._plotted(answer, modes, shown, sample):
            plot = "" if answer is None else mode_plot(answer, modes, shown, sample, PLOT_PX)
            put(self._plot, content=plot)
        put(self._proposals, visible=answer is not None and answer.samples is not None)
        if answer is not None and self._drawn(answer, modes):
            put(self._discs, content=proposal_discs(answer, modes))


def _origin_words(method: str) -> str:
    """Where the answer and its modes come from, and what is kept least where the user has no say in it."""
    words = ORIGINS.get(method, "One answer by optimization over the fins' own laws; no candidates.")
    return words if knows_objective(method) else f"{words} It keeps effort least whatever is chosen."


def _sample_words(page: Page) -> str:
    """Which raw sample is on the robot, and what the fins make of it."""
    sample, shown = page.session.sample, page.shown
    if sample is None or shown is None:
        return ""
    error, power, effort = error_digits(shown.err_norm), three_digits(shown.power), three_digits(shown.energy)
    return (
        f"<div class='fl step'><b>Raw sample {sample}{_component_words(page, sample)}</b>: "
        f"error {error} σ, power {power} W, effort {effort}</div>"
    )


def _component_words(page: Page, sample: int) -> str:
    """Of which component a raw sample is, and to which mode that led."""
    answer, led = page.answering.best, page.answering.modes.of_samples
    if answer is None or answer.samples is None or led is None or not sample < len(led):
        return ""
    source = answer.samples.source[sample]
    if not source.startswith("component "):
        return ""
    return f" of {source}, which led to mode {led[sample] + 1}" if led[sample] >= 0 else f" of {source}"


def placed(key: str, count: int) -> int:
    """The place that a page names, of `count`.

    Raises:
        FinlabError: there is no such place.
    """
    if not key.isdecimal() or len(key) > 6 or int(key) >= count:
        raise FinlabError("that one is gone")
    return int(key)
