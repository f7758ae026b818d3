"""Two panels about designs: the shipped ones (task Design), and the files that can be made of this
one, each with a command that reads it (task Export)."""

import math
import shlex

import viser

from finlab.layout import Damage, Layout
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
    """What the bundle is for."""
    file = file_stem(state.layout.name) + BUNDLE
    purpose = (
        "for the robot: its actuators' physics, method, README and checksums. Test it there first"
    )
    return _file_card(file, purpose, shlex.join(["finlab-runtime", "check", file]))


def _graph(state: State) -> str:
    """What the graph is for."""
    file = file_stem(state.layout.name) + GRAPH
    purpose = (
        "the graph of actuators that the networks see: nodes, features, edges, for networkx and "
        "learners"
    )
    return _file_card(file, purpose, shlex.join(["finlab", "layout", "show", file]))


def _design(state: State) -> str:
    """What the design's own file is for."""
    purpose = "the design: for this app, and for commands at the desk"
    if has_files(state.layout):
        purpose += ", unpacked. The same question, of the bundle"
    else:
        purpose += ". The same question there"
    return _file_card(design_name(state.layout), purpose, command_line(state))


def _file_card(file: str, purpose: str, command: str) -> str:
    """The purpose of a file, and a command that reads it."""
    return copy_card(html("<b>{}</b> <span class='dim'>is {}:</span>", file, purpose), command)


def copy_card(words: str, text: str) -> str:
    """A text below some words, which a click copies to the clipboard, where the browser allows
    that."""
    copy = "navigator.clipboard?.writeText(this.innerText); this.previousSibling.dataset.done = 1"
    return html(
        "<div class='fl'><div class='said copy'>{}</div>"
        '<pre class="command" title="click to copy" onclick="{}">{}</pre></div>',
        words,
        copy,
        text,
    )


def command_line(state: State) -> str:
    """Returns the question of a state as a command, `finlab allocate`, of a file that this page
    makes."""
    layout = state.layout
    file = file_stem(layout.name) + BUNDLE if has_files(layout) else design_name(layout)
    words = ["finlab", "allocate", file, "--wrench"]
    words += [f"{component:g}" for component in state.target]
    words += _damage_options(layout, state.damage)
    if state.flow is not None:
        words += ["--flow", *(f"{component:g}" for component in state.flow)]
    if state.method != "dual":
        words += ["--method", state.method]
    if state.policy != "closest":
        words += ["--policy", state.policy]
    return shlex.join(words)


def _damage_options(layout: Layout, damage: Damage) -> list[str]:
    """The options of `finlab allocate` for a damage; its angles are in degrees there."""
    words = []
    for name in damage.lost:
        words += ["--lost", name]
    for name, share in damage.weak.items():
        words += ["--weak", f"{name}={share:g}"]
    for name, share in damage.torn.items():
        words += ["--torn", f"{name}={share:g}"]
    for name, stuck_at in damage.stuck.items():
        is_angle = layout.actuator(name).KIND.sticks_at_angle
        words += ["--stuck", f"{name}={math.degrees(stuck_at) if is_angle else stuck_at:g}"]
    for name, command in damage.running.items():
        kind = layout.actuator(name).KIND
        numbers = list(command)
        if kind.sticks_at_angle:
            numbers[kind.stuck_number] = math.degrees(numbers[kind.stuck_number])
        words += ["--running", f"{name}=" + ",".join(f"{number:g}" for number in numbers)]
    return words


def add_designs(page: Page) -> None:
    """The list of shipped designs, and the description of the present one."""

    def open_layout(name: str) -> None:
        if name in shipped():
            page.designs.open_shipped(shipped()[name])

    def entry(layout: Layout, is_edited: bool) -> str:
        return shipped_name(layout) or _own_entry(layout, is_edited)

    layouts = page.gui.add_dropdown(
        "Layout", tuple(shipped()), hint="Shipped layouts to start from."
    )
    page.board.show(layouts, options=_entries)
    page.bind(layouts, open_layout, entry)
    page.add_html(_description)


def _own_entry(layout: Layout, is_edited: bool) -> str:
    """The entry of a layout that is not shipped."""
    return f"{layout.name}, {'edited' if is_edited else 'yours'}"


def _entries(layout: Layout, is_edited: bool) -> tuple[str, ...]:
    """The shipped layouts, and the present one where it is another."""
    names = tuple(shipped())
    return names if shipped_name(layout) else (*names, _own_entry(layout, is_edited))


def _description(layout: Layout) -> str:
    """The first line of the layout's description."""
    first_line = layout.description.strip().split("\n")[0]
    shipped_descriptions = {other.description for other in shipped().values()}
    if shipped_name(layout) is None and layout.description in shipped_descriptions:
        # It describes the robot that this one was made from.
        first_line = f"Made from {layout.name}, and changed."
    return html("<div class='fl dim said'>{}</div>", first_line)
