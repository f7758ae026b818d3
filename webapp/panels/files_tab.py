"""Designs that are shipped, and files that are made of this one: what each is for, and what takes
it."""

import math
import shlex

import viser

from finlab.layout import Layout
from webapp.handles import add_html
from webapp.markup.words import html, marker
from webapp.page import Page
from webapp.session.files import (
    BUNDLE,
    GRAPH,
    design_name,
    file_stem,
    has_files,
    shipped,
    shipped_name,
)
from webapp.session.state import State


def add_files(page: Page) -> None:
    """A button for each file, what it is for, and commands that take it."""
    add_html(page.gui, marker("fl-primary"))
    icon = viser.Icon.PACKAGE_EXPORT
    page.add_button("Export the bundle (ZIP)", page.designs.bundle, icon=icon)
    page.add_html(_bundle)
    page.add_button("Export the graph (JSON)", page.designs.graph, icon=viser.Icon.TOPOLOGY_COMPLEX)
    page.add_html(_graph)
    page.add_button("Save the design", page.designs.save, icon=viser.Icon.DEVICE_FLOPPY)
    page.add_html(_design)


def _bundle(state: State) -> str:
    file = file_stem(state.layout.name) + BUNDLE
    about = (
        "for the robot: its actuators' physics, method, README and checksums. Test it there first"
    )
    return _about(file, about, shlex.join(["finlab-runtime", "check", file]))


def _graph(state: State) -> str:
    file = file_stem(state.layout.name) + GRAPH
    about = (
        "the graph of actuators that the networks see: nodes, features, edges, for networkx and "
        "learners"
    )
    return _about(file, about, shlex.join(["finlab", "layout", "show", file]))


def _design(state: State) -> str:
    about = "the design: for this app, and for commands at the desk"
    if has_files(state.layout):
        about += ", unpacked. The same question, of the bundle"
    else:
        about += ". The same question there"
    return _about(design_name(state.layout), about, command_line(state))


def _about(file: str, about: str, command: str) -> str:
    """What a file is for, and a line that a click takes to the clipboard, where the browser lets
    it."""
    copy = "navigator.clipboard?.writeText(this.innerText); this.previousSibling.dataset.done = 1"
    return html(
        "<div class='fl'><div class='said copy'><b>{}</b> <span class='dim'>is {}:</span></div>"
        '<pre class="command" title="click to copy" onclick="{}">{}</pre></div>',
        file,
        about,
        copy,
        command,
    )


def command_line(state: State) -> str:
    """The same question for `finlab allocate`, of a file that this page makes."""
    layout = state.layout
    file = file_stem(layout.name) + BUNDLE if has_files(layout) else design_name(layout)
    words = ["finlab", "allocate", file, "--wrench"]
    words += [f"{value:g}" for value in state.target]
    damage = state.damage
    for name in damage.lost:
        words += ["--lost", name]
    for kind, shares in (("weak", damage.weak), ("torn", damage.torn)):
        for name, share in shares.items():
            words += [f"--{kind}", f"{name}={share:g}"]
    for name, held in damage.stuck.items():
        turns = layout.actuator(name).KIND.sticks_at_angle
        words += ["--stuck", f"{name}={math.degrees(held) if turns else held:g}"]
    for name, command in damage.running.items():
        actuator = layout.actuator(name)
        numbers = list(command)
        if actuator.KIND.sticks_at_angle:
            numbers[actuator.KIND.stuck_number] = math.degrees(numbers[actuator.KIND.stuck_number])
        words += ["--running", f"{name}=" + ",".join(f"{number:g}" for number in numbers)]
    if state.flow is not None:
        words += ["--flow", *(f"{value:g}" for value in state.flow)]
    if state.method != "dual":
        words += ["--method", state.method]
    if state.policy != "closest":
        words += ["--policy", state.policy]
    return shlex.join(words)


def add_designs(page: Page) -> None:
    """The list of shipped designs, and what is said of this one."""

    def open_layout(name: str) -> None:
        if name in shipped():
            page.session.open_layout(shipped()[name])

    layouts = page.gui.add_dropdown(
        "Layout", tuple(shipped()), hint="Shipped layouts to start from."
    )
    page.board.show(layouts, options=_options)
    page.bind(
        layouts, open_layout, lambda layout, saved: shipped_name(layout) or _own(layout, saved)
    )
    page.add_html(_described)


def _own(layout: Layout, saved: Layout) -> str:
    return f"{layout.name}, {'yours' if layout == saved else 'edited'}"


def _options(layout: Layout, saved: Layout) -> tuple[str, ...]:
    return tuple(shipped()) if shipped_name(layout) else (*shipped(), _own(layout, saved))


def _described(layout: Layout) -> str:
    first = layout.description.strip().split("\n")[0]
    known = {shipped_layout.description for shipped_layout in shipped().values()}
    if shipped_name(layout) is None and layout.description in known:  # which is about another robot
        first = f"Made from {layout.name}, and changed."
    return html("<div class='fl dim said'>{}</div>", first)
