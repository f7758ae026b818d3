"""The bar at the top (file, history, tasks, method, help), and cards that are markup alone: checks
of a layout, the camera's buttons, a tour's or lesson's text."""

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
from webapp.session.looking import ARROW_LENGTHS, TASKS
from webapp.session.state import LEAST, Flow, least_of
from webapp.tasks.designs import KINDS

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction, propellers stand (H)."),
    "handle": ("Handle", "Drag the tip of the wrench in the view, or turn its rings (Allocate)."),
    "arrows": ("Forces", "What each actuator gives, as an arrow."),
    "fixed_scale": (
        "Fixed scale",
        "Arrows by the most that the robot can give, so that answers compare; else by this answer.",
    ),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme; at first that of the system."),
}
"""Field of `Display`, label and hint of each switch."""


DESIGNS = ",".join((*LAYOUTS, ".zip", *FOREIGN))
"""Suffixes of the files that are opened as designs."""
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
"""Name of each method -> what is said of it in the list of methods."""
COMMANDS_SCRIPT = (
    "document.documentElement.dispatchEvent(new KeyboardEvent("
    '"keydown", { key: "k", code: "KeyK", ctrlKey: true, bubbles: true }))'
)
"""Opens the list of commands, as Ctrl+K does."""


def commands_button(attributes: str = "") -> str:
    """A button that opens the list of commands; `attributes` are markup."""
    template = (
        "<button {} title='all commands and their keys (Ctrl+K)' onclick='{}'>Commands</button>"
    )
    return html(template, attributes, COMMANDS_SCRIPT)


def card(markup: Callable[..., str]) -> Callable[[Page], object]:
    """Returns what builds a panel of markup alone.

    Args:
        markup: a function of the facts of a page, which are its arguments by name.
    """
    return lambda page: page.add_html(markup)


def robot_name(layout: Layout, is_edited: bool) -> str:
    """The robot's name, and whether it has been changed since it was opened or saved."""
    remark = Markup("<span class='dim'>edited</span>") if is_edited else ""
    template = "<div class='fl-robot' title='{}'><h1>{}</h1>{}</div>"
    return html(template, layout.name, layout.name, remark)


def tasks(task: str) -> str:
    """A button for each task; the present one is marked. On a phone each begins with the
    inspector (`frame.css`)."""
    buttons = []
    for name in TASKS:
        attributes = Markup("onclick='document.documentElement.dataset.flSheet = \"\"'")
        if name == task:
            attributes += Markup(" aria-current=page")
        buttons.append(button(name, "task", name, attributes))
    return html("<nav class='fl-tasks' aria-label='Tasks'>{}</nav>", buttons)


def check(able: Layout, lost: tuple[str, ...], layout: Layout, flow: Flow | None) -> str:
    """The quick check of a layout: its axes, what a failure costs, and what looks like a mistake.

    Args:
        able: the layout with the limits that damage has left.
        lost: names of its lost actuators.
        layout: the layout itself.
        flow: velocity (6,) relative to the water [m/s, rad/s]; None at rest.
    """
    remarks = (*warnings(layout), *righting_sentences(layout))
    return check_card(quick_check(able, lost, flow), layout.n - len(lost) > 1, remarks)


def camera() -> str:
    """Buttons of the camera: directions to look from, framing, and a picture."""
    buttons = []
    for key, name in enumerate(CAMERAS, start=1):
        buttons.append(button(name, "look", name, html("title='{}'", key)))
    frame_hint = Markup("title='what is selected fills the view (F)'")
    buttons.append(button("Frame", "frame", "", frame_hint))
    picture_hint = Markup("title='save the view as it is (PNG)'")
    buttons.append(button("Picture", "picture", "", picture_hint))
    return html("<div class='fl fl-camera'>{}</div>", buttons)


def guide_card(stop: Stop | None, solved: bool) -> str:
    """The card of a stop of the tour or a lesson: its title, its text, and its exercise, with
    praise once that is solved.

    Args:
        stop: the present stop; None outside of tour and lessons, where there is no card.
        solved: whether its exercise is solved.
    """
    if stop is None:
        return ""
    course = TOUR if stop in TOUR else LESSONS
    number = course.index(stop) + 1
    is_last = number == len(course)
    style = "tour"
    title = f"{number} of {len(course)} · {stop.title}"
    markup = [html("<p>{}</p>", stop.text)]
    if stop.exercise:
        style = f"fl-lesson {'done' if solved else 'open'}"
        title = f"Lesson {title}"
        exercise = "<p class='exercise'><span class='mark'>{}</span>{}</p>"
        markup.append(html(exercise, "✓" if solved else "○", stop.exercise))
        if solved:
            markup.append(html("<p role='status'>{}</p>", stop.praise))
    buttons = []
    if number > 1:
        buttons.append(button("Back", "back"))
    is_primary = solved or not stop.exercise
    attributes = Markup("class='primary'") if is_primary else Markup()
    buttons.append(button("Finish" if is_last else "Next", "on", attributes=attributes))
    if not is_last:
        buttons.append(button("Close", "end"))
    template = (
        "<div class='fl fl-tour {}' data-sheet='{}'><b>{}</b>{}<div class='row'>{}</div></div>"
    )
    sheet = "" if stop.inspects else "drawer"
    return html(template, style, sheet, title, markup, buttons)


def add_switches(page: Page) -> None:
    """The switches of what the view shows."""
    for key, (label, hint) in SWITCHES.items():
        box = page.gui.add_checkbox(label, False, hint=hint)
        page.bind(
            box,
            partial(page.session.set_display, key),
            lambda display, key=key: getattr(display, key),
        )
        if key == "fixed_scale":
            _add_arrow_length(page)


def _add_arrow_length(page: Page) -> None:
    """The slider of the length of arrows."""
    hint = "How long arrows and rings are, beside what fits the view."
    slider = page.gui.add_slider("Arrow length", *ARROW_LENGTHS, 0.1, 1.0, hint=hint)
    page.bind_number(
        slider,
        partial(page.session.set_display, "arrow_length"),
        lambda display: display.arrow_length,
        digits=1,
    )


def add_file(page: Page) -> None:
    """The design as a file: a new one, one that is opened, and this one saved or shared."""
    designs = page.designs
    add_html(page.gui, marker("fl-file"))
    page.add_button(
        "New", page.new, icon=viser.Icon.FILE_PLUS, hint="One hull, and an actuator of your choice."
    )
    page.opening.add(DESIGNS, page.importing.open)
    hint = f"{KINDS[0].upper()}{KINDS[1:]}. Files can be dropped on the page as well."
    upload = page.add_upload("Open", page.opening.open, icon=viser.Icon.FOLDER_OPEN, hint=hint)
    # When this is called, the other panels have added the suffixes that they open.
    page.board.show(upload, mime_type=lambda: page.opening.suffixes)
    hint = "The layout's file; with measured fins or an imported hull a ZIP with theirs."
    page.add_button("Save", designs.save, icon=viser.Icon.DEVICE_FLOPPY, hint=hint)
    hint = f"A link that carries the whole design, up to {MAX_LINK:,} characters."
    page.add_button("Share", designs.share, icon=viser.Icon.LINK, hint=hint)


def add_history(page: Page) -> None:
    """Buttons that undo and redo, with the name of the step."""
    add_html(page.gui, marker("fl-history"))
    undo_button = page.add_button("Undo", page.undo, icon=viser.Icon.ARROW_BACK_UP, hint="Ctrl+Z")
    page.board.show(undo_button, label=lambda undo: f"Undo: {undo}" if undo else "Undo")
    redo_button = page.add_button(
        "Redo", page.redo, icon=viser.Icon.ARROW_FORWARD_UP, hint="Ctrl+Y or Ctrl+Shift+Z"
    )
    page.board.show(redo_button, label=lambda redo: f"Redo: {redo}" if redo else "Redo")


def add_answering(page: Page) -> None:
    """The method, what it keeps least, and the menus of help."""
    session = page.session
    gui = page.gui
    hint = (
        "Watts, proved least by method dual; or, of fins alone, the paper's effort, by the network "
        "of method mdn."
    )
    least = page.bind(
        gui.add_dropdown("Least", tuple(LEAST), hint=hint), session.keep_least, least_of
    )
    # It stays where it is, so that nothing in the bar moves when a robot is opened.
    page.board.show(least, disabled=lambda layout: not layout.is_of_fins)
    add_html(gui, marker("fl-method"))
    hint = "It stays when another robot is opened, where it takes that one; else dual answers."
    methods = gui.add_dropdown("Method", tuple(METHODS), hint=hint)
    page.board.show(methods, options=_options)
    method_of_option = {_option(name): name for name in METHODS}

    def set_method(option: str) -> None:
        session.set_setting("method", method_of_option.get(option, option))

    page.bind(methods, set_method, _option)
    lists = _menu(LESSONS), _menu(TOUR)
    add_html(gui, html("<div class='fl-help'>{}{}</div>", lists, commands_button()))


def _options(layout: Layout) -> tuple[str, ...]:
    """Entries of the methods that fit a layout."""
    return tuple(_option(name) for name in METHODS if method_class(name).fits(layout))


def _option(method: str) -> str:
    """The entry of a method."""
    return f"{method}: {METHOD_WORDS[method]}"


def _menu(course: tuple[Stop, ...]) -> str:
    """A button that opens a list of the lessons, or of the tour's stops."""
    name = "Lessons"
    hint = "Each has a task"
    if course is TOUR:
        name = "Tour"
        hint = f"The app in {len(TOUR)} stops"
    hide = html("popovertarget='fl-{}' popovertargetaction='hide'", name)
    items = []
    for number, stop in enumerate(course, start=1):
        items.append(button(f"{number}. {stop.title}", "stop", stop.name, hide))
    template = (
        "<button popovertarget='fl-{}'>{}</button><div popover id='fl-{}' class='fl "
        "fl-menu'><b>{}</b>"
        "<p>{}. Your own work comes back when you close them.</p>{}</div>"
    )
    return html(template, name, name, name, name, hint, items)
