"""The list of fins: select, copy, add and remove."""

from collections.abc import Callable
from functools import partial

import viser

from finlab.errors import FinlabError
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html, put
from webapp.markup.fin_list import fin_list
from webapp.markup.picking import marker
from webapp.page import Page

RING_SIZES = (2, 3, 4, 5, 6, 8)
"""How many fins can stand around the vertical axis."""


class FinList:
    """A table, and below it what can be done with the fins that are selected in it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, session = page, page.session
        self._table = gui.add_html("")
        page.presses.on("fin", self._select)
        page.presses.on("robot", lambda _key, _held: session.select(None))
        add_html(gui, marker("fl-primary"))
        page.add_button(
            "Add a fin", session.add_fin, icon=viser.Icon.PLUS, hint=f"Up to {MAX_ACTUATORS} fins."
        )
        edits: dict[str, Callable[[], object]] = {
            "Mirror": session.mirror_fin,
            "Unlink": session.unlink_fin,
            "Duplicate": session.duplicate_fin,
            "To hull": session.stick_fin,
            "Delete": session.delete_fin,
        }
        hint = "What Mirror (M) makes moves along until it is unlinked."
        page.add_buttons("Selected fin", edits, hint=hint)
        rings = {str(count): partial(session.ring_of_fins, count) for count in RING_SIZES}
        about = "Copies of the selected fin, so that so many stand evenly around the vertical axis."
        page.add_buttons("Copies around", rings, hint=about)

    def _named(self, key: str) -> str:
        """The name of the fin at a place."""
        names = self._page.session.state.layout.names
        if not key.isdecimal() or int(key) >= len(names):
            raise FinlabError("that fin is gone")
        return names[int(key)]

    def _select(self, key: str, held: str) -> None:
        session = self._page.session
        (session.select_also if held else session.select)(self._named(key))

    def refresh(self) -> None:
        session = self._page.session
        put(self._table, content=fin_list(session.state, session.selection))
