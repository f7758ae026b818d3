"""Why one wrench has many answers: the modes, and where they come from."""

from functools import partial

import viser

from finlab.errors import FinlabError
from webapp.handles import Changes, add_html, put
from webapp.markup.html import html
from webapp.markup.mode_plot import mode_plot
from webapp.markup.modes import mode_table
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.session.state import State

ORIGINS = {
    "mdn": "A network proposes ways to share the wrench, drawn from its mixture; each is followed to the "
    "least effort near it and made exact by the fins' own laws. A mode names the components that led to it.",
    "paper": "The paper's network draws candidates; the best are refined by Adam on a learned surrogate, "
    "which leaves an error.",
}
"""Where the answer and its modes come from, by method."""
ONE = "Method {} has one answer, number 1. The others are a network's, for least effort, each made exact."
"""What is said of a method without candidates."""
BEYOND = (
    "Method {} has one answer. Where the wrench is not delivered whole, the network is not asked beside it."
)
"""The same where there is nothing to compare."""
UNKNOWN = "The network knows fins alone, so it proposes nothing for this robot."
"""What is said of a robot with other actuators."""
DRAWN = {"n_candidates": 64.0, "temperature": 0.02, "gamma": 0.01}
"""What the widgets of drawing show at first."""

PLOT_PX = 176
"""Height of the plot [px]."""


class CandidatesPanel:
    """Plot and table, and what is drawn from a mixture."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        stray, count = "How far draws stray from the mixture's means.", "Draws from the mixture."
        weight = "How much effort counts in the ranking."
        session = page.session
        self._plot, self._plotted = gui.add_html(""), Changes()
        page.presses.on("mode", lambda key, _held: session.show_mode(placed(key, self._modes)))
        with gui.add_folder("Draws from the mixture") as self._draws:
            self._settings = {
                key: page.bind_number(
                    gui.add_slider(label, ends[0], ends[1], step, DRAWN[key], hint=hint),
                    partial(session.set_setting, key),
                    partial(self._setting, key),
                    digits,
                )
                for key, label, ends, step, digits, hint in (
                    ("n_candidates", "Candidates K", (4, 256), 1.0, 0, count),
                    ("temperature", "Temperature T", (0.0, 2.0), 0.01, 4, stray),
                    ("gamma", "Effort weight γ", (0.0, 1.0), 0.005, 4, weight),
                )
            }
        add_html(gui, marker("fl-column"))
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
    def _shown(self) -> int:
        """The mode on the robot."""
        return min(self._page.session.mode, max(self._modes - 1, 0))

    def refresh(self) -> None:
        page, state = self._page, self._page.session.state
        exact = page.answering.best is None or page.answering.best.reachable
        put(self._origin, content=html("<div class='fl dim'>{}</div>", _origin_words(state, exact)))
        drawing = state.drawing
        put(self._draws, visible=bool(drawing))
        for key, widget in self._settings.items():
            put(widget, visible=key in drawing)
        answering, shown = page.answering, self._shown
        put(self._table, content=mode_table(answering.modes, answering.searching, shown))
        modes = answering.modes
        if self._plotted(modes, shown):
            put(self._plot, content=mode_plot(modes, shown, PLOT_PX))


def _origin_words(state: State, exact: bool) -> str:
    """Where the answer and its modes come from, or why there is but one."""
    if not state.layout.is_of_fins:
        return UNKNOWN
    return ORIGINS.get(state.method, (ONE if exact else BEYOND).format(state.method))


def placed(key: str, count: int) -> int:
    """The place that a page names, of `count`.

    Raises:
        FinlabError: there is no such place.
    """
    if not key.isdecimal() or len(key) > 6 or int(key) >= count:
        raise FinlabError("that one is gone")
    return int(key)
