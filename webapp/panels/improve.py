"""Improve this layout: choose a goal, watch the search, take or leave what it finds."""

from functools import partial

import viser

from finlab.analysis import Improvement
from finlab.errors import FinlabError
from webapp.figures import listed, three_digits
from webapp.handles import on_user_change, on_user_click, put
from webapp.improving import GOAL_WORDS
from webapp.markup.score_card import score_table
from webapp.panels.host import Host

WHICH = ("all fins", "selected fin")


class ImprovePanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        with gui.add_folder("Improve this layout"):
            self._goal = gui.add_dropdown("Goal", tuple(GOAL_WORDS), hint="What to raise.")
            self._which = gui.add_dropdown("Move", WHICH, hint="Mirror pairs stay mirror pairs.")
            self._reach = gui.add_slider(
                "Reach [cm]", 1.0, 20.0, 1.0, 5.0, hint="How far a fin may go along each axis."
            )
            self._start = gui.add_button("Search", icon=viser.Icon.SPARKLES)
            on_user_click(self._start, lambda: host.do(self._search))
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button("Cancel", icon=viser.Icon.X, visible=False)
            on_user_click(self._cancel, host.improver.cancel)
            self._card = gui.add_html("")
            self._verdict = gui.add_button_group("Result", ("Accept", "Leave"), visible=False)
            on_user_change(self._verdict, self._decide)

    def _search(self) -> None:
        session = self._host.session
        if self._which.value == WHICH[1] and session.selected is None:
            raise FinlabError("no fin is selected; click one, or let all fins move")
        layout = session.state.layout
        fins = (session.selected,) if self._which.value == WHICH[1] and session.selected else layout.names
        self._host.improver.start(layout, fins, self._goal.value, 0.01 * self._reach.value)

    def _decide(self, button: str) -> None:
        improver = self._host.improver
        found = improver.found
        improver.forget()
        if button == "Accept" and found is not None:
            self._host.do(partial(self._host.session.accept_layout, found.layout))
        else:
            self.refresh()

    def refresh(self) -> None:
        """Write how far the search is."""
        improver = self._host.improver
        running, progress, found = improver.running, improver.progress, improver.found
        put(self._start, disabled=running)
        put(self._bar, visible=running)
        put(self._cancel, visible=running)
        if progress is not None:
            put(self._bar, value=100.0 * progress.round / progress.n_rounds)
        put(self._verdict, visible=found is not None)
        text = ""
        if improver.error is not None:
            text = f"<div class='missing'>{improver.error}</div>"
        elif found is not None:
            text = _before_and_after(found)
        elif progress is not None:
            best, before = (three_digits(abs(v)) for v in (progress.best, progress.before))
            text = f"Best so far {best}, {before} before."
        elif running:
            text = "Searching …"
        put(self._card, content=f"<div class='fl'>{text}</div>")


def _before_and_after(found: Improvement) -> str:
    if not found.improved:
        return "Nothing better was found within reach."
    before, after = (three_digits(abs(v)) for v in (found.value_before, found.value_after))
    goal = next(words for words, name in GOAL_WORDS.items() if name == found.goal)
    stopped = " The search was stopped early." if found.cancelled else ""
    heading = f"<b>{goal.capitalize()}: {before} before, {after} after.</b>{stopped}"
    numbers = listed([str(found.layout.index(name) + 1) for name in found.moved])
    table = score_table(found.layout, found.card_after, found.card_before)
    return f"{heading} Fins {numbers} moved; the view shows them as ghosts.{table}"
