"""Where designs come from: the shipped ones, and what is said of this one."""

from finlab.layout import Layout
from webapp.markup.html import html
from webapp.page import Page
from webapp.session.files import shipped, shipped_name
from webapp.viser_internals import run_file


def add_designs(page: Page) -> None:
    """The list of shipped designs, and what is said of this one."""

    def open_layout(name: str) -> None:
        if name in shipped():
            page.session.open_layout(shipped()[name])

    layouts = page.gui.add_dropdown("Layout", tuple(shipped()), hint="Shipped layouts to start from.")
    page.board.show(layouts, options=_options)
    page.bind(layouts, open_layout, lambda layout, saved: shipped_name(layout) or _own(layout, saved))
    page.add_html(_about)
    run_file(page.gui, "designs.js")


def _own(layout: Layout, saved: Layout) -> str:
    return f"{layout.name}, {'yours' if layout == saved else 'edited'}"


def _options(layout: Layout, saved: Layout) -> tuple[str, ...]:
    return tuple(shipped()) if shipped_name(layout) else (*shipped(), _own(layout, saved))


def _about(layout: Layout) -> str:
    first = layout.description.strip().split("\n")[0]
    known = {shipped_layout.description for shipped_layout in shipped().values()}
    if shipped_name(layout) is None and layout.description in known:  # which is about another robot
        first = f"Made from {layout.name}, and changed."
    return html("<div class='fl dim said'>{}</div>", first)
