"""What this layout can do (attainable sets, the score card), and a search for a better one."""

from collections.abc import Callable
from functools import partial
from typing import Any

import viser
from markupsafe import Markup

from finlab.analysis import Improvement
from webapp.handles import Changes, add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.score_card import score_table
from webapp.markup.words import fins_words, three_digits
from webapp.page import Page
from webapp.panels.damage import FinButtons
from webapp.session.display import DRAWN
from webapp.session.search_request import GOAL_WORDS, WAY, SearchRequest


class ReachPanel:
    """What is drawn, and the card."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        about = (
            "Forces that the fins can give without torque, or torques without force, as a body in the view."
        )
        page.bind_display(gui.add_dropdown("Draw the set of", tuple(DRAWN), hint=about), "drawn")
        self._card = gui.add_html("")
        self._changes = Changes()

    def refresh(self) -> None:
        analyst = self._page.analyst
        if self._changes(analyst.findings, analyst.busy, analyst.error):
            put(self._card, content=self._findings())

    def _findings(self) -> str:
        """The card, and what to know about the drawn set."""
        analyst = self._page.analyst
        found = analyst.findings
        if analyst.error is not None:
            return Markup("<div class='fl missing'>This layout cannot be analysed.</div>")
        if found is None:
            return Markup("<div class='fl dim'>computing …</div>")
        note = Markup("<span class='dim'>computing …</span> ") if analyst.busy else ""
        if found.now is not None:
            unit = "N" if found.now.kind == "force" else "N m"
            gap = three_digits(found.now.gap)
            note += html("<span class='dim'>The body lacks at most {} {} of the true set.</span>", gap, unit)
        table = score_table(found.question.layout, found.card, found.before)
        return html("<div class='fl'>{}</div>{}", note, table)


class ImprovePanel:
    """What to look for, and what was found."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        goals = gui.add_dropdown("Goal", tuple(GOAL_WORDS), hint="What to raise.")
        page.bind(goals, partial(self._draft, SearchRequest.with_goal), lambda: page.session.draft.goal)
        self._fins = FinButtons(
            page,
            "May move",
            "Press a number to hold a fin, or to let it move. Pairs stay pairs.",
            "fl-movers",
            partial(self._draft, SearchRequest.with_held_toggled),
        )
        page.bind_number(
            gui.add_vector3("Reach ± [m]", WAY[:3], step=0.01, hint="Along x, y and z."),
            lambda reach: self._bound((*reach, self._way[3])),
            lambda: self._way[:3],
        )
        hint = "How far its shaft may turn either way."
        page.bind_number(
            gui.add_slider("Turn ± [°]", 0.0, 180.0, 5.0, WAY[3], hint=hint),
            lambda turn: self._bound((*self._way[:3], turn)),
            lambda: self._way[3],
            digits=2,
        )
        stops = "Takes up to a minute; it can be stopped any time."
        offered = "What was found so far is offered."
        self._start = page.add_button("Search", self._search, icon=viser.Icon.SPARKLES, hint=stops)
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = page.add_button(
            "Cancel", page.improver.cancel, icon=viser.Icon.X, visible=False, hint=offered
        )
        self._card = gui.add_html("")
        add_html(gui, marker("fl-verdict"))
        verdicts = {"Accept": self._accept, "Leave": page.improver.forget}
        self._verdict = page.add_buttons("Result", verdicts, visible=False, hint="Accepting can be undone.")

    @property
    def _way(self) -> tuple[float, ...]:
        return self._page.session.draft.way

    def _bound(self, way: tuple[float, ...]) -> None:
        self._draft(SearchRequest.with_way, way)

    def _draft(self, change: Callable[..., SearchRequest], *values: Any) -> None:
        session = self._page.session
        session.set_draft(change(session.draft, *values))

    def _search(self) -> None:
        session = self._page.session
        self._page.improver.start(session.state.layout, session.draft)

    def _accept(self) -> None:
        found = self._page.improver.findings
        self._page.improver.forget()
        if found is not None:
            self._page.session.accept_layout(found.layout)

    def refresh(self) -> None:
        self._refresh_request()
        improver = self._page.improver
        running, progress, found = improver.busy, improver.progress, improver.findings
        put(self._start, disabled=running)
        put(self._bar, visible=running)
        put(self._cancel, visible=running)
        if progress is not None:
            put(self._bar, value=100.0 * progress.round / progress.n_rounds)
        put(self._verdict, visible=found is not None and found.improved)
        text = ""
        if improver.error is not None:
            text = html("<div class='missing'>{}</div>", improver.error)
        elif found is not None:
            text = _before_and_after(found)
        elif progress is not None:
            best, before = (three_digits(abs(v)) for v in (progress.best, progress.before))
            text = html("Best so far <b>{}</b>, {} before, round {}.", best, before, progress.round)
        elif running:
            text = "Searching …"
        put(self._card, content=html("<div class='fl'>{}</div>", text))

    def _refresh_request(self) -> None:
        """Write which fins may move, and how far."""
        names, draft = self._page.session.state.layout.names, self._page.session.draft
        self._fins.refresh(names, held=draft.held)


def _before_and_after(found: Improvement) -> str:
    if not found.improved:
        return "Nothing better was found within reach."
    before, after = (three_digits(abs(v)) for v in (found.value_before, found.value_after))
    goal = next(words for words, name in GOAL_WORDS.items() if name == found.goal)
    stopped = " The search was stopped early." if found.cancelled else ""
    unit = " W" if found.goal == "mission_power" else " N"
    heading = html(
        "<b>{}: {}{} before, {}{} after.</b>{}", goal.capitalize(), before, unit, after, unit, stopped
    )
    moved = fins_words([found.layout.index(name) for name in found.moved]).capitalize()
    table = score_table(found.layout, found.card_after, found.card_before)
    return html("{} {} moved; the view shows them in green, with all fins whole.{}", heading, moved, table)
