"""The bar above all: the design's file, what can be undone, who answers, and help."""

from functools import partial

import viser

from finlab.allocation.methods import METHODS
from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.presses import press
from webapp.session.design_links import MAX_LINK
from webapp.session.lessons import LESSONS
from webapp.session.state import LEAST, least_of
from webapp.session.tour import STEPS
from webapp.tasks.opening import KINDS

DESIGNS = ".yaml,.yml,.json,.zip"
"""How the names of files of designs end."""
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
"""Methods in a few words each."""
PALETTE = (
    "document.documentElement.dispatchEvent(new KeyboardEvent('keydown', "
    "{ key: 'k', code: 'KeyK', ctrlKey: true, bubbles: true }))"
)
"""A line of script that opens the list of commands, as Ctrl+K does."""


class FileBar:
    """The design as a file: a new one, one that is opened, and this one saved or shared."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, designs = page, page.designs
        add_html(gui, marker("fl-file"))
        page.add_button("New", designs.new, icon=viser.Icon.FILE_PLUS, hint="One hull with one fin.")
        page.opening.add(DESIGNS, designs.open)
        hint = f"{KINDS[0].upper()}{KINDS[1:]}. Files can be dropped on the page as well."
        self._open = page.add_upload("Open", page.opening.open, icon=viser.Icon.FOLDER_OPEN, hint=hint)
        save = "The layout's file; with measured fins or an imported hull a ZIP with theirs."
        page.add_button("Save", designs.save, icon=viser.Icon.DEVICE_FLOPPY, hint=save)
        share = f"A link that carries the whole design, up to {MAX_LINK:,} characters."
        page.add_button("Share", designs.share, icon=viser.Icon.LINK, hint=share)

    def refresh(self) -> None:
        """Tell the browser what can be opened; the panels below have said it by now."""
        put(self._open, mime_type=self._page.opening.suffixes)


class HistoryBar:
    """Undo and redo, by name."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, session = page, page.session
        back, forth = viser.Icon.ARROW_BACK_UP, viser.Icon.ARROW_FORWARD_UP
        self._undo = page.add_button("Undo", session.undo, icon=back, hint="Ctrl+Z")
        self._redo = page.add_button("Redo", session.redo, icon=forth, hint="Ctrl+Y or Ctrl+Shift+Z")

    def refresh(self) -> None:
        history = self._page.session.history
        for button, word, name in (
            (self._undo, "Undo", history.undo_name),
            (self._redo, "Redo", history.redo_name),
        ):
            put(button, label=f"{word}: {name}" if name else word)


class AnsweringBar:
    """Who answers, what is kept least, and where help is found."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        session = page.session
        about = "Watts, proved least by method dual; or the paper's effort, by the network of method mdn."
        least = gui.add_dropdown("Least", tuple(LEAST), hint=about)
        page.bind(least, session.keep_least, lambda: least_of(session.state.method))
        about = " ".join(f"{name}: {words}." for name, words in METHOD_WORDS.items())
        methods = gui.add_dropdown("Method", tuple(METHODS), hint=about)
        page.bind(methods, partial(session.set_setting, "method"), lambda: session.state.method)
        template = (
            "<div class='fl-help'><button title='{} lessons with a task each' {}>Lessons</button>"
            "<button title='a tour in {} stops (T)' {}>Tour</button>"
            "<button title='all commands and their keys (Ctrl+K)' onclick='{}'>Commands</button></div>"
        )
        lessons, tour = press("lesson", LESSONS[0].name), press("tour", "")
        add_html(gui, html(template, len(LESSONS), lessons, len(STEPS), tour, PALETTE))

    def refresh(self) -> None:
        """Nothing but what is bound."""
