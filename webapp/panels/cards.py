"""The bar above all, cards beside and over the view, and what else is nothing but markup."""

from collections.abc import Callable
from functools import partial

import viser
from markupsafe import Markup

from finlab.allocation.methods import METHODS, method_class
from finlab.analysis.score_card import quick_check
from finlab.exchange import FOREIGN
from finlab.layout import Layout
from finlab.swim.design_files import LAYOUTS
from webapp.handles import add_html, button
from webapp.markup.score_card import check_card, warnings
from webapp.markup.words import html, marker, righting_sentences
from webapp.page import Page
from webapp.scene.robot_scene import CAMERAS
from webapp.session.files import MAX_LINK
from webapp.session.lessons import LESSONS, TOUR, Stop
from webapp.session.looking import TASKS
from webapp.session.state import LEAST, Flow, least_of
from webapp.tasks.designs import KINDS

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
    return html(
        "<div class='fl-robot' title='{}'><h1>{}</h1>{}</div>", layout.name, layout.name, changed
    )


def tasks(task: str) -> str:
    """What is being done: one of four tasks."""
    buttons = [
        button(name, "task", name, Markup("aria-current=page") * (name == task)) for name in TASKS
    ]
    return html("<nav class='fl-tasks' aria-label='Tasks'>{}</nav>", buttons)


def check(able: Layout, lost: tuple[str, ...], layout: Layout, flow: Flow | None) -> str:
    """What can be said of a layout at once: its axes, what a failure costs, what looks like a
    mistake."""
    remarks = (*warnings(layout), *righting_sentences(layout))
    return check_card(quick_check(able, lost, flow), layout.n - len(lost) > 1, remarks)


def camera() -> str:
    """Sides to look from, and framing."""
    looks = [
        button(name, "look", name, html("title='{}'", key)) for key, name in enumerate(CAMERAS, 1)
    ]
    looks.append(
        button("Frame", "frame", "", Markup("title='what is selected fills the view (F)'"))
    )
    looks.append(button("Picture", "picture", "", Markup("title='save the view as it is (PNG)'")))
    return html("<div class='fl fl-camera'>{}</div>", looks)


def guide_card(stop: Stop | None, solved: bool) -> str:
    """Title and text, and an exercise with praise once that is done; nothing outside of tour and
    lessons."""
    if stop is None:
        return ""
    course = TOUR if stop in TOUR else LESSONS
    place = course.index(stop) + 1
    last = len(course)
    kind = "tour"
    title = f"{place} of {last} · {stop.title}"
    markup = [html("<p>{}</p>", stop.text)]
    if stop.exercise:
        kind = f"fl-lesson {'done' if solved else 'open'}"
        title = f"Lesson {title}"
        exercise = "<p class='exercise'><span class='mark'>{}</span>{}</p>"
        markup.append(html(exercise, "✓" if solved else "○", stop.exercise))
        if solved:
            markup.append(html("<p role='status'>{}</p>", stop.praise))
    primary = Markup("class='primary'") * (solved or not stop.exercise)
    ways = [button("Back", "back")] if place > 1 else []
    ways.append(button("Finish" if place == last else "Next", "on", attributes=primary))
    ways += [] if place == last else [button("Close", "end")]
    text = "<div class='fl fl-tour {}'><b>{}</b>{}<div class='row'>{}</div></div>"
    return html(text, kind, title, markup, ways)


def add_switches(page: Page) -> None:
    """All of them."""
    for key, (label, hint) in SWITCHES.items():
        box = page.gui.add_checkbox(label, False, hint=hint)
        page.bind(
            box,
            partial(page.session.set_display, key),
            lambda display, key=key: getattr(display, key),
        )


DESIGNS = ",".join((*LAYOUTS, ".zip", *FOREIGN))
METHOD_WORDS = {
    "dual": "least watts, exact, any actuator",
    "mdn": "least effort, a network proposes, made exact",
    "paper": "the paper's network and learned physics",
    "qp": "one quadratic problem",
    "sqp": "a general solver",
    "paper_sqp": "the paper's: least error, linearized step by step",
    "px4": "as PX4 does it, thrusters alone",
    "ardusub": "as ArduSub does it, thrusters alone",
    "analytic": "the pseudo-inverse",
    "fixed_frequency": "U-CAT's own law, one frequency",
    "ipopt": "a general solver, slow",
}
COMMANDS = html(
    "<button title='all commands and their keys (Ctrl+K)' onclick='{}'>Commands</button>",
    "document.documentElement.dispatchEvent(new KeyboardEvent("
    '"keydown", { key: "k", code: "KeyK", ctrlKey: true, bubbles: true }))',
)
"""A button that opens the list of commands, as Ctrl+K does."""


def add_file(page: Page) -> None:
    """The design as a file: a new one, one that is opened, and this one saved or shared."""
    designs = page.designs
    add_html(page.gui, marker("fl-file"))
    page.add_button(
        "New", page.new, icon=viser.Icon.FILE_PLUS, hint="One hull, and an actuator of your choice."
    )
    page.opening.add(DESIGNS, designs.open)
    hint = f"{KINDS[0].upper()}{KINDS[1:]}. Files can be dropped on the page as well."
    opens = page.add_upload("Open", page.opening.open, icon=viser.Icon.FOLDER_OPEN, hint=hint)
    # By the time that this is written, the panels below have said what can be opened.
    page.board.show(opens, mime_type=lambda: page.opening.suffixes)
    save = "The layout's file; with measured fins or an imported hull a ZIP with theirs."
    page.add_button("Save", designs.save, icon=viser.Icon.DEVICE_FLOPPY, hint=save)
    share = f"A link that carries the whole design, up to {MAX_LINK:,} characters."
    page.add_button("Share", designs.share, icon=viser.Icon.LINK, hint=share)


def add_history(page: Page) -> None:
    """Undo and redo, by name."""
    session = page.session
    icon = viser.Icon
    add_html(page.gui, marker("fl-history"))
    back = page.add_button("Undo", session.undo, icon=icon.ARROW_BACK_UP, hint="Ctrl+Z")
    page.board.show(back, label=lambda undo: f"Undo: {undo}" if undo else "Undo")
    forth = page.add_button(
        "Redo", session.redo, icon=icon.ARROW_FORWARD_UP, hint="Ctrl+Y or Ctrl+Shift+Z"
    )
    page.board.show(forth, label=lambda redo: f"Redo: {redo}" if redo else "Redo")


def add_answering(page: Page) -> None:
    """Who answers, what is kept least, and where help is found."""
    session = page.session
    gui = page.gui
    hint = (
        "Watts, proved least by method dual; or the paper's effort, by the network of method mdn."
    )
    least = page.bind(
        gui.add_dropdown("Least", tuple(LEAST), hint=hint), session.keep_least, least_of
    )
    page.board.show(least, visible=lambda layout: layout.is_of_fins)
    add_html(gui, marker("fl-method"))
    methods = gui.add_dropdown("Method", tuple(METHODS))
    page.board.show(methods, options=_options)
    named = {_option(name): name for name in METHODS}
    page.bind(
        methods, lambda option: session.set_setting("method", named.get(option, option)), _option
    )
    add_html(gui, html("<div class='fl-help'>{}{}{}</div>", _menu(LESSONS), _menu(TOUR), COMMANDS))


def _options(layout: Layout) -> tuple[str, ...]:
    return tuple(_option(name) for name in METHODS if method_class(name).fits(layout))


def _option(method: str) -> str:
    return f"{method}: {METHOD_WORDS[method]}"


def _menu(course: tuple[Stop, ...]) -> str:
    """A button that opens a list of the lessons, or of the tour's stops."""
    words = {
        LESSONS: ("Lessons", "Each has a task"),
        TOUR: ("Tour", f"The app in {len(TOUR)} stops"),
    }
    word, hint = words[course]
    hide = html("popovertarget='fl-{}' popovertargetaction='hide'", word)
    items = [
        button(f"{k}. {stop.title}", "stop", stop.name, hide) for k, stop in enumerate(course, 1)
    ]
    menu = (
        "<button popovertarget='fl-{}'>{}</button><div popover id='fl-{}' class='fl "
        "fl-menu'><b>{}</b>"
        "<p>{}. Your own work comes back when you close them.</p>{}</div>"
    )
    return html(menu, word, word, word, word, hint, items)
