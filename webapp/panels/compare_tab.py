"""Several methods on the same wrench, with the forces of one of them over those of the robot."""

import viser

from webapp.handles import put
from webapp.markup.comparison import comparison_table
from webapp.markup.picking import chosen_button, marker
from webapp.page import Page
from webapp.session.state import COMPARED

PICKER = "fl-compare"


class CompareTab:
    """A button, a table, and whose arrows are shown."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        self._run = gui.add_button(
            "Compare the methods", icon=viser.Icon.SCALE, hint="On the wrench and the failures of now."
        )
        page.on_click(self._run, lambda: page.comparison.start(page.session.state))
        self._chosen = gui.add_html(marker(PICKER))
        overlay = gui.add_button_group(
            "Overlay",
            ("none", *COMPARED),
            hint="The fins' forces by that method, as plain arrows over those of the robot.",
        )
        page.on_change(overlay, self._choose)
        self._table = gui.add_html("")

    def _choose(self, method: str) -> None:
        session = self._page.session
        session.set_overlay(method if method in COMPARED and method != session.overlay else None)

    def refresh(self) -> None:
        """Write the answers."""
        session, comparison = self._page.session, self._page.comparison
        stale = comparison.state is not None and comparison.state != session.state
        put(self._run, disabled=comparison.running)
        entries = (None, *COMPARED)
        put(self._chosen, content=chosen_button(PICKER, entries.index(session.overlay)))
        put(self._table, content=comparison_table(comparison, session.overlay, stale, PICKER))
