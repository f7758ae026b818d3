"""One browser's page with everything on it: the frame with its panels, and commands by key or from a list."""

from webapp.commands import commands, register
from webapp.page import Page, Panel
from webapp.panels.frame import Frame


class View(Page):
    """Panels and scene of one client around its session."""

    def _build(self) -> tuple[list[Panel], list[Panel]]:
        gui = self.client.gui
        gui.main_panel.dock_right()
        gui.set_panel_label("finlab")
        register(gui, self, commands(self))
        return Frame(gui, self).panels
