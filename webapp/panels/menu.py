"""The menu of a bar that has no room for all its buttons: the same actions, lists and methods."""

from collections.abc import Callable
from functools import partial

from markupsafe import Markup

from finlab.allocation.methods import METHODS, method_class
from finlab.layout import Layout
from webapp.handles import button
from webapp.markup.words import html
from webapp.page import Page
from webapp.panels.cards import METHOD_WORDS, commands_button
from webapp.session.lessons import LESSONS, TOUR, Stop
from webapp.session.state import one_of
from webapp.start_page import show_start_page

HIDE = Markup("popovertarget='fl-menu' popovertargetaction='hide'")
"""Attributes of a button that closes the menu."""
OPEN = Markup(
    "<button popovertarget='fl-menu' popovertargetaction='hide' onclick='"
    'document.querySelector("[data-fl~=file] ~ div input[type=file]").click()\'>Open</button>'
)
"""A button that asks for a file, as that of the bar does: a browser lets only a press do so."""
ACTIONS = {"new": "New", "save": "Save", "share": "Share", "start": "Start page"}
"""Key and word of what the menu does beside undo, redo and what it lists."""


def add_menu(page: Page) -> None:
    """Adds the button and its list; a style shows them where the bar is narrow."""
    session = page.session
    acts: dict[str, Callable[[], object]] = {
        "new": page.new,
        "save": page.designs.save,
        "share": page.designs.share,
        "start": partial(show_start_page, page),
        "undo": page.undo,
        "redo": page.redo,
    }
    page.presses.on("menu", lambda key, _: acts[one_of(key, "menu", acts)]())
    page.presses.on("method", lambda name, _: session.set_setting("method", name))
    page.add_html(menu)


def menu(undo: str | None, redo: str | None, layout: Layout, method: str) -> str:
    """The button and the menu.

    Args:
        undo: name of the step that undo takes back; None for none.
        redo: name of the step that redo brings back; None for none.
        layout: the present robot.
        method: the present method.
    """
    actions = {key: button(word, "menu", key, HIDE) for key, word in ACTIONS.items()}
    file = [actions["new"], OPEN, actions["save"], actions["share"]]
    lists = [_methods(layout, method), _stops("Lessons", LESSONS), _stops("Tour", TOUR)]
    template = (
        "<div class='fl-more'><button popovertarget='fl-menu' aria-label='Menu' title='Menu'>"
        "<svg width='18' height='14' viewBox='0 0 18 14' aria-hidden='true'>"
        "<path d='M1 2h16M1 7h16M1 12h16' stroke='currentColor' stroke-width='2'/></svg></button>"
        "<div popover id='fl-menu' class='fl fl-menu'><div class='file'>{}</div>{}{}{}{}{}</div>"
        "</div>"
    )
    return html(
        template,
        file,
        _step("undo", "Undo", undo),
        _step("redo", "Redo", redo),
        lists,
        commands_button(HIDE),
        actions["start"],
    )


def _step(key: str, word: str, step: str | None) -> str:
    """A button that undoes or redoes a step."""
    if step is None:
        return html("<button disabled>{}</button>", word)
    return button(f"{word}: {step}", "menu", key, HIDE)


def _methods(layout: Layout, method: str) -> str:
    """The methods that fit a robot; the present one is marked."""
    entries = []
    for name in METHODS:
        if not method_class(name).fits(layout):
            continue
        pressed = html("aria-pressed='{}' {}", "true" if name == method else "false", HIDE)
        entries.append(button(f"{name}: {METHOD_WORDS[name]}", "method", name, pressed))
    return _list(f"Method: {method}", entries)


def _stops(name: str, course: tuple[Stop, ...]) -> str:
    """The lessons, or the stops of the tour."""
    entries = []
    for number, stop in enumerate(course, start=1):
        entries.append(button(f"{number}. {stop.title}", "stop", stop.name, HIDE))
    return _list(name, entries)


def _list(title: str, entries: list[str]) -> str:
    """Entries under a title that folds them."""
    return html("<details name='fl-menu'><summary>{}</summary>{}</details>", title, entries)
