"""Why one wrench has many answers: the modes, and where they come from."""

from functools import partial

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.handles import add_html
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
DRAWS = (
    ("n_candidates", "Candidates K", (4, 256), 1.0, 0, "Draws from the mixture."),
    ("temperature", "Temperature T", (0.0, 2.0), 0.01, 4, "How far draws stray from the mixture's means."),
    ("gamma", "Effort weight γ", (0.0, 1.0), 0.005, 4, "How much effort counts in the ranking."),
)
"""Settings of drawing: key, label, ends, step, digits, hint."""

PLOT_PX = 176
"""Height of the plot [px]."""


def add_candidates(page: Page) -> None:
    """Plot and table, and what is drawn from a mixture."""
    session, gui = page.session, page.gui
    page.add_html(lambda modes, mode: mode_plot(modes, mode, PLOT_PX))
    page.presses.on(
        "mode",
        lambda key, _held: session.show_mode(placed(key, len(page.jobs.answering.modes.shown))),
    )
    with gui.add_folder("Draws from the mixture") as draws:
        for key, label, ends, step, digits, hint in DRAWS:
            slider = gui.add_slider(label, ends[0], ends[1], step, DRAWN[key], hint=hint)
            # What the widget shows at first, while the method has none of the kind.
            value = partial(_setting, key)
            page.bind_number(slider, partial(session.set_setting, key), value, digits)
            page.board.show(slider, visible=lambda state, key=key: key in state.drawing)
    page.board.show(draws, visible=lambda state: bool(state.drawing))
    add_html(gui, marker("fl-column"))
    page.add_html(mode_table)
    page.add_html(_origin_words)


def _setting(key: str, state: State) -> float:
    return float(state.drawing.get(key, DRAWN[key]))


def _origin_words(layout: Layout, method: str, best: Allocation | None) -> str:
    """Where the answer and its modes come from, or why there is but one."""
    exact = best is None or best.reachable
    said = ORIGINS.get(method, (ONE if exact else BEYOND).format(method))
    return html("<div class='fl dim'>{}</div>", said if layout.is_of_fins else UNKNOWN)


def placed(key: str, count: int) -> int:
    """The place that a page names, of `count`.

    Raises:
        FinlabError: there is no such place.
    """
    if not key.isdecimal() or len(key) > 6 or int(key) >= count:
        raise FinlabError("that one is gone")
    return int(key)
