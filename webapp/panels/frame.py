"""The frame: a bar above, a list at the left, an inspector at the right, a drawer below, by task.

Every region is a folder of viser's that a style takes out of its panel and puts into its place
(`markup/frame.css`); which of them are there, and which sections in them, is one more style
element, written here. So widgets that were seen once stay mounted, and a change of task is one
message.
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
from webapp.panels import places
from webapp.panels.commands import add_page_commands
from webapp.panels.log_tab import plot_rows
from webapp.panels.status import add_corner
from webapp.session.lessons import Stop
from webapp.session.looking import CANDIDATES, DRAWERS, Desk
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DELIVERED, MISSING, NEARLY, REACH, REACH_DARK, css
from webapp.viser_internals import run_file, run_script

if TYPE_CHECKING:
    from finlab.log import Judgement

_VARIABLES = (
    f":root {{ --fl-asked: {css(ASKED)}; --fl-delivered: {css(DELIVERED)}; --fl-missing: "
    f"{css(MISSING)}; --fl-near: {css(NEARLY)}; --fl-reach: {css(REACH)}; }} "
    f"[data-mantine-color-scheme=dark] {{ --fl-reach: {css(REACH_DARK)}; }}"
)
STYLE = html(
    "<style>{}{}</style>",
    _VARIABLES,
    (
        Markup(files("webapp.markup").joinpath(name).read_text("utf-8"))
        for name in ("style.css", "frame.css")
    ),
)
LOW = ":root { --tall: 92px; }"
USUAL = ":root {{ --fl-usual: {}px; }}"
ROW_PX, HEAD_PX = 138, 68
"""Height of a row of plots over time, and of what is in the drawer beside them [px]."""
FOLDER = ".mantine-Paper-root[data-fl~={}]"


class Section:
    """A panel in its place, built when it is met first; it gives way to a sentence when it cannot
    be shown: no old figure stands under a new name."""

    def __init__(self, page: Page, place: places.Place, index: int) -> None:
        self.place = place
        self.name = f"at-{index}"
        self._session = page.session
        self._met = False
        gui = page.gui
        self.group = page.board.group(self._fail)
        with gui.add_folder(place.title, expand_by_default=not place.folded) as self.whole:
            add_html(gui, marker(f"fl-section fl-{self.name} {place.title}"))
            self._sentence = gui.add_html("", visible=False)
            with gui.add_folder(None, visible=False) as self._folder:
                place.make(page)

    def arrange(self, task: str, drawer: str | None, about: tuple[str, ...]) -> bool:
        """Whether it belongs to what is being done."""
        place = self.place
        opened = place.region != places.DRAWER or place.title == drawer
        is_visible = task in place.tasks and place.about in about and opened
        self.group.is_visible = is_visible
        if is_visible:
            self._met = True
            self._say("")
        return is_visible

    def _fail(self, error: Exception | None) -> None:
        name = self._session.state.layout.name
        template = "<div class='fl missing'>This cannot be shown of {}: {}</div>"
        self._say("" if error is None else html(template, name, str(error)))

    def _say(self, text: str) -> None:
        set_properties(self._sentence, content=text, visible=bool(text))
        set_properties(self._folder, visible=self._met and not text)


class Frame:
    """All regions of one page with their sections."""

    def __init__(self, page: Page) -> None:
        self._page = page
        gui = page.gui
        gui.main_panel.dock_right()
        gui.set_panel_label("finlab")
        add_page_commands(page)
        run_file(gui, "habits.js")
        add_html(gui, html("{}{}", STYLE, marker("fl-chrome")))
        page.board.group()
        self._shown = gui.add_html("")
        page.board.act(self._arrange)
        page.board.act(self._guard)
        title = "document.title = {};"
        page.board.act(
            lambda layout: run_script(gui, title.format(json.dumps(layout.name + " · finlab")))
        )
        self._listen()
        self.sections: list[Section] = []
        add_corner(page)
        for region in places.REGIONS:
            with gui.add_folder(region):
                add_html(gui, marker(f"fl-region fl-{region}"))
                if region == places.DRAWER:
                    page.board.group()
                    page.add_html(_strip)
                self.sections += [
                    Section(page, place, index)
                    for index, place in enumerate(places.PLACES)
                    if place.region == region
                ]
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
    ) -> None:
        """Write which regions and sections are there; the drawer is low until there are plots in
        it."""
        about = ("", "robot" if selected is None else "actuators", *["guide"] * (stop is not None))
        about += ("flow",) * plant_of(layout).feels_flow
        there = [section for section in self.sections if section.arrange(desk.task, drawer, about)]
        regions = {section.place.region for section in there}
        gone = [FOLDER.format(section.name) for section in self.sections if section not in there]
        gone += [
            FOLDER.format(region) for region in (places.LEFT, places.RIGHT) if region not in regions
        ]
        has_drawer = bool(DRAWERS[desk.task])
        if not has_drawer:
            gone.append(FOLDER.format(places.DRAWER))
        counts = {
            "left": places.LEFT in regions,
            "right": places.RIGHT in regions,
            "drawer": has_drawer,
            "open": drawer is not None,
            "guide": stop is not None,
            "log": desk.task == places.LOG,
        }
        variables = Markup().join(f"--has-{name}: {int(there)};" for name, there in counts.items())
        swum = 2 * (swimmer is not None)
        rows = 0 if judgement is None else plot_rows(judgement)
        rows = {places.SIMULATE: swum, places.LOG: rows}.get(desk.task, 0)
        is_timeline = drawer in (*DRAWERS[places.SIMULATE], DRAWERS[places.LOG][0])
        low = desk.task in (places.SIMULATE, places.LOG) and not rows
        height = LOW if low else USUAL.format(HEAD_PX + ROW_PX * rows) if is_timeline else ""
        hidden = Markup(f"{', '.join(gone)} {{ display: none !important; }}")
        set_properties(
            self._shown,
            content=html("<style>:root {{ {} }} {} {}</style>", variables, Markup(height), hidden),
        )

    def _guard(self, swims: bool, fit_progress: str | None, improving: bool) -> None:
        """A reload asks first while there is something that it would drop."""
        drops = str(swims or fit_progress is not None or improving).lower()
        run_script(self._page.gui, f"window.finlabDrops = {drops};")

    def _listen(self) -> None:
        session = self._page.session
        robot = self._page.scenery.robot
        acts: dict[str, Callable[[str, str], object]] = {
            "task": lambda name, _: session.show_task(name),
            "drawer": lambda name, _: session.show_drawer(name),
            "fold": lambda *_: session.fold_drawer(),
            "stop": lambda name, _: session.guide.open(name),
            "on": lambda *_: session.guide.go(1),
            "back": lambda *_: session.guide.go(-1),
            "end": lambda *_: session.guide.end(),
            "look": lambda view, _: robot.look_from(view),
            "frame": lambda *_: robot.frame(),
            "picture": lambda *_: self._page.scenery.save(),
            "typed": lambda *_: session.history.end_merge(),
        }
        for kind, act in acts.items():
            self._page.presses.on(kind, act)


def _strip(desk: Desk, drawer: str | None, layout: Layout) -> str:
    """The upper edge of the drawer: its tabs, and the button that folds it."""
    folded = drawer is None
    names = [name for name in DRAWERS[desk.task] if name != CANDIDATES or layout.is_of_fins]
    pressed = ((name, html("aria-pressed='{}'", str(name == drawer).lower())) for name in names)
    tabs = [button(name, "drawer", name, attribute) for name, attribute in pressed]
    word = "Open the drawer" if folded else "Fold the drawer"
    attributes = html("class='fold' aria-label='{}' title='{}'", word, word)
    tabs.append(button("▴" if folded else "▾", "fold", "", attributes))
    return html("<nav class='fl-strip' aria-label='Drawer'>{}</nav>", tabs)
