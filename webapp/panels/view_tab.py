"""How the robot is shown: motion, shadows and theme."""

from functools import partial

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
        speed = gui.add_slider("Motion speed", 0.05, 1.0, 0.05, 0.5, hint="1 is real time.")
        page.bind_number(
            speed, partial(page.session.set_display, "speed"), lambda: page.session.display.speed, digits=3
        )
        for key, (label, hint) in SWITCHES.items():
            page.bind_display(gui.add_checkbox(label, False, hint=hint), key)

    def refresh(self) -> None:
        """Nothing but what is bound."""
