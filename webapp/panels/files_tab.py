"""Files: open and save a layout, take home what the robot needs, copy the question as a command."""

from html import escape

import viser

from webapp.handles import put
from webapp.markup.snippets import command_line, export_line, python_lines
from webapp.page import Page
from webapp.session import files


class FilesTab:
    """Buttons for files, and the same question as a command."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        page.add_upload(
            "Open a layout file",
            page.designs.open,
            icon=viser.Icon.FOLDER_OPEN,
            mime_type=".yaml,.yml,.json,.zip",
            hint="A layout file (YAML, JSON), a graph file, a bundle, or a layout zipped with its tables.",
        )
        hint = "Measured fins come along in a ZIP. The HTML page moves by itself and needs no server."
        saves = {
            "Layout (YAML)": page.designs.save,
            "Candidates (CSV)": self._send_candidates,
            "Picture (PNG)": page.exports.picture,
            "3D view (HTML)": lambda: page.exports.html(page.shown),
        }
        page.add_buttons("Save", saves, hint=hint)
        page.add_buttons(
            "For the robot",
            {"Graph file": page.exports.graph, "Bundle (ZIP)": page.exports.bundle},
            hint="The layout graph alone, or with the fins' physics and checksums: what finlab export makes.",
        )
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
