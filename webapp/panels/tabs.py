"""The panel as a whole: what is always visible, and the tabs below it."""

from collections.abc import Callable
from html import escape
from importlib.resources import files

import viser

from webapp.handles import put
from webapp.markup.style import STYLE
from webapp.panels.compare_tab import CompareTab
from webapp.panels.files_tab import FilesTab
from webapp.panels.header import Corner, Header
from webapp.panels.host import Host, Panel
from webapp.panels.layout_tab import LayoutTab
from webapp.panels.limits_tab import LimitsTab
from webapp.panels.modes_tab import ModesTab
from webapp.panels.swim_tab import SwimTab
from webapp.panels.view_tab import ViewTab
from webapp.panels.wrench_tab import WrenchTab
from webapp.viser_internals import run_script

NUMBER_FIELDS = files("webapp.panels").joinpath("number_fields.js").read_text("utf-8")
"""Script that keeps number boxes to the user while he types."""
PANEL_WIDTH = 410
"""Width of the panel beside the view [px]."""
TABS: dict[str, Callable[[viser.GuiApi, Host], Panel]] = {
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


class Guarded:
    """A panel that gives way to a sentence when it cannot be shown: no old figure stands under a new name."""

    def __init__(self, gui: viser.GuiApi, host: Host, make: Callable[[viser.GuiApi, Host], Panel]) -> None:
        """Build the panel."""
        self._host = host
        self._sentence = gui.add_html("", visible=False)
        with gui.add_folder(None) as self._folder:
            self._panel = make(gui, host)

    def refresh(self) -> None:
        """Write the session and the answer into it."""
        try:
            self._panel.refresh()
        except Exception as error:
            name = escape(self._host.session.state.layout.name)
            text = f"<div class='fl missing'>This cannot be shown of {name}: {escape(str(error))}</div>"
            put(self._sentence, content=text, visible=True)
            put(self._folder, visible=False)
            self._host.fault(error)
        else:
            put(self._folder, visible=True)
            put(self._sentence, visible=False)


def build_panels(gui: viser.GuiApi, host: Host) -> tuple[list[Panel], list[Panel]]:
    """Build everything in the panel beside the view: all panels, and of these the ones that show a swim."""
    gui.add_html(STYLE)
    run_script(gui, NUMBER_FIELDS)
    panels = {"Corner": Guarded(gui, host, Corner), "Header": Guarded(gui, host, Header)}
    tabs = gui.add_tab_group()
    for label, make in TABS.items():
        with tabs.add_tab(label):
            panels[label] = Guarded(gui, host, make)
    return list(panels.values()), [panels["Corner"], panels["Swim"]]
