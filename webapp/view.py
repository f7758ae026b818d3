"""One browser's page with everything on it."""

from webapp.page import Page, Panel
from webapp.panels.commands import add_commands
from webapp.panels.tabs import PANEL_WIDTH, build_panels


class View(Page):
    """Panels and scene of one client around its session."""

    def _build(self) -> tuple[list[Panel], list[Panel]]:
        gui = self.client.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        gui.set_panel_label("finlab")
        add_commands(gui, self)
        return build_panels(gui, self)
