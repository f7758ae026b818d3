"""What can be said of a layout at once: its axes, what a failure costs, what looks like a mistake."""

import viser

from finlab.analysis.score_card import quick_check
from webapp.handles import Changes, put
from webapp.markup.score_card import check_card, warnings
from webapp.page import Page


class CheckPanel:
    """One card."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, self._card, self._changes = page, gui.add_html(""), Changes()

    def refresh(self) -> None:
        state = self._page.session.state
        if self._changes(state.layout, state.weak, state.stuck, state.failed):
            quick = quick_check(state.able, state.failed)
            put(self._card, content=check_card(quick, len(state.healthy) > 1, warnings(state.layout)))
