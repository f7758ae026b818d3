"""Tab on a layout's limits (attainable sets, the score card), and a search for a better layout."""

from collections.abc import Callable
from functools import partial
from typing import Any

import viser
from markupsafe import Markup

from finlab.analysis import Improvement, Progress
from finlab.analysis.improvement_text import goal_value, improvement_remarks
from finlab.forces.within_budget import leaves_budget_out
from webapp.handles import add_html
from webapp.markup.score_card import remarks_markup, score_table
from webapp.markup.words import fins_words, html, marker, three_digits
from webapp.page import Page
from webapp.panels.damage import add_fin_buttons
from webapp.session.looking import (
    DRAWN,
    GOALS_BY_WORDS,
    MOVE_RANGE,
    MoveRange,
    SearchRequest,
    most_reach,
)
from webapp.tasks.analysing import Analysis


def add_reach(page: Page) -> None:
    """What is drawn, and the card."""
    hint = (
        "Forces that it can give without torque, or torques without force, as a body in the view."
    )
    sets = page.gui.add_dropdown("Draw the set of", tuple(DRAWN), hint=hint)
    page.bind(sets, partial(page.session.set_display, "drawn"), lambda display: display.drawn)
    page.add_html(_analysis_card)


def _analysis_card(
    analysis: Analysis | None, is_analysing: bool, analysis_error: str | None
) -> str:
    """What a layout can do, or why that is not known."""
    if analysis_error is not None:
        return Markup("<div class='fl missing'>This layout cannot be analysed.</div>")
    if analysis is None:
        return Markup("<div class='fl dim'>computing …</div>")
    note = Markup("<span class='dim'>computing …</span> ") if is_analysing else ""
    if analysis.now is not None:
        unit = "N" if analysis.now.kind == "force" else "N m"
        gap = three_digits(analysis.now.gap)
        note += html(
            "<span class='dim'>The body lacks at most {} {} of the true set.</span>", gap, unit
        )
    layout = analysis.question.layout
    if leaves_budget_out(layout, analysis.question.flow):
        note += Markup(
            "<span class='dim'>The power budget does not count here: the flow drives "
            "actuators.</span>"
        )
    table = score_table(layout, analysis.card, analysis.before)
    return html("<div class='fl'>{}</div>{}", note, table)


def add_improving(page: Page) -> None:
    """What to look for, and what was found."""
    session = page.session
    gui = page.gui
    board = page.board
    improver = page.jobs.improver

    def change(how: Callable[..., SearchRequest], *values: Any) -> None:
        session.draft = how(session.draft, *values)

    def bound(move_range: tuple[float, ...]) -> None:
        change(SearchRequest.with_move_range, move_range, most_reach(session.state.layout))

    def range_now() -> MoveRange:
        return session.draft.range_of(session.state.layout)

    def accept() -> None:
        result = improver.answer
        improver.forget()
        if result is not None:
            session.accept_layout(result.layout)

    def compare() -> None:
        if improver.proposal is not None:
            session.two_robots.show_proposal(improver.proposal)

    goals = gui.add_dropdown("Goal", tuple(GOALS_BY_WORDS), hint="What to raise.")
    page.bind(goals, partial(change, SearchRequest.with_goal), lambda draft: draft.goal)
    add_fin_buttons(
        page,
        "May move",
        "Press a number to hold one, or to let it move. Pairs stay pairs.",
        "fl-movers",
        partial(change, SearchRequest.with_fixed_toggled),
        lambda layout, draft, lost: (layout.names, lost, draft.fixed),
    )
    reach_box = gui.add_vector3("Reach ± [m]", MOVE_RANGE[:3], step=0.01, hint="Along x, y and z.")
    page.bind_number(
        reach_box,
        lambda reach: bound((*reach, range_now()[3])),
        lambda draft, layout: draft.range_of(layout)[:3],
    )
    hint = "How far each may turn either way; what is not kept level rises and falls, too."
    page.bind_number(
        gui.add_slider("Turn ± [°]", 0.0, 180.0, 5.0, MOVE_RANGE[3], hint=hint),
        lambda turn: bound((*range_now()[:3], turn)),
        lambda draft, layout: draft.range_of(layout)[3],
        digits=2,
    )
    add_html(gui, marker("fl-primary"))
    search = page.add_button(
        "Search",
        lambda: improver.start(session.state, session.draft),
        icon=viser.Icon.SPARKLES,
        hint="Seconds for eight actuators, longer in a flow. The view shows the best so far.",
    )
    board.show(search, disabled=lambda improving: improving)
    bar = gui.add_progress_bar(0.0, visible=False)
    board.show(
        bar, value=lambda progress: 100.0 * progress.round / progress.n_rounds if progress else 0.0
    )
    offered = "What was found so far is offered."
    cancel = page.add_button(
        "Cancel", improver.stop, icon=viser.Icon.X, visible=False, hint=offered
    )
    for handle in (bar, cancel):
        board.show(handle, visible=lambda improving: improving)
    add_html(gui, marker("fl-verdict"))
    verdicts = {"Accept": accept, "Compare": compare, "Leave": improver.forget}
    verdict = page.add_buttons(
        "Result",
        verdicts,
        visible=False,
        hint="Accepting can be undone; to compare is to see both.",
    )
    board.show(
        verdict, visible=lambda improvement: improvement is not None and improvement.improved
    )
    add_html(gui, marker("fl-column"))
    page.add_html(_searched)


def _searched(
    improvement: Improvement | None,
    progress: Progress | None,
    improving: bool,
    improvement_error: str | None,
    bounded: Improvement | None,
    bounding: bool,
    draft: SearchRequest,
) -> str:
    """What a search has found, or how far it is."""
    text = "Searching …" if improving else ""
    if improvement_error is not None:
        text = html("<div class='missing'>{}</div>", improvement_error)
    elif improvement is not None:
        note = Markup("<span class='dim'>how far from the best: computing …</span> ")
        text = (note if bounding else Markup()) + _before_and_after(bounded or improvement)
    elif progress is not None:
        goal = GOALS_BY_WORDS[draft.goal]
        best = goal_value(goal, progress.best)
        before = goal_value(goal, progress.before)
        text = html("Best so far <b>{}</b>, {} before, round {}.", best, before, progress.round)
    return html("<div class='fl'>{}</div>", text)


def _before_and_after(result: Improvement) -> str:
    """What was found, in sentences, and the score cards before and after; the view shows where the
    actuators went, which the command line prints as a table."""
    sentences = remarks_markup(improvement_remarks(result))
    if not result.improved:
        return sentences
    indices = [result.layout.index(name) for name in result.moved]
    moved = fins_words(indices, result.layout).capitalize()
    table = score_table(result.layout, result.card_after, result.card_before)
    return html("{} {} moved; the view shows them as shadows.{}", sentences, moved, table)
