"""Two panels of task Export: the robot in the formats of others, and the question as a script."""

from itertools import groupby

import viser

from finlab.errors import FinlabError
from webapp.handles import button
from webapp.markup.python_script import script_of
from webapp.markup.words import html
from webapp.page import Page
from webapp.panels.files_tab import copy_card
from webapp.session.files import robot_file, shipped_name
from webapp.session.state import State
from webapp.tasks.take_home import Offer
from webapp.viser_internals import run_script

COPY_SCRIPT = "document.querySelector('[data-fl~=Python] pre.command').click();"
"""What the button does that copies the script: as a click on the script."""


def add_take_home(page: Page) -> None:
    """A button for each format, what it is for, and why it is not to be had."""
    page.presses.on("home", lambda key, _: page.designs.take_home(key))
    page.add_html(_offers)


def _offers(offers: tuple[Offer, ...] | None, is_offered: bool, offers_error: str | None) -> str:
    """The formats by group."""
    if offers_error is not None:
        return html("<div class='fl missing'>{}</div>", offers_error)
    if offers is None or not is_offered:
        return html("<div class='fl dim'>looking which formats can hold this robot …</div>")
    groups = []
    for title, of_group in groupby(offers, key=lambda offer: offer.format.group):
        rows = [_row(offer) for offer in of_group]
        groups.append(html("<div class='group'>{}</div>{}", title, rows))
    return html("<div class='fl fl-home'>{}</div>", groups)


def _row(offer: Offer) -> str:
    """A format: its button, the file's name, and what there is to know of it."""
    form = offer.format
    attributes = html("title='{}'", offer.file_name)
    words = form.purpose
    style = ""
    if offer.reason:
        attributes = html("disabled aria-describedby='home-{}'", form.key)
        words = html("<span id='home-{}' class='dim'>{}</span>", form.key, offer.reason)
        style = "off"
    elif offer.notes:
        template = "{}<details><summary>what to know</summary>{}</details>"
        words = html(template, words, " ".join(offer.notes))
    pressed = button(form.label, "home", form.key, attributes)
    return html("<div class='row {}'>{}<div>{}</div></div>", style, pressed, words)


def add_python(page: Page) -> None:
    """The script, and a button that copies it."""

    def copy() -> None:
        run_script(page.gui, COPY_SCRIPT)

    page.add_button(
        "Copy as Python",
        copy,
        icon=viser.Icon.BRAND_PYTHON,
        hint="A script that prints the same answer.",
    )

    def script(state: State, mode: int) -> str:
        try:
            text = script_of(state, page.solver.checkpoint_of(state))
        except FinlabError as error:
            return html("<div class='fl missing'>{}</div>", str(error))
        robot = robot_file(state.layout)
        words = "It prints the answer"
        if mode > 0:
            words += ", not the other way to give it that is shown"
        if f"load_layout({robot!r})" in text and robot != shipped_name(state.layout):
            words += f"; save {robot} beside it"
        return copy_card(html("<span class='dim'>{}:</span>", words), text)

    page.add_html(script)
