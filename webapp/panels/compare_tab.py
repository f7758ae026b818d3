"""Several methods on the same wrench, with the forces of one of them over those of the robot."""

import viser

from webapp.handles import put
from webapp.markup.comparison import comparison_table
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.session.state import COMPARED

PICKER = "fl-compare"


class ComparePanel:
    """A button, a table, and whose arrows are shown."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        gui.add_html(marker("fl-primary"))
        self._run = page.add_button(
            "Compare the methods",
            lambda: page.comparison.start(page.session.state),
            icon=viser.Icon.SCALE,
            hint="On the wrench and the failures of now.",
        )
        page.add_choice(
            "Overlay",
            PICKER,
            ("none", *COMPARED),
            self._choose,
            lambda: page.session.overlay or "none",
            hint="The fins' forces by that method, as plain arrows over those of the robot.",
        )
        self._table = gui.add_html("")

    def _choose(self, method: str) -> None:
        session = self._page.session
        session.set_overlay(method if method in COMPARED and method != session.overlay else None)

    def refresh(self) -> None:
        """Write the answers."""
        session, comparison = self._page.session, self._page.comparison
        stale = comparison.state is not None and comparison.state != session.state
        put(self._run, disabled=comparison.running)
        put(self._table, content=comparison_table(comparison, session.overlay, stale, PICKER))
