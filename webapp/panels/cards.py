"""Panels that are nothing but markup, written from the page whenever that changes."""

from collections.abc import Callable

import viser
from markupsafe import Markup

from finlab.analysis.score_card import quick_check
from webapp.handles import put
from webapp.markup.answer import wrench_bars
from webapp.markup.guide_cards import lesson_card, tour_card
from webapp.markup.html import html
from webapp.markup.score_card import check_card, warnings
from webapp.markup.verdict import answer_sentence
from webapp.page import Page
from webapp.presses import press
from webapp.scene.robot_scene import CAMERAS
from webapp.session.looking import TASKS


class Card:
    """What `written` makes of the page."""

    def __init__(self, written: Callable[[Page], str], gui: viser.GuiApi, page: Page) -> None:
        self._written, self._page, self._content = written, page, gui.add_html("")

    def refresh(self) -> None:
        put(self._content, content=self._written(self._page))


def robot_name(page: Page) -> str:
    """The robot's name, and whether it has been changed since it was opened or saved."""
    layout = page.session.state.layout
    changed = "" if layout == page.session.saved else Markup("<span class='dim'>edited</span>")
    return html("<div class='fl-robot' title='{}'><h1>{}</h1>{}</div>", layout.name, layout.name, changed)


def tasks(page: Page) -> str:
    """What is being done: one of four tasks."""
    here = page.session.task
    buttons = (
        html("<button {}{}>{}</button>", "aria-current=page " * (task == here), press("task", task), task)
        for task in TASKS
    )
    return html("<nav class='fl-tasks' aria-label='Tasks'>{}</nav>", buttons)


def guide(page: Page) -> str:
    """The card of the tour or of a lesson, whichever is under way."""
    session = page.session
    if session.lesson is not None:
        return lesson_card(session.lesson, session.solved)
    return "" if session.stop is None else tour_card(session.stop)


def check(page: Page) -> str:
    """What can be said of a layout at once: its axes, what a failure costs, what looks like a mistake."""
    state = page.session.state
    quick = quick_check(state.able, state.failed)
    return check_card(quick, len(state.healthy) > 1, warnings(state.layout))


def answer(page: Page) -> str:
    """What is asked, what the fins give, and what is left undone; an answer to an earlier question stands
    beside what was asked then."""
    shown, state, busy = page.shown, page.session.state, page.busy
    asked = shown.target if shown is not None and busy else state.target
    return wrench_bars(asked, None if shown is None else shown.wrench, answer_sentence(state, shown, busy))


def camera(_page: Page) -> str:
    """Sides to look from, and framing."""
    looks = (
        html("<button {} title='{}'>{}</button>", press("look", name), key, name)
        for key, name in enumerate(CAMERAS, 1)
    )
    hint = "what is selected fills the view (F)"
    frame = html("<button {} title='{}'>Frame</button>", press("frame", ""), hint)
    return html("<div class='fl fl-camera'>{}{}</div>", looks, frame)
