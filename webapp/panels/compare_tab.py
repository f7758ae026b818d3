"""Several methods on the same wrench."""

import viser

from webapp.handles import add_html, put
from webapp.markup.comparison import comparison_table
from webapp.markup.picking import marker
from webapp.page import Page


class ComparePanel:
    """A button and a table."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        add_html(gui, marker("fl-primary"))
        self._run = page.add_button(
            "Compare the methods",
            lambda: page.comparison.start(page.session.state),
            icon=viser.Icon.SCALE,
            hint="For the present wrench and failures.",
        )
        self._table = gui.add_html("")

    def refresh(self) -> None:
        session, comparison = self._page.session, self._page.comparison
        stale = comparison.state is not None and comparison.state != session.state
        put(self._run, disabled=comparison.running)
        put(self._table, content=comparison_table(comparison, stale))
