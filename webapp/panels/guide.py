"""The card of the tour or of a lesson, above the list."""

import viser

from webapp.handles import put
from webapp.markup.guide_cards import lesson_card, tour_card
from webapp.page import Page


class GuidePanel:
    """Whichever is under way."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._session, self._card = page.session, gui.add_html("")

    def refresh(self) -> None:
        session, card = self._session, ""
        if session.lesson is not None:
            card = lesson_card(session.lesson, session.solved)
        elif session.stop is not None:
            card = tour_card(session.stop)
        put(self._card, content=card)
