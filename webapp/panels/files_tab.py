"""Export: what the robot needs, and the question as a command to copy."""

import viser

from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.snippets import command_line
from webapp.page import Page


class FilesTab:
    """A button for the robot's bundle, and the same question as a command."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        about = "The robot, its fins' physics, README and checksums: what finlab export makes."
        add_html(gui, marker("fl-primary"))
        icon = viser.Icon.PACKAGE_EXPORT
        page.add_button("Export the bundle (ZIP)", page.exports.bundle, icon=icon, hint=about)
        self._command = gui.add_html("")

    def refresh(self) -> None:
        state = self._page.session.state
        words = "The same question on the command line"
        put(self._command, content=html("<div class='fl'>{}</div>", _copied(words, command_line(state))))


def _copied(title: str, text: str) -> str:
    """Lines that a click takes to the clipboard, where the browser lets it; else it selects them."""
    copy = "navigator.clipboard?.writeText(this.innerText); this.previousSibling.dataset.done = 1"
    return html(
        "<div class='said copy'><span class='dim'>{}</span></div><pre class=\"command\" "
        'title="click to copy" onclick="{}">{}</pre>',
        title,
        copy,
        text,
    )
