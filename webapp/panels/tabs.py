"""The panel as a whole: what is always visible, and the tabs below it."""

from collections.abc import Callable

import viser

from webapp.panels.compare import ComparePanel
from webapp.panels.display import DisplayPanel
from webapp.panels.header import Header
from webapp.panels.host import Host, Panel
from webapp.panels.layout import LayoutPanel
from webapp.panels.limits import LimitsPanel
from webapp.panels.modes import ModesPanel
from webapp.panels.swim import SwimPanel
from webapp.panels.take_home import TakeHomePanel
from webapp.panels.wrench import WrenchPanel

PANEL_WIDTH = 410
"""Width of the panel beside the view [px]."""
TABS: dict[str, Callable[[viser.GuiApi, Host], Panel]] = {
    "Wrench": WrenchPanel,
    "Layout": LayoutPanel,
    "Modes": ModesPanel,
    "Limits": LimitsPanel,
    "Compare": ComparePanel,
    "Swim": SwimPanel,
    "View": DisplayPanel,
    "Files": TakeHomePanel,
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
