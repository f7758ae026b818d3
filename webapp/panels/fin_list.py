"""The list of fins: select, rename, place by number, lock, hide, order, copy, add and remove."""

from collections.abc import Callable
from functools import partial

import viser

from finlab.errors import FinlabError
from finlab.layout.layout import MAX_FINS
from webapp.handles import add_html, hold_kind, put
from webapp.markup.fin_list import AXES, fin_list
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.session.quantities import read_number
from webapp.session.state import MARKS

RINGS = {"z, up": "z", "x, forward": "x", "y, to the left": "y"}
"""Axes that copies can stand around, by what they are called."""
RING_SIZES = (2, 3, 4, 5, 6, 8)
"""How many fins can stand around an axis."""


class FinList:
    """A table, and below it what can be done with the fins that are selected in it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, session = page, page.session
        self._table = gui.add_html("")
        page.editables.on_press("fin", self._select)
        page.editables.on_press("robot", lambda _key, _held: session.select(None))
        for mark in MARKS:
            page.editables.on_press(mark, partial(self._toggle, mark))
        for kind in ("fin-name", "fin-called"):
            page.editables.on(kind, self._rename)
        page.editables.on("fin-shaft", self._turn)
        for axis in AXES:
            page.editables.on(f"fin-{axis}", partial(self._place, axis))
        add_html(gui, marker("fl-primary"))
        page.add_button("Add a fin", session.add_fin, icon=viser.Icon.PLUS, hint=f"Up to {MAX_FINS} fins.")
        edits: dict[str, Callable[[], object]] = {
            "Mirror": session.mirror_fin,
            "Mirror once": partial(session.mirror_fin, linked=False),
            "Unlink": session.unlink_fin,
            "Duplicate": session.duplicate_fin,
            "To hull": session.stick_fin,
            "Up": partial(session.reorder, -1),
            "Down": partial(session.reorder, 1),
            "Delete": session.delete_fin,
        }
        hint = "What Mirror (M) makes moves along until it is unlinked; Mirror once links nothing."
        page.add_buttons("Selected fin", edits, hint=hint)
        about = "Axis through the centre of gravity that copies stand around."
        self._axis = gui.add_dropdown("Copies around", tuple(RINGS), hint=about)
        hold_kind(self._axis)
        rings = {str(count): partial(self._copy_around, count) for count in RING_SIZES}
        about = "Copies of the selected fin, so that so many stand evenly around the axis."
        page.add_buttons("How many", rings, hint=about)

    def _named(self, key: str) -> str:
        """The name of the fin at a place."""
        names = self._page.session.state.layout.names
        if not key.isdecimal() or int(key) >= len(names):
            raise FinlabError("that fin is gone")
        return names[int(key)]

    def _select(self, key: str, held: str) -> None:
        session = self._page.session
        select = {"shift": session.select_to, "ctrl": session.select_also}.get(held, session.select)
        select(self._named(key))

    def _place(self, axis: str, key: str, text: str) -> None:
        self._page.session.place_one(self._named(key), axis, read_number(text, "m"))

    def _turn(self, key: str, text: str) -> None:
        self._page.session.turn_one(self._named(key), read_number(text, "°"))

    def _rename(self, key: str, text: str) -> None:
        self._page.session.rename_fin(self._named(key), text)

    def _toggle(self, mark: str, key: str, _held: str) -> None:
        """One fin; or all that are selected if it is one of these."""
        session, name = self._page.session, self._named(key)
        among = session.selection if name in session.selection else ()
        session.toggle_mark(mark, (name, *(other for other in among if other != name)))

    def _copy_around(self, count: int) -> None:
        self._page.session.ring_of_fins(count, RINGS.get(self._axis.value, "z"))

    def refresh(self) -> None:
        session = self._page.session
        put(self._table, content=fin_list(session.state, session.selection))
