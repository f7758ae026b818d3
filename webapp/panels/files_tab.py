"""Export: what the robot needs, and the question as a command to copy."""

import viser

from webapp.handles import add_html
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.snippets import command_line
from webapp.page import Page
from webapp.session.state import State


def add_files(page: Page) -> None:
    """A button for the robot's bundle, and the same question as a command."""
    about = "The robot, its fins' physics, README and checksums: what finlab export makes."
    add_html(page.gui, marker("fl-primary"))
    icon = viser.Icon.PACKAGE_EXPORT
    page.add_button("Export the bundle (ZIP)", page.jobs.exports.bundle, icon=icon, hint=about)
    page.add_html(_copied)


def _copied(state: State) -> str:
    """A line that a click takes to the clipboard, where the browser lets it; else it selects it."""
    copy = "navigator.clipboard?.writeText(this.innerText); this.previousSibling.dataset.done = 1"
    return html(
        "<div class='fl'><div class='said copy'><span class='dim'>The same question on the command line"
        '</span></div><pre class="command" title="click to copy" onclick="{}">{}</pre></div>',
        copy,
        command_line(state),
    )
