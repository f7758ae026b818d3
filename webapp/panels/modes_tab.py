"""Why one wrench has many answers: the modes, and where they come from."""

from functools import partial

import viser

from webapp.handles import Changes, numbered, on_user_change, put
from webapp.markup.mode_plot import SAMPLES, mode_plot
from webapp.markup.modes import mode_table
from webapp.markup.picking import add_channel, chosen_button, marker
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


class CandidatesPanel:
    """Plot and table, and what is drawn from a mixture."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        stray, count = "How far draws stray from the mixture's means.", "Draws from the mixture."
        weight = "How much effort counts in the ranking."
        session = page.session
        self._picker = ModePicker(gui, page, 176, "fl-modes")
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

    def refresh(self) -> None:
        """Write settings and candidates."""
        page, state = self._page, self._page.session.state
        put(self._origin, content=f"<div class='fl dim'>{_origin_words(state.method)}</div>")
        drawing = state.drawing
        put(self._draws, visible=bool(drawing))
        for key, widget in self._settings.items():
            put(widget, visible=key in drawing)
        self._picker.refresh()
        answering, picker = page.answering, self._picker
        table = mode_table(answering.modes, answering.searching, picker.shown, picker.name)
        put(self._table, content=table)
        put(self._sample, content=_sample_words(page))
        answer, modes = answering.best, answering.modes
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
