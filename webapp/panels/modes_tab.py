"""Why one wrench has many answers: the modes, and where they come from."""

from functools import partial

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.markup.mode_plot import mode_plot
from webapp.markup.words import error_digits, source_words, three_digits
from webapp.page import Page
from webapp.presses import press
from webapp.session.state import DRAWING, State
from webapp.tasks.mode_names import Modes
from webapp.theme import css, mode_color

ORIGINS = {
    "mdn": "A network proposes ways to share the wrench, drawn from its mixture; each is followed to the "
    "least effort near it and made exact by the fins' own laws. A mode names the components that led to it.",
    "paper": "The paper's network draws candidates; the best are refined by Adam on a learned surrogate, "
    "which leaves an error.",
}
ONE = "Method {} has one answer, number 1. The others are a network's, for least effort, each made exact."
BEYOND = (
    "Method {} has one answer. Where the wrench is not delivered whole, the network is not asked beside it."
)
UNKNOWN = "The network knows fins alone, so it proposes nothing for this robot."
PLOT_PX = 176
"""Height of the plot [px]."""


def add_candidates(page: Page) -> None:
    """Plot and table, and what is drawn from a mixture."""
    session, gui = page.session, page.gui
    page.add_html(lambda modes, mode: mode_plot(modes, mode, PLOT_PX))
    page.presses.on(
        "mode", lambda key, _held: session.show_mode(placed(key, len(page.jobs.answering.modes.shown)))
    )
    hint = "How far draws stray from the mixture's means."
    slider = gui.add_slider("Temperature", 0.0, 2.0, 0.01, 0.0, hint=hint)
    page.bind_number(slider, partial(session.set_setting, "temperature"), _temperature)
    page.board.show(slider, visible=lambda method: method in DRAWING)
    add_html(gui, marker("fl-column"))
    page.add_html(mode_table)
    page.add_html(_origin_words)


def _temperature(state: State) -> float:
    """That in force."""
    own = DRAWING.get(state.method, DRAWING["mdn"]).temperature
    return own if state.temperature is None else state.temperature


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


def mode_table(modes: Modes, searching: bool, mode: int) -> str:
    """Name and origin, error, power, effort and use of the limits of each mode.

    Args:
        modes: an answer's modes.
        searching: whether more may be found.
        mode: which of them moves the fins.
    """
    if not modes.shown:
        return ""
    rows = []
    for k, (way, name) in enumerate(modes.shown):
        kind = "chosen" if k == mode else ""
        origin = html("<div class='dim'>{}</div>", source_words(way.sources))
        rows.append(
            html(
                "<tr class='{} pick' {} tabindex='0'><td>{}</td><td class='words'>{}{}</td><td>{}"
                "</td><td>{}</td><td>{}</td><td>{:.0f} %</td></tr>",
                kind,
                press("mode", str(k)),
                _swatch(k),
                name,
                origin,
                error_digits(way.err_norm),
                three_digits(way.power),
                three_digits(way.effort),
                100 * way.saturation,
            )
        )
    header = Markup(
        "<tr><th>#</th><th class='words'>mode</th><th>error</th><th>power&nbsp;[W]</th><th>effort</th>"
        "<th title='largest share of a range of amplitude or frequency that is used'>used</th></tr>"
    )
    left = modes.count - len(modes.shown)
    told = "looking for more …" if searching else f"{left} more are known; they come after these."
    more = html("<div class='said dim'>{}</div>", told) if searching or left > 0 else ""
    return html("<div class='fl'><table class='modes'>{}{}</table>{}</div>", header, rows, more)


def _swatch(k: int) -> str:
    return html("<span class='swatch mode' style='border-color:{}'>{}</span>", css(mode_color(k)), k + 1)
