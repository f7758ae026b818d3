"""The list of fins: select, copy, add and remove."""

from collections.abc import Callable
from functools import partial

import viser

from finlab.errors import FinlabError
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html
from webapp.markup.fin_list import fin_list
from webapp.markup.picking import marker
from webapp.page import Page

RING_SIZES = (2, 3, 4, 5, 6, 8)
"""How many fins can stand around the vertical axis."""


def add_fin_list(page: Page) -> None:
    """A table, and below it what can be done with the fins that are selected in it."""
    session = page.session

    def select(key: str, held: str) -> None:
        names = session.state.layout.names
        if not key.isdecimal() or int(key) >= len(names):
            raise FinlabError("that fin is gone")
        (session.select_also if held else session.select)(names[int(key)])

    page.add_html(fin_list)
    page.presses.on("fin", select)
    page.presses.on("robot", lambda _key, _held: session.select(None))
    add_html(page.gui, marker("fl-primary"))
    page.add_button("Add a fin", session.add_fin, icon=viser.Icon.PLUS, hint=f"Up to {MAX_ACTUATORS} fins.")
    edits: dict[str, Callable[[], object]] = {
        "Mirror": session.mirror_fin,
        "Unlink": session.unlink_fin,
        "Duplicate": session.duplicate_fin,
        "To hull": session.stick_fin,
        "Delete": session.delete_fin,
    }
    page.add_buttons("Selected fin", edits, hint="What Mirror (M) makes moves along until it is unlinked.")
    rings = {str(count): partial(session.ring_of_fins, count) for count in RING_SIZES}
    about = "Copies of the selected fin, so that so many stand evenly around the vertical axis."
    page.add_buttons("Copies around", rings, hint=about)
