"""How the robot is shown: motion, what is drawn, and theme."""

from functools import partial

import viser

from webapp.page import Page
from webapp.session.display import NEWTONS

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction (P)."),
    "fans": ("Sweep fans", "The angle that each fin sweeps."),
    "labels": ("Fin numbers", "A number at the root of each fin."),
    "ghost": ("Ghost", "Where moved fins stood when the layout was opened or saved."),
    "center": ("Centre of gravity", "Mark it, and look through the hull."),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme."),
}
"""Field of `Display`, label and hint of each switch."""


def _scale_entry(newtons: float) -> str:
    return f"0.1 m = {newtons:g} N" if newtons else "automatic"


SCALES = {_scale_entry(newtons): newtons for newtons in (0.0, *NEWTONS)}
"""Entries of the arrow scale and their forces [N]."""


class ViewPanel:
    """Switches."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        speed = gui.add_slider("Motion speed", 0.05, 1.0, 0.05, 0.5, hint="1 is real time.")
        page.bind_number(
            speed, partial(page.session.set_display, "speed"), lambda: page.session.display.speed, digits=3
        )
        page.bind(
            gui.add_dropdown("Arrow scale", tuple(SCALES), hint="Force of an arrow of 0.1 m."),
            lambda entry: page.session.set_display("newtons", SCALES.get(entry)),
            lambda: _scale_entry(page.session.display.newtons),
        )
        for key, (label, hint) in SWITCHES.items():
            page.bind_display(gui.add_checkbox(label, False, hint=hint), key)

    def refresh(self) -> None:
        """Nothing but what is bound."""
