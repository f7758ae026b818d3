"""How the robot is shown: motion or not, shadows, theme."""

import viser

from webapp.page import Page

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction (P)."),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme."),
}
"""Field of `Display`, label and hint of each switch."""


class ViewPanel:
    """Switches."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        for key, (label, hint) in SWITCHES.items():
            page.bind_display(gui.add_checkbox(label, False, hint=hint), key)

    def refresh(self) -> None:
        """Nothing but what is bound."""
