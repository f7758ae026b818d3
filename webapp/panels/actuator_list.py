"""The list of fins: select, copy, add and remove."""

import math
from collections.abc import Callable
from functools import partial

from markupsafe import Markup

from finlab.errors import FinlabError
from finlab.layout import Fin
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html
from webapp.markup.answer import swatch
from webapp.markup.html import html, marker
from webapp.page import Page
from webapp.presses import press
from webapp.session.layout_edits import NEW
from webapp.session.links import partner
from webapp.session.state import State

HULL = Markup(
    "<svg class='hull' width='18' height='18' viewBox='0 0 18 18'>"
    "<ellipse cx='9' cy='9' rx='7.5' ry='4.5'/></svg>"
)
RING_SIZES = (2, 3, 4, 5, 6, 8)


def add_actuator_list(page: Page) -> None:
    """A table, and below it what can be done with the fins that are selected in it."""
    session = page.session

    def select(key: str, held: str) -> None:
        names = session.state.layout.names
        if not key.isdecimal() or int(key) >= len(names):
            raise FinlabError("that fin is gone")
        (session.select_also if held else session.select)(names[int(key)])

    page.add_html(actuator_list)
    page.presses.on("fin", select)
    page.presses.on("robot", lambda _key, _held: session.select(None))
    add_html(page.gui, marker("fl-primary"))
    adds = {kind.capitalize(): partial(session.add, kind) for kind in NEW}
    page.add_buttons("Add", adds, hint=f"On the hull; up to {MAX_ACTUATORS} actuators.")
    edits: dict[str, Callable[[], object]] = {
        "Mirror": session.mirror,
        "Unlink": session.unlink,
        "Duplicate": session.duplicate,
        "To hull": session.stick,
        "Delete": session.delete,
    }
    page.add_buttons("Selected fin", edits, hint="What Mirror (M) makes moves along until it is unlinked.")
    rings = {str(count): partial(session.ring, count) for count in RING_SIZES}
    about = "Copies of the selected fin, so that so many stand evenly around the vertical axis."
    page.add_buttons("Copies around", rings, hint=about)


def actuator_list(state: State, selection: tuple[str, ...]) -> str:
    """All fins with their places; `selection` has the names of those that are selected."""
    heads = Markup().join(html("<th class='place'>{}</th>", axis) for axis in ("x", "y", "z"))
    names = state.layout.names
    robot = html(
        "<tr class='{}' {}><td colspan='5'>{}<span class='name whole'>{}</span></td></tr>",
        "" if selection else "chosen",
        press("robot", ""),
        HULL,
        state.layout.name,
    )
    return html(
        "<div class='fl fin-list'><table><tr><th></th>{}<th class='place' title='Azimuth of the shaft'>"
        "shaft</th></tr>{}{}</table><div class='dim units'>Press to select, with Ctrl several. "
        "<span class='place'>x, y, z in m, shaft in °.</span></div></div>",
        heads,
        robot,
        [_row(state, index, name in selection) for index, name in enumerate(names)],
    )


def _row(state: State, index: int, chosen: bool) -> str:
    fin = state.layout.actuators[index]
    horizontal = isinstance(fin, Fin) and fin.mounting_angle is not None
    shaft = f"{math.degrees(math.atan2(*fin.frame[0][1::-1])):.0f}" if horizontal else ""
    places = (*(f"{value:.3f}" for value in fin.position), shaft)
    twin = partner(state.links, fin.name)
    return html(
        "<tr class='{}' data-fin='{}' {}><td>{}<span class='name' title='{}'>{}</span>{}</td>{}</tr>",
        "chosen" if chosen else "",
        fin.name,
        press("fin", str(index)),
        swatch(index, fin.name in state.failed),
        fin.name,
        fin.name,
        html("<div class='dim'>{}</div>", fin.type)
        if not isinstance(fin, Fin)
        else ""
        if twin is None
        else html("<span class='dim' title='moves with {}'>⇄</span>", twin),
        [_cell(shown) for shown in places],
    )


def _cell(shown: str) -> str:
    # Zero has no sign: rounded numbers may have lost all but that.
    plain = (shown if float(shown or 0) else shown.lstrip("-")).replace("-", "−")
    return html("<td class='place'>{}</td>", plain)
