"""Export: what the robot needs, and the question as a command to copy."""

import math
import shlex

import viser

from finlab.layout.damage import Health
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.page import Page
from webapp.session.files import file_stem, shipped_name
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


def command_line(state: State) -> str:
    """The same question for `finlab allocate`."""
    words = ["finlab", "allocate", _layout_name(state), "--wrench"]
    words += [f"{value:g}" for value in state.target]
    for name in state.failed:
        words += ["--failed", name]
    health = state.health or Health()
    for name, share in health.weak:
        words += ["--health", f"{name}={share:g}"]
    for name, share in health.thrust:
        words += ["--torn", f"{name}={share:g}"]
    for name, angle in health.stuck:
        words += ["--stuck", f"{name}={math.degrees(angle):g}"]
    for name, (amplitude, frequency, angle) in health.running:
        words += ["--running", f"{name}={amplitude:g},{frequency:g},{math.degrees(angle):g}"]
    if state.flow is not None:
        words += ["--flow", *(f"{value:g}" for value in state.flow)]
    if state.method != "dual":
        words += ["--method", state.method]
    if state.policy != "closest":
        words += ["--policy", state.policy]
    return shlex.join(words)


def _layout_name(state: State) -> str:
    """A shipped layout by its name, any other by the file that is saved of it."""
    return shipped_name(state.layout) or f"{file_stem(state.layout.name)}.yaml"
