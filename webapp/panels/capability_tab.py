"""Tab with the capability plot: what the robot can hold by heading, with all actuators and after
each single loss."""

from collections.abc import Callable
from functools import partial

import viser
from markupsafe import Markup

from finlab.analysis.capability import Capability
from finlab.analysis.capability_text import capability_remarks
from finlab.display import as_sentence
from finlab.layout import Layout
from webapp.handles import add_html
from webapp.markup.polar import polar_file, polar_plot
from webapp.markup.words import html, in_app, marker
from webapp.page import Page
from webapp.session.given_loads import GivenLoads
from webapp.session.state import State
from webapp.tasks.capability import CapabilityQuestion, capability_json, read_given_loads

LOAD_FILES = ".csv,.yaml,.yml,.json"
"""Suffixes of the files that have loads."""
FORCE_WORDS = (
    "The largest steady force from each heading that is held with all other axes at zero: 0° from "
    "ahead, 90° from starboard."
)
"""What is plotted where no loads were given."""


def add_capability(page: Page) -> None:
    """Buttons, and the plot."""
    session = page.session
    gui = page.gui
    board = page.board
    plot = page.jobs.capability

    def start() -> None:
        plot.forget()
        plot.ask(CapabilityQuestion.of_state(session.state, session.given_loads))

    def take(loads: GivenLoads | None) -> None:
        session.given_loads = loads
        start()

    def load(name: str, content: bytes) -> None:
        page.deferred.make(partial(read_given_loads, name, content), take, "loads")

    add_html(gui, marker("fl-primary"))
    button = page.add_button(
        "Plot what it can hold",
        start,
        icon=viser.Icon.RADAR_2,
        hint="As it is, and without each one of its actuators.",
    )
    board.show(button, disabled=lambda plotting: plotting)
    bar = gui.add_progress_bar(0.0, visible=False)
    board.show(bar, value=lambda plot_progress: 100.0 * (plot_progress or 0.0))
    cancel = page.add_button("Cancel", plot.forget, icon=viser.Icon.X, visible=False)
    for handle in (bar, cancel):
        board.show(handle, visible=lambda plotting: plotting)
    page.add_upload(
        "Loads of its own",
        load,
        icon=viser.Icon.UPLOAD,
        mime_type=LOAD_FILES,
        hint="Particulars of a ship, for DNV-ST-0111 level 1 (YAML), or a load for each heading "
        "(CSV): see Ships in the documentation.",
    )
    drop = page.add_button("Leave these loads", partial(take, None), icon=viser.Icon.X)
    board.show(drop, visible=lambda given_loads: given_loads is not None)
    page.add_html(_about)
    page.add_html(_remarks)
    _add_saving(page)
    add_html(gui, marker("fl-column"))
    page.add_html(_picture)


def _add_saving(page: Page) -> None:
    """The plot as files."""
    files: dict[str, Callable[[Capability, Layout], tuple[str, bytes]]] = {
        "CSV": lambda plot, _: ("csv", plot.to_csv().encode()),
        "JSON": lambda plot, _: ("json", capability_json(plot)),
        "SVG": lambda plot, layout: ("svg", polar_file(plot, layout.names).encode()),
    }

    def save(form: str) -> None:
        plot = page.jobs.capability.answer
        question = page.jobs.capability.answered
        if plot is not None and question is not None:
            page.designs.save_capability(plot, partial(files[form], plot, question.layout))

    acts = {form: partial(save, form) for form in files}
    hint = "A table, all loads with a certificate of each no, or the picture."
    saving = page.add_buttons("Save as", acts, visible=False, hint=hint)
    page.board.show(saving, visible=lambda capability_plot: capability_plot is not None)


def _about(given_loads: GivenLoads | None) -> str:
    """Which loads are meant."""
    words = FORCE_WORDS
    if given_loads is not None:
        words = f"The share of each load of {given_loads.file} that is held."
        if given_loads.ship is not None:
            words = (
                f"DP capability numbers by DNV-ST-0111, level 1, for the ship of "
                f"{given_loads.file}."
            )
    return html("<div class='fl dim said'>{}</div>", words)


def _remarks(
    capability_plot: Capability | None,
    capability_question: CapabilityQuestion | None,
    capability_error: str | None,
    plotting: bool,
    state: State,
    given_loads: GivenLoads | None,
) -> str:
    """What the plot says, or why there is none."""
    if plotting:
        return html("<div class='fl dim'>computing …</div>")
    if capability_error is not None:
        return html("<div class='fl missing'>{}</div>", in_app(as_sentence(capability_error)))
    if capability_plot is None:
        return ""
    remarks = [in_app(remark) for remark in capability_remarks(capability_plot)]
    if capability_question != CapabilityQuestion.of_state(state, given_loads):
        remarks.append(html("<span class='missing'>{}</span>", "The robot has changed since."))
    return html("<div class='fl said'>{}</div>", Markup(" ").join(remarks))


def _picture(
    capability_plot: Capability | None, capability_question: CapabilityQuestion | None
) -> str:
    """The plot."""
    if capability_plot is None or capability_question is None:
        return ""
    picture = polar_plot(capability_plot, capability_question.layout.names)
    return html("<div class='fl'>{}</div>", picture)
