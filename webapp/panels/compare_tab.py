"""Several methods on the same wrench."""

import viser

from webapp.handles import add_html
from webapp.markup.comparison import comparison_table
from webapp.markup.picking import marker
from webapp.page import Page


def add_comparison(page: Page) -> None:
    """A button and a table."""
    add_html(page.gui, marker("fl-primary"))
    run = page.add_button(
        "Compare the methods",
        lambda: page.jobs.comparison.start(page.session.state),
        icon=viser.Icon.SCALE,
        hint="For the present wrench and failures.",
    )
    page.board.show(run, disabled=lambda run: run.running)
    page.add_html(lambda run, state: comparison_table(run, run.state not in (None, state)))
