"""Panels that are nothing but markup: functions of what there is to show."""

from collections.abc import Callable

import numpy as np
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.analysis.score_card import quick_check
from finlab.layout import Layout
from webapp.markup.answer import wrench_bars
from webapp.markup.html import html
from webapp.markup.score_card import check_card, warnings
from webapp.markup.verdict import answer_sentence
from webapp.markup.words import righting_sentences
from webapp.page import Page
from webapp.presses import press
from webapp.scene.robot_scene import CAMERAS
from webapp.session.lessons import LESSONS, TOUR, Stop
from webapp.session.looking import TASKS
from webapp.session.state import Flow, State

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction, propellers stand (P)."),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme."),
}
"""Field of `Display`, label and hint of each switch."""


def card(written: Callable[..., str]) -> Callable[[Page], object]:
    """A panel of what `written` makes of the facts."""
    return lambda page: page.add_html(written)


def robot_name(layout: Layout, saved: Layout) -> str:
    """The robot's name, and whether it has been changed since it was opened or saved."""
    changed = "" if layout == saved else Markup("<span class='dim'>edited</span>")
    return html("<div class='fl-robot' title='{}'><h1>{}</h1>{}</div>", layout.name, layout.name, changed)


def tasks(task: str) -> str:
    """What is being done: one of four tasks."""
    buttons = (
        html(
            "<button {}{}>{}</button>",
            Markup("aria-current=page ") * (name == task),
            press("task", name),
            name,
        )
        for name in TASKS
    )
    return html("<nav class='fl-tasks' aria-label='Tasks'>{}</nav>", buttons)


def check(able: Layout, failed: tuple[str, ...], layout: Layout, flow: Flow | None) -> str:
    """What can be said of a layout at once: its axes, what a failure costs, what looks like a mistake."""
    told = (*warnings(layout), *righting_sentences(layout))
    return check_card(quick_check(able, failed, flow), layout.n - len(failed) > 1, told)


def add_answer(page: Page) -> None:
    """What is asked, what the actuators give, and what is left undone; an answer to an earlier question
    stands beside what was asked then."""
    page.add_html(_bars)
    page.add_html(_said)


def _bars(shown: Allocation | None, target: tuple[float, ...], layout: Layout, busy: bool) -> str:
    asked = shown.target if shown is not None and busy else np.where(layout.commanded, target, np.nan)
    return wrench_bars(asked, None if shown is None else shown.wrench)


def _said(shown: Allocation | None, state: State, busy: bool, searching: bool, step: int | None) -> str:
    said = answer_sentence(state, shown, busy, searching or step is not None)
    return html("<div class='fl'><div class='said'>{}</div></div>", said)


def camera() -> str:
    """Sides to look from, and framing."""
    looks = (
        html("<button {} title='{}'>{}</button>", press("look", name), key, name)
        for key, name in enumerate(CAMERAS, 1)
    )
    hint = "what is selected fills the view (F)"
    frame = html("<button {} title='{}'>Frame</button>", press("frame", ""), hint)
    return html("<div class='fl fl-camera'>{}{}</div>", looks, frame)


def guide_card(stop: Stop | None, solved: bool) -> str:
    """Title and text, and an exercise with praise once that is done; nothing outside of tour and lessons."""
    if stop is None:
        return ""
    course = TOUR if stop in TOUR else LESSONS
    place, last = course.index(stop) + 1, len(course)
    kind, title, parts = "tour", f"{place} of {last} · {stop.title}", [html("<p>{}</p>", stop.text)]
    if stop.exercise:
        kind, title = f"fl-lesson {'done' if solved else 'open'}", f"Lesson {title}"
        exercise = "<p class='exercise'><span class='mark'>{}</span>{}</p>"
        parts.append(html(exercise, "✓" if solved else "○", stop.exercise))
        if solved:
            parts.append(html("<p role='status'>{}</p>", stop.praise))
    ways = [_button("Back", "back")] if place > 1 else []
    ways.append(_button("Finish" if place == last else "Next", "on", primary=solved or not stop.exercise))
    ways += [] if place == last else [_button("Close", "end")]
    text = "<div class='fl fl-tour {}'><b>{}</b>{}<div class='row'>{}</div></div>"
    return html(text, kind, title, parts, ways)


def _button(label: str, word: str, primary: bool = False) -> str:
    return html("<button class='{}' {}>{}</button>", "primary" if primary else "", press(word, ""), label)


def add_switches(page: Page) -> None:
    """All of them."""
    for key, (label, hint) in SWITCHES.items():
        page.bind_display(page.gui.add_checkbox(label, False, hint=hint), key)
