"""Where a design comes from: what is shipped to start from, and what there is to know of it."""

from html import escape

import viser

from webapp.handles import put
from webapp.page import Page
from webapp.session.files import shipped, shipped_name


class DesignPanel:
    """The list of shipped layouts, and what is said of this one."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        self._layouts = gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
        page.on_change(self._layouts, self._open)
        self._about = gui.add_html("")

    def _open(self, name: str) -> None:
        if name in shipped():
            self._page.session.open_layout(shipped()[name])

    def refresh(self) -> None:
        """Write where the layout comes from."""
        session, layout = self._page.session, self._page.session.state.layout
        name = shipped_name(layout)
        own = f"{layout.name}, {'from a file' if layout == session.saved else 'edited'}"
        put(self._layouts, options=tuple(shipped()) if name else (*shipped(), own), value=name or own)
        first = layout.description.strip().split("\n")[0]
        known = {shipped_layout.description for shipped_layout in shipped().values()}
        if name is None and layout.description in known:  # which is about another robot
            first = f"Made from {layout.name}, and changed."
        put(self._about, content=f"<div class='fl dim'>{escape(first)}</div>")
