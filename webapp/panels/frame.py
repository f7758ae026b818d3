"""The frame: a bar above, a list at the left, an inspector at the right, a drawer below, by task.

Every region is a folder of viser's that a style takes out of its panel and puts into its place
(`markup/frame.css`); which of them are there, and which sections in them, is one more style element, written
here. So widgets that were seen once stay mounted, and a change of task is one message.
"""

from collections.abc import Callable
from functools import partial
from importlib.resources import files

import viser
from markupsafe import Markup

from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.words import fins_only
from webapp.page import Page, Panel
from webapp.panels.places import DRAWER, LEFT, PLACES, REGIONS, RIGHT, SIMULATE, Place
from webapp.panels.status import Corner
from webapp.presses import press
from webapp.session import Session
from webapp.session.looking import DRAWERS
from webapp.session.state import can_be_edited
from webapp.theme import ASKED, DELIVERED, MISSING, css
from webapp.viser_internals import run_script

NAMED = files("webapp").joinpath("places.js").read_text("utf-8")
"""Script that gives regions and sections their names, for the styles."""
HABITS = files("webapp").joinpath("habits.js").read_text("utf-8")
"""Script that changes what viser's page does otherwise."""
FRAMES = files("webapp").joinpath("frames.js").read_text("utf-8")
"""Script that lets fins flap, and draws only what has changed."""
NAMES = files("webapp").joinpath("names.js").read_text("utf-8")
"""Script that gives each box a name for readers of the screen."""
_VARIABLES = (
    f":root {{ --fl-asked: {css(ASKED)}; --fl-delivered: {css(DELIVERED)}; --fl-missing: {css(MISSING)}; }}"
)


SHEETS = ("style.css", "frame.css", "narrow.css", "compact.css")
STYLE = html(
    "<style>{}{}</style>",
    _VARIABLES,
    (Markup(files("webapp.markup").joinpath(name).read_text("utf-8")) for name in SHEETS),
)
"""A style element, to be put into the page once."""
LOW = ":root { --tall: calc(var(--z) * 92px); }"
"""Height of a drawer in which nothing but a sentence stands."""
TALL = ":root { --fl-usual: 344px; }"
"""Usual height of a drawer with two rows of plots."""
FOLDER = ".mantine-Paper-root[data-fl~={}]"
"""Selector of the folder of a region or section."""


class Section:
    """A panel in its place; it gives way to a sentence when it cannot be shown: no old figure stands under a
    new name."""

    def __init__(self, gui: viser.GuiApi, page: Page, place: Place, index: int) -> None:
        """Build the panel, and take over the widgets that it binds to the session."""
        self.place, self.name, self._page = place, f"at-{index}", page
        with gui.add_folder(place.title, expand_by_default=not place.folded):
            add_html(gui, marker(f"fl-section fl-{self.name}"))
            self._sentence = gui.add_html("", visible=False)
            with gui.add_folder(None, visible=False) as self._folder:
                self._panel = place.make(gui, page)
        self._bound, page.bound = page.bound, []
        self._met = False

    def is_there(self, session: Session) -> bool:
        """Whether it belongs to what is being done."""
        place = self.place
        about = ("", "robot" if session.selected is None else "fins", *["guide"] * session.guided)
        opened = place.region != DRAWER or place.title == session.drawer
        fits = place.fins_only != "" or can_be_edited(session.state.layout)
        return session.task in place.tasks and place.about in about and opened and fits

    def refresh(self) -> None:
        """Write the session and the answer into it. The browser builds its widgets when it is met first, so
        that a first page does not wait for those of other tasks; from then on they stay."""
        self._met = self._met or self.is_there(self._page.session)
        layout = self._page.session.state.layout
        if self.place.fins_only is not None and not can_be_edited(layout):
            self._say(html("<div class='fl dim'>{}</div>", fins_only(layout, self.place.fins_only)))
            return
        try:
            for write in self._bound:
                write()
            self._panel.refresh()
        except Exception as error:
            text = "<div class='fl missing'>This cannot be shown of {}: {}</div>"
            self._say(html(text, layout.name, str(error)))
            self._page.fault(error)
        else:
            put(self._folder, visible=self._met)
            put(self._sentence, visible=False)

    def _say(self, text: str) -> None:
        """A sentence in place of the panel."""
        put(self._sentence, content=text, visible=True)
        put(self._folder, visible=False)


class Frame:
    """All regions of one page with their sections."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build everything."""
        self._page = page
        run_script(gui, NAMED)
        add_html(gui, html("{}{}", STYLE, marker("fl-chrome")))
        self._shown = gui.add_html("")
        self._listen()
        self._corner = Corner(gui, page)
        self._strip: viser.GuiHtmlHandle | None = None
        self._sections: list[Section] = []
        for region in REGIONS:
            with gui.add_folder(region):
                add_html(gui, marker(f"fl-region fl-{region}"))
                if region == DRAWER:
                    self._strip = gui.add_html("")
                self._sections += [
                    Section(gui, page, place, index)
                    for index, place in enumerate(PLACES)
                    if place.region == region
                ]
        run_script(gui, HABITS + FRAMES + NAMES)

    @property
    def panels(self) -> tuple[list[Panel], list[Panel]]:
        """All panels, and of these the ones that follow a swim."""
        follow = [section for section in self._sections if section.place.swims]
        return [self, self._corner, *self._sections], [self._corner, *follow]

    def refresh(self) -> None:
        session = self._page.session
        plots = session.task != SIMULATE or self._page.swimming.swimmer is not None
        put(self._shown, content=_style(self._sections, session, plots))
        assert self._strip is not None
        put(
            self._strip,
            content=_strip(session.task, session.desk.opened[session.task], session.desk.folded),
        )

    def _listen(self) -> None:
        """Hear of what is pressed in the frame."""
        session, robot = self._page.session, self._page.scenery.robot
        acts: dict[str, Callable[[str], object]] = {
            "task": session.show_task,
            "drawer": session.show_drawer,
            "fold": lambda _: session.fold_drawer(),
            "tour": lambda _: session.next_stop(),
            "back": lambda _: session.previous_stop(),
            "end": lambda _: session.end_tour(),
            "lesson": session.open_lesson,
            "lesson-next": lambda _: session.next_lesson(),
            "lesson-close": lambda _: session.close_lesson(),
            "look": robot.look_from,
            "frame": lambda _: robot.frame(),
        }
        for kind, act in acts.items():
            self._page.presses.on(kind, partial(_by_key, act))


def _by_key(act: Callable[[str], object], key: str, _held: str) -> object:
    """An act that does not ask which keys were held."""
    return act(key)


def _style(sections: list[Section], session: Session, plots: bool) -> str:
    """Which regions are there, and which sections in them; the drawer is low until there are plots in it."""
    task, drawer = session.task, session.drawer
    there = {section.name for section in sections if section.is_there(session)}
    regions = {section.place.region for section in sections if section.name in there}
    gone = [FOLDER.format(section.name) for section in sections if section.name not in there]
    gone += [FOLDER.format(region) for region in (LEFT, RIGHT) if region not in regions]
    if not DRAWERS[task]:
        gone.append(FOLDER.format(DRAWER))
    counts = {
        "left": LEFT in regions,
        "right": RIGHT in regions,
        "drawer": bool(DRAWERS[task]),
        "open": drawer is not None,
        "guide": session.guided,
    }
    variables = Markup().join(f"--has-{name}: {int(there)};" for name, there in counts.items())
    height = LOW if not plots else TALL if task == SIMULATE else ""
    hidden = Markup(f"{', '.join(gone)} {{ display: none !important; }}")
    return html("<style>:root {{ {} }} {} {}</style>", variables, height, hidden)


def _strip(task: str, opened: str, folded: bool) -> str:
    """The upper edge of the drawer: its tabs, and the button that folds it."""
    tabs = Markup().join(
        html(
            "<button aria-pressed='{}' {}>{}</button>",
            str(name == opened and (not folded)).lower(),
            press("drawer", name),
            name,
        )
        for name in DRAWERS[task]
    )
    word = "Open the drawer" if folded else "Fold the drawer"
    fold = html(
        "<button class='fold' aria-label='{}' title='{}' {}>{}</button>",
        word,
        word,
        press("fold", ""),
        "▴" if folded else "▾",
    )
    return html("<nav class='fl-strip' aria-label='Drawer'>{}{}</nav>", tabs, fold)
