"""The layout: pick one, place its fins by numbers or by hand, and shape its hull."""

import math
from collections.abc import Callable
from functools import partial
from html import escape

import viser

from finlab.analysis.score_card import quick_check
from finlab.layout import Fin
from finlab.layout.layout import MAX_FINS
from webapp.handles import Changes, hold_kind, put
from webapp.markup.score_card import check_card, warnings
from webapp.page import Page
from webapp.panels.fin_model import FinModelPanel
from webapp.panels.hull_panel import HullPanel
from webapp.session import ANGLE_STEPS, POSITION_STEPS
from webapp.session.files import shipped, shipped_name
from webapp.session.state import number

NONE = "none"
"""Entry of the list of fins that selects nothing."""
RINGS = {"z, up": "z", "x, forward": "x", "y, to the left": "y"}
"""Axes that copies can stand around, by what they are called."""
RING_SIZES = (2, 3, 4, 5, 6, 8)
"""How many fins can stand around an axis."""


class LayoutTab:
    """Choose, place, copy and remove."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page, session = page, page.session
        self._layouts = gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
        page.on_change(self._layouts, self._open)
        self._about = gui.add_html("")
        self._fins = gui.add_dropdown("Fin", (NONE,), hint="Or click one in the view; N is next, X none.")
        page.on_change(self._fins, lambda name: session.select(None if name == NONE else name))
        with gui.add_folder("Place"):
            about = "x forward, y left, z up."
            self._position = page.bind_number(
                gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=0.005, hint=about),
                self._move,
                lambda: (0.0, 0.0, 0.0) if self._fin is None else self._fin.position,
            )
            about = "Azimuth of the shaft, 0 is ahead."
            self._angle = page.bind_number(
                gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=about),
                self._turn,
                lambda: 0.0 if self._fin is None else math.degrees(self._fin.mounting_angle),
                digits=2,
            )
            slides = "Fins slide on the hull's surface, shafts along its normal."
            snap_m = gui.add_dropdown("Snap place", tuple(POSITION_STEPS), hint="Grid for positions.")
            snap_deg = gui.add_dropdown("Snap turn", tuple(ANGLE_STEPS), hint="Grid for the shaft.")
            page.bind_display(snap_m, "position_snap")
            page.bind_display(snap_deg, "angle_snap")
            page.bind_display(gui.add_checkbox("Stick to hull", False, hint=slides), "stick")
        self._model = FinModelPanel(gui, page)
        edits: dict[str, Callable[[], object]] = {
            "Mirror": session.mirror_fin,
            "Mirror once": partial(session.mirror_fin, linked=False),
            "Unlink": session.unlink_fin,
            "Duplicate": session.duplicate_fin,
            "To hull": session.stick_fin,
            "Delete": session.delete_fin,
        }
        page.add_buttons(
            "Selected fin",
            edits,
            hint="What Mirror (M) makes moves along until it is unlinked; Mirror once links nothing.",
        )
        self._axis = gui.add_dropdown(
            "Copies around", tuple(RINGS), hint="Axis through the centre of gravity that copies stand around."
        )
        hold_kind(self._axis)
        page.add_buttons(
            "How many",
            {str(count): partial(self._copy_around, count) for count in RING_SIZES},
            hint="Copies of the selected fin, so that so many stand evenly around the axis.",
        )
        page.add_button("Add a fin", session.add_fin, icon=viser.Icon.PLUS, hint=f"Up to {MAX_FINS} fins.")
        self._card = gui.add_html("")
        self._hull = HullPanel(gui, page)
        self._changes = Changes()

    @property
    def _fin(self) -> Fin | None:
        """The selected fin."""
        session = self._page.session
        layout = session.state.layout
        return None if session.selected is None else layout.fins[layout.index(session.selected)]

    def _open(self, name: str) -> None:
        if name in shipped():
            self._page.session.open_layout(shipped()[name])

    def _move(self, position: tuple[float, float, float]) -> None:
        session = self._page.session
        if session.selected is not None:
            session.move_fin(session.selected, position)

    def _turn(self, degrees: float) -> None:
        session = self._page.session
        if session.selected is not None:
            checked = number(degrees, f"shaft of {session.selected} [°]", -3600.0, 3600.0)
            session.turn_fin(session.selected, math.radians(checked))

    def _copy_around(self, count: int) -> None:
        self._page.session.ring_of_fins(count, RINGS.get(self._axis.value, "z"))

    def refresh(self) -> None:
        """Write the layout and the selected fin."""
        self._model.refresh()
        session, layout = self._page.session, self._page.session.state.layout
        put(self._fins, options=(NONE, *layout.names), value=session.selected or NONE)
        put(self._position, disabled=session.selected is None)
        put(self._angle, disabled=session.selected is None)
        self._hull.refresh()
        name = shipped_name(layout)
        own = f"{layout.name}, {'from a file' if layout == session.saved else 'edited'}"
        put(self._layouts, options=tuple(shipped()) if name else (*shipped(), own), value=name or own)
        first = layout.description.strip().split("\n")[0]
        known = {shipped_layout.description for shipped_layout in shipped().values()}
        if name is None and layout.description in known:  # which is about another robot
            first = f"Made from {layout.name}, and changed."
        pairs = "".join(
            f"<div>{escape(a)} ⇄ {escape(b)} move together.</div>" for a, b in session.state.links
        )
        put(self._about, content=f"<div class='fl'><div class='dim'>{escape(first)}</div>{pairs}</div>")
        state = session.state
        if self._changes(state.layout, state.weak, state.stuck, state.failed):
            quick = quick_check(state.able, state.failed)
            put(self._card, content=check_card(quick, len(state.healthy) > 1, warnings(layout)))
