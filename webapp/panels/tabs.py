"""The panel as a whole: what is always visible, and the tabs below it."""

from collections.abc import Callable
from html import escape
from importlib.resources import files

import viser

from webapp.handles import put
from webapp.markup.corner import corner, swim_corner
from webapp.markup.picking import add_channel
from webapp.page import Page, Panel
from webapp.panels.compare_tab import CompareTab
from webapp.panels.files_tab import FilesTab
from webapp.panels.layout_tab import LayoutTab
from webapp.panels.limits_tab import LimitsTab
from webapp.panels.modes_tab import ModesTab
from webapp.panels.swim_tab import SwimTab
from webapp.panels.view_tab import ViewTab
from webapp.panels.wrench_tab import WrenchTab
from webapp.scene.swim_scene import ARROWS_N
from webapp.session.tour import STEPS
from webapp.theme import ASKED, DELIVERED, MISSING, css
from webapp.viser_internals import run_script

HABITS = files("webapp").joinpath("habits.js").read_text("utf-8")
"""Script that mends what viser's page does otherwise."""
NARROW = 1000
"""Width of a window in which the panel has to shrink [px]."""
PANEL_WIDTH = 410
"""Width of the panel beside the view [px]."""
TABS: dict[str, Callable[[viser.GuiApi, Page], Panel]] = {
    "Wrench": WrenchTab,
    "Layout": LayoutTab,
    "Modes": ModesTab,
    "Limits": LimitsTab,
    "Compare": CompareTab,
    "Swim": SwimTab,
    "View": ViewTab,
    "Files": FilesTab,
}
"""Tabs by their labels."""

_VARIABLES = (
    f":root {{ --fl-asked: {css(ASKED)}; --fl-delivered: {css(DELIVERED)}; --fl-missing: {css(MISSING)}; }}"
)
STYLE = f"<style>{_VARIABLES}{files('webapp.markup').joinpath('style.css').read_text('utf-8')}</style>"
"""A style element, to be put into the page once."""


class Guarded:
    """A panel that gives way to a sentence when it cannot be shown: no old figure stands under a new name."""

    def __init__(self, gui: viser.GuiApi, page: Page, make: Callable[[viser.GuiApi, Page], Panel]) -> None:
        """Build the panel, and take over the widgets that it binds to the session."""
        self._page = page
        self._sentence = gui.add_html("", visible=False)
        with gui.add_folder(None) as self._folder:
            self._panel = make(gui, page)
        self._bound, page.bound = page.bound, []

    def refresh(self) -> None:
        """Write the session and the answer into it."""
        try:
            for write in self._bound:
                write()
            self._panel.refresh()
        except Exception as error:
            name = escape(self._page.session.state.layout.name)
            text = f"<div class='fl missing'>This cannot be shown of {name}: {escape(str(error))}</div>"
            put(self._sentence, content=text, visible=True)
            put(self._folder, visible=False)
            self._page.fault(error)
        else:
            put(self._folder, visible=True)
            put(self._sentence, visible=False)


def build_panels(gui: viser.GuiApi, page: Page) -> tuple[list[Panel], list[Panel]]:
    """Build everything in the panel beside the view: all panels, and of these the ones that show a swim."""
    gui.add_html(STYLE)
    add_habits(gui, page)
    panels = {"Corner": Guarded(gui, page, Corner), "Header": Guarded(gui, page, Header)}
    tabs = gui.add_tab_group()
    for label, make in TABS.items():
        with tabs.add_tab(label):
            panels[label] = Guarded(gui, page, make)
    return list(panels.values()), [panels["Corner"], panels["Swim"]]


def add_habits(gui: viser.GuiApi, page: Page) -> None:
    """Mend what viser's page does otherwise, and hear from it which tab is open, and how wide it is."""
    width = 0

    def hear(words: list[str]) -> None:
        nonlocal width
        tab, wide = words[0], int(words[-1]) if words[-1].isdecimal() else 0
        if wide > width and width and width < NARROW:  # a panel that had to shrink does not grow by itself
            gui.main_panel.set_width(PANEL_WIDTH)
        width = wide or width
        if tab in TABS and tab != page.tab:
            page.tab = tab
            page.do(lambda: None)

    add_channel(gui, "fl-habits", hear)
    run_script(gui, HABITS)


class Corner:
    """What lies over the 3D view."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build it, empty."""
        self._page = page
        self._content = gui.add_html("")

    def refresh(self) -> None:
        """Write the status line and the legend."""
        page, answering = self._page, self._page.answering
        raw = page.session.sample is not None or answering.frame is not None
        if page.swimming.swimmers:
            content = swim_corner(page.swimming, ARROWS_N)
        else:
            state, least = page.session.state, page.shown is answering.best
            reply = answering.reply
            content = corner(
                state,
                page.scenery.legend,
                page.shown,
                page.busy,
                answering.error,
                raw,
                least,
                reply is not None and reply.in_reach,
            )
        put(self._content, content=content)


class Header:
    """The top of the panel."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page, session = page, page.session
        steps = {"Undo": session.undo, "Redo": session.redo, "Tour": session.next_stop}
        self._history = page.add_buttons("Session", steps, hint="Ctrl+Z, Ctrl+Shift+Z, T.")
        self._steps = gui.add_html("")
        self._card = gui.add_html("", visible=False)
        stops = {"Back": session.previous_stop, "Next": session.next_stop, "End": session.end_tour}
        self._stops = page.add_buttons(
            "Tour", stops, hint="T is next; ending brings your work back.", visible=False
        )

    def refresh(self) -> None:
        """Write what can be undone, and where the tour is."""
        history = self._page.session.history
        undo, redo = history.undo_name or "nothing", history.redo_name or "nothing"
        put(self._history, hint=f"Undo: {undo} (Ctrl+Z). Redo: {redo} (Ctrl+Shift+Z). T starts a tour.")
        again = f" · Redo: {escape(redo)}" if history.redo_name else ""
        put(self._steps, content=f"<div class='fl dim steps'>Undo: {escape(undo)}{again}</div>")
        stop = self._page.session.stop
        put(self._card, visible=stop is not None, content="" if stop is None else tour_card(stop))
        put(self._stops, visible=stop is not None)


def tour_card(index: int) -> str:
    """Title and text of a stop."""
    step = STEPS[index]
    return (
        f"<div class='fl tour'><b>{index + 1} of {len(STEPS)} · {escape(step.title)}</b>"
        f"<div class='said'>{escape(step.text)}</div></div>"
    )
