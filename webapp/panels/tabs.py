"""The panel as a whole: what is always visible, and the tabs below it."""

from collections.abc import Callable

import viser

from webapp.panels.compare_tab import CompareTab
from webapp.panels.files_tab import FilesTab
from webapp.panels.header import Header
from webapp.panels.host import Host, Panel
from webapp.panels.layout_tab import LayoutTab
from webapp.panels.limits_tab import LimitsTab
from webapp.panels.modes_tab import ModesTab
from webapp.panels.swim_tab import SwimTab
from webapp.panels.view_tab import ViewTab
from webapp.panels.wrench_tab import WrenchTab

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


def build_panels(gui: viser.GuiApi, host: Host) -> list[Panel]:
    """Build everything in the panel beside the view."""
    panels: list[Panel] = [Header(gui, host)]
    tabs = gui.add_tab_group()
    for label, make in TABS.items():
        with tabs.add_tab(label):
            panels.append(make(gui, host))
    return panels
