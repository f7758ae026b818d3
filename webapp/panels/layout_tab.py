"""The layout: the list of fins, what is said of the selected ones, and the body that carries them."""

from html import escape

import viser

from finlab.analysis.score_card import quick_check
from webapp.handles import Changes, put
from webapp.markup.score_card import check_card, warnings
from webapp.page import Page
from webapp.panels.fin_inspector import FinInspector
from webapp.panels.fin_list import FinList
from webapp.panels.hull_panel import HullPanel
from webapp.session.files import shipped, shipped_name


class LayoutTab:
    """Choose, place, copy and remove."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        self._layouts = gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
        page.on_change(self._layouts, self._open)
        self._about = gui.add_html("")
        self._list = FinList(gui, page)
        self._fin = FinInspector(gui, page)
        self._card = gui.add_html("")
        self._hull = HullPanel(gui, page)
        self._changes = Changes()

    def _open(self, name: str) -> None:
        if name in shipped():
            self._page.session.open_layout(shipped()[name])

    def refresh(self) -> None:
        """Write the layout and the selected fins."""
        session, layout = self._page.session, self._page.session.state.layout
        for panel in (self._list, self._fin, self._hull):
            panel.refresh()
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
