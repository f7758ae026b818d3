"""Where designs come from: the shipped ones, and what is said of this one."""

from importlib.resources import files

import viser

from webapp.handles import put
from webapp.markup.html import html
from webapp.page import Page
from webapp.session.files import shipped, shipped_name
from webapp.viser_internals import run_script

SCRIPT = files("webapp").joinpath("designs.js").read_text("utf-8")
"""What runs in the page."""


class DesignPanel:
    """The list of shipped designs, and what is said of this one."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._layouts = gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
        page.on_change(self._layouts, self._open)
        self._card = gui.add_html("")
        run_script(gui, SCRIPT)

    def _open(self, name: str) -> None:
        if name in shipped():
            self._page.session.open_layout(shipped()[name])

    def refresh(self) -> None:
        session, layout = self._page.session, self._page.session.state.layout
        name = shipped_name(layout)
        own = f"{layout.name}, {'yours' if layout == session.saved else 'edited'}"
        put(self._layouts, options=tuple(shipped()) if name else (*shipped(), own), value=name or own)
        first = layout.description.strip().split("\n")[0]
        known = {shipped_layout.description for shipped_layout in shipped().values()}
        if name is None and layout.description in known:  # which is about another robot
            first = f"Made from {layout.name}, and changed."
        put(self._card, content=html("<div class='fl dim said'>{}</div>", first))
