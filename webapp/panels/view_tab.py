"""How the robot is shown: motion or not, shadows, theme."""

from webapp.page import Page

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction (P)."),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme."),
}
"""Field of `Display`, label and hint of each switch."""


def add_switches(page: Page) -> None:
    """All of them."""
    for key, (label, hint) in SWITCHES.items():
        page.bind_display(page.gui.add_checkbox(label, False, hint=hint), key)
