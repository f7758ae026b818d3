"""The design as a whole: new, open, save, copy, share; what is shipped, and what this browser had lately."""

from collections.abc import Callable
from importlib.resources import files

import viser

from webapp.handles import put
from webapp.markup.design_list import design_card
from webapp.page import Page
from webapp.session.design_links import MAX_LINK
from webapp.session.files import shipped, shipped_name
from webapp.viser_internals import run_script

SCRIPT = files("webapp").joinpath("designs.js").read_text("utf-8")
"""What runs in the page."""


class DesignPanel:
    """Buttons for designs, the list of shipped ones, and what is said of this one."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page, designs = page, page.designs
        acts: dict[str, Callable[[], object]] = {
            "New": designs.new,
            "Duplicate": page.session.duplicate_layout,
            "Save": designs.save,
            "Share": designs.share,
        }
        hint = (
            "Save sends the file, with measured fins in a ZIP. Share makes a link that carries the design, "
            f"up to {MAX_LINK:,} characters."
        )
        page.add_buttons("Design", acts, hint=hint)
        page.add_upload(
            "Open a design",
            designs.open,
            icon=viser.Icon.FOLDER_OPEN,
            mime_type=".yaml,.yml,.json,.zip",
            hint="A layout file (YAML, JSON), a graph file, a bundle, or a layout zipped with its tables.",
        )
        self._layouts = gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
        page.on_change(self._layouts, self._open)
        self._card = gui.add_html("")
        page.editables.on("save-as", lambda _, text: designs.save_as(text))
        run_script(gui, SCRIPT)

    def _open(self, name: str) -> None:
        if name in shipped():
            self._page.session.open_layout(shipped()[name])

    def refresh(self) -> None:
        """Write where the layout comes from, and what was had lately."""
        session, layout, designs = self._page.session, self._page.session.state.layout, self._page.designs
        designs.note()
        name = shipped_name(layout)
        own = f"{layout.name}, {'from a file' if layout == session.saved else 'edited'}"
        put(self._layouts, options=tuple(shipped()) if name else (*shipped(), own), value=name or own)
        first = layout.description.strip().split("\n")[0]
        known = {shipped_layout.description for shipped_layout in shipped().values()}
        if name is None and layout.description in known:  # which is about another robot
            first = f"Made from {layout.name}, and changed."
        put(self._card, content=design_card(layout.name, first, designs.recent))
