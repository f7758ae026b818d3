"""The bar above all: the design's file, what can be undone, who answers, and help."""

from functools import partial

import viser

from finlab.allocation.methods import METHODS
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.page import Page
from webapp.presses import press
from webapp.session.files import MAX_LINK
from webapp.session.lessons import LESSONS, TOUR
from webapp.session.state import LEAST, least_of
from webapp.tasks.designs import KINDS

DESIGNS = ".yaml,.yml,.json,.zip"
METHOD_WORDS = {
    "dual": "least watts, any actuator",
    "mdn": "least effort, a network proposes",
    "paper": "the paper's pipeline",
    "qp": "one linear step",
    "sqp": "a general solver",
    "px4": "PX4's, thrusters only",
    "ardusub": "ArduSub's, thrusters only",
    "analytic": "the pseudo-inverse",
    "ipopt": "a general solver, slow",
}
PALETTE = (
    "document.documentElement.dispatchEvent(new KeyboardEvent('keydown', "
    "{ key: 'k', code: 'KeyK', ctrlKey: true, bubbles: true }))"
)
"""A line of script that opens the list of commands, as Ctrl+K does."""


def add_file(page: Page) -> None:
    """The design as a file: a new one, one that is opened, and this one saved or shared."""
    designs = page.designs
    add_html(page.gui, marker("fl-file"))
    page.add_button("New", designs.new, icon=viser.Icon.FILE_PLUS, hint="One hull with one fin.")
    page.opening.add(DESIGNS, designs.open)
    hint = f"{KINDS[0].upper()}{KINDS[1:]}. Files can be dropped on the page as well."
    button = page.add_upload("Open", page.opening.open, icon=viser.Icon.FOLDER_OPEN, hint=hint)
    # By the time that this is written, the panels below have said what can be opened.
    page.board.show(button, mime_type=lambda: page.opening.suffixes)
    save = "The layout's file; with measured fins or an imported hull a ZIP with theirs."
    page.add_button("Save", designs.save, icon=viser.Icon.DEVICE_FLOPPY, hint=save)
    share = f"A link that carries the whole design, up to {MAX_LINK:,} characters."
    page.add_button("Share", designs.share, icon=viser.Icon.LINK, hint=share)


def add_history(page: Page) -> None:
    """Undo and redo, by name."""
    session, icon = page.session, viser.Icon
    back = page.add_button("Undo", session.undo, icon=icon.ARROW_BACK_UP, hint="Ctrl+Z")
    page.board.show(back, label=lambda undo: f"Undo: {undo}" if undo else "Undo")
    forth = page.add_button("Redo", session.redo, icon=icon.ARROW_FORWARD_UP, hint="Ctrl+Y or Ctrl+Shift+Z")
    page.board.show(forth, label=lambda redo: f"Redo: {redo}" if redo else "Redo")


def add_answering(page: Page) -> None:
    """Who answers, what is kept least, and where help is found."""
    session, gui = page.session, page.gui
    about = "Watts, proved least by method dual; or the paper's effort, by the network of method mdn."
    page.bind(gui.add_dropdown("Least", tuple(LEAST), hint=about), session.keep_least, least_of)
    about = " ".join(f"{name}: {words}." for name, words in METHOD_WORDS.items())
    methods = gui.add_dropdown("Method", tuple(METHODS), hint=about)
    page.bind(methods, partial(session.set_setting, "method"), lambda method: method)
    template = (
        "<div class='fl-help'><button title='{} lessons with a task each' {}>Lessons</button>"
        "<button title='a tour in {} stops (T)' {}>Tour</button>"
        "<button title='all commands and their keys (Ctrl+K)' onclick='{}'>Commands</button></div>"
    )
    lessons, tour = press("stop", LESSONS[0].name), press("stop", TOUR[0].name)
    add_html(gui, html(template, len(LESSONS), lessons, len(TOUR), tour, PALETTE))
