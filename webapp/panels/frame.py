"""The frame: a bar above, a list at the left, an inspector at the right, a drawer below, by task.

Every region is a folder of viser's, which a style sheet (`markup/frame.css`) moves to its position.
Which regions and panels are visible is one more style element, written here: so widgets that were
visible once stay mounted, and a change of task is one message.
"""

import json
from collections.abc import Callable
from importlib.resources import files
from typing import TYPE_CHECKING

from markupsafe import Markup

from finlab.layout import Layout
from finlab.physics import plant_of
from webapp.handles import add_html, button, set_properties
from webapp.markup.words import html, marker
from webapp.page import Page
from webapp.panels.arrangement import (
    DRAWER,
    LEFT,
    LOG,
    NEEDS_ACTUATORS,
    NEEDS_FILE,
    NEEDS_FLOW,
    NEEDS_GUIDE,
    NEEDS_ONE,
    NEEDS_ROBOT,
    NEEDS_TWO,
    PANELS,
    REGIONS,
    RIGHT,
    SIMULATE,
    Panel,
)
from webapp.panels.commands import add_page_commands
from webapp.panels.following import add_following
from webapp.panels.gamepad import add_gamepad
from webapp.panels.log_tab import plot_rows
from webapp.panels.nudging import add_nudging
from webapp.panels.presenting import add_presenting
from webapp.panels.status import add_corner
from webapp.session.granted import SourceFile
from webapp.session.lessons import Stop
from webapp.session.looking import CANDIDATES, DARK, DRAWERS, Desk
from webapp.session.two_robots import Pair
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DELIVERED, MISSING, NEARLY, REACH, REACH_DARK, css
from webapp.viser_internals import run_file, run_script

if TYPE_CHECKING:
    from finlab.log import Judgement

VARIABLES = (
    f":root {{ --fl-asked: {css(ASKED)}; --fl-delivered: {css(DELIVERED)}; --fl-missing: "
    f"{css(MISSING)}; --fl-near: {css(NEARLY)}; --fl-reach: {css(REACH)}; }} "
    f"[data-mantine-color-scheme=dark] {{ --fl-reach: {css(REACH_DARK)}; }}"
)
"""The colours of the theme as variables of CSS."""
STYLE_SHEETS = (
    "style.css",
    "frame.css",
    "inquiry.css",
    "two_robots.css",
    "take_home.css",
    "following.css",
    "presenting.css",
)
"""Files of `webapp/markup` that style the page."""
STYLE = html(
    "<style>{}{}</style>",
    VARIABLES,
    [Markup(files("webapp.markup").joinpath(name).read_text("utf-8")) for name in STYLE_SHEETS],
)
"""The style element of all pages."""
LOOKS = ("look", "frame", "picture", "scheme", "typed")
"""Buttons by their kinds that change nothing but what this page looks like."""
LOW_DRAWER = ":root { --tall: 92px; }"
"""Style of a drawer for plots over time that has none yet."""
USUAL_DRAWER = ":root {{ --fl-usual: {}px; }}"
"""Style of a drawer of a height [px], unless its user has dragged it."""
ROW_PX = 138
"""Height of a row of plots over time [px]."""
HEAD_PX = 68
"""Height of what is in the drawer beside the plots [px]."""
FOLDER = ".mantine-Paper-root[data-fl~={}]"
"""Selector of a folder by the name of its marker."""


class Section:
    """A panel on the page, whose widgets are shown when it is visible for the first time.

    Where they cannot be written, a sentence replaces them, so that no old figure stands under a new
    name.
    """

    def __init__(self, page: Page, panel: Panel, index: int) -> None:
        """Builds a panel, the one of an index in `PANELS`, into the present folder of a page."""
        self.panel = panel
        self.name = f"at-{index}"
        self._session = page.session
        self._was_visible = False
        gui = page.gui
        self.group = page.board.group(self._fail)
        with gui.add_folder(panel.title, expand_by_default=not panel.is_folded) as self.whole:
            add_html(gui, marker(f"fl-section fl-{self.name} {panel.title}"))
            self._error_sentence = gui.add_html("", visible=False)
            with gui.add_folder(None, visible=False) as self._widgets:
                panel.build(page)

    def set_visible(self, task: str, drawer: str | None, met_needs: tuple[str, ...]) -> bool:
        """Shows or hides it.

        Args:
            task: the present task.
            drawer: the open tab of the drawer; None while it is folded.
            met_needs: which of `NEEDS_*` are met; the empty one always is.

        Returns:
            Whether it is visible.
        """
        panel = self.panel
        is_open = panel.region != DRAWER or panel.title == drawer
        is_visible = task in panel.tasks and panel.need in met_needs and is_open
        self.group.is_visible = is_visible
        if is_visible:
            self._was_visible = True
            self._show_error("")
        return is_visible

    def _fail(self, error: Exception | None) -> None:
        """Shows why the panel cannot be written; None where it can."""
        name = self._session.state.layout.name
        template = "<div class='fl missing'>This cannot be shown of {}: {}</div>"
        self._show_error("" if error is None else html(template, name, str(error)))

    def _show_error(self, text: str) -> None:
        """A sentence in place of the widgets; the widgets where it is empty."""
        set_properties(self._error_sentence, content=text, visible=bool(text))
        set_properties(self._widgets, visible=self._was_visible and not text)


class Frame:
    """All regions of one page with their sections."""

    def __init__(self, page: Page) -> None:
        """Builds all panels into a page."""
        self._page = page
        gui = page.gui
        gui.main_panel.dock_right()
        gui.set_panel_label("finlab")
        add_page_commands(page)
        run_file(gui, "habits.js")
        add_html(gui, html("{}{}", STYLE, marker("fl-chrome")))
        page.board.group()
        self._visibility = gui.add_html("")
        page.board.act(self._arrange)
        page.board.act(self._guard_reload)
        page.board.act(self._set_title)
        add_nudging(page)
        add_gamepad(page)
        self._listen()
        self.sections: list[Section] = []
        add_corner(page)
        add_following(page)
        add_presenting(page)
        for region in REGIONS:
            with gui.add_folder(region):
                add_html(gui, marker(f"fl-region fl-{region}"))
                if region == DRAWER:
                    page.board.group()
                    page.add_html(_tab_strip)
                for index, panel in enumerate(PANELS):
                    if panel.region == region:
                        self.sections.append(Section(page, panel, index))
        run_file(gui, "frames.js")

    def _arrange(
        self,
        desk: Desk,
        drawer: str | None,
        selected: str | None,
        stop: Stop | None,
        swimmer: Swimmer | None,
        layout: Layout,
        judgement: "Judgement | None",
        pair: Pair | None,
        source: SourceFile | None,
    ) -> None:
        """Writes the style that says which regions and sections are visible."""
        needs = ["", NEEDS_ROBOT if selected is None else NEEDS_ACTUATORS]
        needs.append(NEEDS_ONE if pair is None else NEEDS_TWO)
        if stop is not None:
            needs.append(NEEDS_GUIDE)
        if source is not None:
            needs.append(NEEDS_FILE)
        if plant_of(layout).feels_flow:
            needs.append(NEEDS_FLOW)
        visible_regions = set()
        hidden = []
        for section in self.sections:
            if section.set_visible(desk.task, drawer, tuple(needs)):
                visible_regions.add(section.panel.region)
            else:
                hidden.append(FOLDER.format(section.name))
        for region in (LEFT, RIGHT):
            if region not in visible_regions:
                hidden.append(FOLDER.format(region))
        has_drawer = bool(DRAWERS[desk.task])
        if not has_drawer:
            hidden.append(FOLDER.format(DRAWER))
        flags = {
            "left": LEFT in visible_regions,
            "right": RIGHT in visible_regions,
            "drawer": has_drawer,
            "open": drawer is not None,
            "guide": stop is not None,
            "listed": stop is not None and not stop.inspects,
            "log": desk.task == LOG,
        }
        variables = Markup().join(f"--has-{name}: {int(flag)};" for name, flag in flags.items())
        height = Markup(_drawer_height(desk.task, drawer, swimmer is not None, judgement))
        hiding = Markup(f"{', '.join(hidden)} {{ display: none !important; }}")
        style = html("<style>:root {{ {} }} {} {}</style>", variables, height, hiding)
        set_properties(self._visibility, content=style)

    def _guard_reload(self, swims: bool, fit_progress: str | None, improving: bool) -> None:
        """Lets the browser ask before a reload while there is something that it would drop."""
        drops = str(swims or fit_progress is not None or improving).lower()
        run_script(self._page.gui, f"window.finlabDrops = {drops};")

    def _set_title(self, layout: Layout) -> None:
        """Writes the robot's name into the title of the browser's tab."""
        title = json.dumps(f"{layout.name} · finlab")
        run_script(self._page.gui, f"document.title = {title};")

    def _listen(self) -> None:
        """Connects the buttons of the page's own markup, by their kinds, with what they do."""
        session = self._page.session
        scenery = self._page.scenery
        acts: dict[str, Callable[[str, str], object]] = {
            "task": lambda name, _: session.show_task(name),
            "drawer": lambda name, _: session.show_drawer(name),
            "fold": lambda *_: session.fold_drawer(),
            "stop": lambda name, _: session.guide.open(name),
            "on": lambda *_: session.guide.go(1),
            "back": lambda *_: session.guide.go(-1),
            "end": lambda *_: session.guide.end(),
            "look": lambda view, _: scenery.look_from(view),
            "frame": lambda *_: scenery.frame(),
            "picture": lambda *_: scenery.save(),
            "scheme": lambda scheme, _: session.follow_system(scheme == DARK),
            "typed": lambda *_: session.history.end_merge(),
        }
        for kind, act in acts.items():
            self._page.presses.on(kind, act, looks=kind in LOOKS)


def _drawer_height(
    task: str, drawer: str | None, swims: bool, judgement: "Judgement | None"
) -> str:
    """The style of the drawer's height: low until there are plots in it, then as high as these."""
    rows = 0
    if task == SIMULATE and swims:
        rows = 2
    elif task == LOG and judgement is not None:
        rows = plot_rows(judgement)
    if task in (SIMULATE, LOG) and rows == 0:
        return LOW_DRAWER
    is_timeline = drawer in (*DRAWERS[SIMULATE], DRAWERS[LOG][0])
    return USUAL_DRAWER.format(HEAD_PX + ROW_PX * rows) if is_timeline else ""


def _tab_strip(desk: Desk, drawer: str | None, layout: Layout) -> str:
    """The upper edge of the drawer: its tabs, and the button that folds it.

    A phone has room for one region: two more buttons bring the inspector and the list there, and a
    tab brings the drawer.
    """
    is_folded = drawer is None
    buttons = []
    for region, word in ((RIGHT, "Values"), (LEFT, "List")):
        attributes = html("class='sheet {}' {}", "" if is_folded else region, _brings(region))
        if is_folded:  # it unfolds what it brings
            buttons.append(button(word, "fold", "", attributes))
        else:
            buttons.append(html("<button {}>{}</button>", attributes, word))
    for name in DRAWERS[desk.task]:
        if name == CANDIDATES and not layout.is_of_fins:
            continue
        is_pressed = str(name == drawer).lower()
        attributes = html("aria-pressed='{}' {}", is_pressed, _brings(DRAWER))
        buttons.append(button(name, "drawer", name, attributes))
    words = "Open the drawer" if is_folded else "Fold the drawer"
    attributes = html("class='fold' aria-label='{}' title='{}'", words, words)
    buttons.append(button("▴" if is_folded else "▾", "fold", "", attributes))
    return html("<nav class='fl-strip' aria-label='Drawer'>{}</nav>", buttons)


def _brings(region: str) -> str:
    """Attributes of a button by which a phone shows a region (`frame.css`)."""
    script = "document.documentElement.dataset.flSheet = innerWidth > 600 ? '' : '{}'"
    return html('onclick="{}"', Markup(script.format(region)))
