"""The list of actuators: select, copy, add and remove."""

import math
from collections.abc import Callable
from functools import partial

from markupsafe import Markup

from finlab.actuators.kinds import KINDS
from finlab.layout import Actuator
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html, placed, press
from webapp.markup.answer import swatch
from webapp.markup.words import html, kind_words, marker
from webapp.page import Page
from webapp.panels.pairs import telling_pairs
from webapp.session.layout_edits import partner
from webapp.session.state import State

HULL = Markup(
    "<svg class='hull' width='18' height='18' viewBox='0 0 18 18'>"
    "<ellipse cx='9' cy='9' rx='7.5' ry='4.5'/></svg>"
)
RING_SIZES = (2, 3, 4, 5, 6, 8)
AXES = {"z, up": "z", "x, ahead": "x", "y, left": "y"}
POINTS = "Azimuth of a shaft, a fixed axis, or an azimuth at angle 0, and how far it rises"
LEVEL = 0.5
"""Degrees up to which a direction counts as level."""


def add_actuator_list(page: Page) -> None:
    """What can be done with what is selected in a table, and below it the table: no button moves
    where the table grows."""
    session = page.session

    def select(key: str, modifier: str) -> None:
        names = session.state.layout.names
        (session.select_also if modifier else session.select)(names[placed(key, len(names))])

    page.presses.on("fin", select)
    page.presses.on("robot", lambda _key, _modifier: session.select(None))
    adds = {kind_words(kind): partial(session.add, kind) for kind in KINDS}
    page.add_buttons("Add", adds, hint=f"On the hull; up to {MAX_ACTUATORS} actuators.")
    edits: dict[str, Callable[[], object]] = {
        "Mirror": telling_pairs(page, session.mirror),
        "Unlink": session.unlink,
        "Duplicate": session.duplicate,
        "Delete": telling_pairs(page, session.delete),
    }
    hint = "What Mirror (M) makes moves along until it is unlinked."
    add_html(page.gui, marker("fl-deletes"))
    page.add_buttons("Selected", edits, hint=hint)
    axis = page.gui.add_dropdown(
        "Around", tuple(AXES), hint="The axis for copies of the selected one."
    )

    def ring(count: int) -> None:
        session.ring(count, AXES[axis.value])

    hint = "Copies of the selected one, so that so many stand evenly around the axis, turned along."
    page.add_buttons("Copies", {str(k): partial(ring, k) for k in RING_SIZES}, hint=hint)
    page.add_html(actuator_list)


def actuator_list(state: State, selection: tuple[str, ...]) -> str:
    """All actuators with their places and directions; `selection` has the names of the selected
    ones."""
    heads = Markup().join(html("<th class='place'>{}</th>", axis) for axis in ("x", "y", "z"))
    names = state.layout.names
    kinds = sorted({actuator.type for actuator in state.layout.actuators})
    robot = html(
        "<tr class='{}' {}><td colspan='5'>{}<span class='name whole'>{}</span></td></tr>",
        "" if selection else "chosen",
        press("robot", ""),
        HULL,
        state.layout.name,
    )
    return html(
        "<div class='fl fin-list'><table><tr><th>{}</th>{}<th class='place' title='{}'>points</th>"
        "</tr>{}{}</table><div class='dim units'>Press to select, with Ctrl several. <span "
        "class='place'>"
        "x, y, z in m, points in °.</span></div></div>",
        kinds[0] if len(kinds) == 1 else "",
        heads,
        POINTS,
        robot,
        [
            _rows(state, index, name in selection, len(kinds) > 1)
            for index, name in enumerate(names)
        ],
    )


def _rows(state: State, index: int, is_selected: bool, is_mixed: bool) -> str:
    """The row of an actuator; in a mixed list the first of several of a type has that above it."""
    actuators = state.layout.actuators
    actuator = actuators[index]
    name = actuator.name
    head = ""
    if is_mixed and (index == 0 or actuators[index - 1].type != actuator.type):
        head = html("<tr><th colspan='5'>{}</th></tr>", actuator.type)
    link = ""
    twin = partner(state.layout, name)
    if twin is not None:
        link = html("<span class='dim' title='moves with {}'>⇄</span>", twin)
    columns = [_minus(f"{value:.3f}") for value in actuator.position]
    columns.append(points_words(actuator))
    return html(
        "{}<tr class='{}' data-fin='{}' {}>"
        "<td>{}<span class='name {}' title='{}'>{}</span>{}</td>{}</tr>",
        head,
        "chosen" if is_selected else "",
        name,
        press("fin", str(index)),
        swatch(index, name in state.lost),
        "" if twin is None else "paired",
        name,
        name,
        link,
        [html("<td class='place'>{}</td>", text) for text in columns],
    )


def points_words(actuator: Actuator) -> str:
    """Where an actuator points, in degrees: `60`, `60 ↑30`, `up`."""
    x, y, z = actuator.direction
    turn = math.degrees(math.atan2(y, x))
    rise = math.degrees(math.atan2(z, math.hypot(x, y)))
    if abs(rise) > 90.0 - LEVEL:
        return "up" if rise > 0.0 else "down"
    sign = f" {'↑' if rise > 0.0 else '↓'}{abs(rise):.0f}" if abs(rise) > LEVEL else ""
    return _minus(f"{turn:.0f}") + sign


def _minus(text: str) -> str:
    """A rounded number with a real minus sign; zero has none."""
    return (text if float(text) else text.lstrip("-")).replace("-", "−")
