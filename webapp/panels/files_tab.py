"""Export: what the robot needs, what is seen and found, and the question as a command to copy."""

from html import escape

import viser

from webapp.handles import put
from webapp.markup.picking import marker
from webapp.markup.snippets import command_line, export_line, python_lines
from webapp.page import Page
from webapp.session import files

PURPOSES = {
    "Bundle": "for the robot, with all that it needs: <code>finlab-runtime check FILE</code>",
    "Graph file": "for the robot, too, which compiles the fins as it starts, and for all verbs of finlab",
    "Candidates": "all answers to this question, for a spreadsheet",
    "Picture": "what is seen now, for a paper",
    "3D view": "moves by itself in any browser, without a server",
}
"""What each file is for."""


class FilesTab:
    """Buttons for files, and the same question as a command."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        about = "Graph, the fins' physics, README and checksums: what finlab export makes."
        gui.add_html(marker("fl-primary"))
        icon = viser.Icon.PACKAGE_EXPORT
        page.add_button("Export the bundle (ZIP)", page.exports.bundle, icon=icon, hint=about)
        parts = {
            "Graph file": page.exports.graph,
            "Candidates (CSV)": self._send_candidates,
            "Picture (PNG)": page.exports.picture,
            "3D view (HTML)": lambda: page.exports.html(page.shown),
        }
        page.add_buttons("Single files", parts, hint="The layout graph alone, and what is seen.")
        lines = (f"<div class='said'><b>{name}</b> {text}</div>" for name, text in PURPOSES.items())
        gui.add_html(f"<div class='fl dim'>{''.join(lines)}</div>")
        self._command = gui.add_html("")

    def _send_candidates(self) -> None:
        page = self._page
        page.exports.download("candidates.csv", files.candidates_csv(page.answering.best))

    def refresh(self) -> None:
        """Write the command that asks the same question."""
        state = self._page.session.state
        texts = {
            "The same question on the command line": command_line(state),
            "The same in Python": python_lines(state),
            "The bundle for the robot": export_line(state),
        }
        put(self._command, content=f"<div class='fl'>{''.join(map(_copied, texts, texts.values()))}</div>")


def _copied(title: str, text: str) -> str:
    """Lines that a click takes to the clipboard, where the browser lets it; else it selects them."""
    copy = "navigator.clipboard?.writeText(this.innerText); this.previousSibling.dataset.done = 1"
    return (
        f"<div class='said copy'><span class='dim'>{title}</span></div>"
        f'<pre class="command" title="click to copy" onclick="{copy}">{escape(text)}</pre>'
    )
