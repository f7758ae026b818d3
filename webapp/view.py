"""One browser's page with everything on it: the frame with its panels, and commands by key or from a list."""

from webapp.commands import commands, register
from webapp.page import Page
from webapp.panels.frame import Frame


class View(Page):
    """Panels and scene of one client around its session."""

    def _build(self) -> None:
        self.gui.main_panel.dock_right()
        self.gui.set_panel_label("finlab")
        register(self.gui, self, commands(self))
        self.frame = Frame(self)
