"""The fins as a table: pressed to select, edited where a name or a number stands.

Keys are places in the layout, which stay when a fin gets another name.
"""

import math

from markupsafe import Markup

from webapp.editables import edit, press
from webapp.markup.answer import swatch
from webapp.markup.html import html
from webapp.session.links import partner
from webapp.session.state import MARKS, State

AXES = ("x", "y", "z")
LOCK = Markup(
    "<rect x='2.5' y='6.5' width='9' height='6' rx='1.2'/><path d='M4.5 6.5V4.5a2.5 2.5 0 0 1 5 0v{}'/>"
)
EYE = Markup("<path d='M1 7c2.4-4.6 9.6-4.6 12 0c-2.4 4.6-9.6 4.6-12 0z'/><circle cx='7' cy='7' r='1.9'/>{}")
HULL = Markup(
    "<svg class='hull' width='18' height='18' viewBox='0 0 18 18'>"
    "<ellipse cx='9' cy='9' rx='7.5' ry='4.5'/></svg>"
)
"""A small picture of a hull."""
SHAPES = {
    ("locked", True): LOCK.format(2),
    ("locked", False): LOCK.format("0.4"),
    ("hidden", True): EYE.format(Markup("<path d='M2 12L12 2'/>")),
    ("hidden", False): EYE.format(""),
}
"""Lines of the icons, by mark and whether it is set."""
SAYS = {
    ("locked", True): "Locked: nothing moves or changes it. Press to unlock.",
    ("locked", False): "Lock it: nothing moves or changes it.",
    ("hidden", True): "Hidden in the view. Press to show it.",
    ("hidden", False): "Hide it in the view; it goes on working.",
}


def fin_list(state: State, selection: tuple[str, ...]) -> str:
    """All fins with their places.

    Args:
        state: the robot.
        selection: names of the fins that are selected.
    """
    heads = Markup().join(html("<th class='place'>{}</th>", axis) for axis in AXES)
    names = state.layout.names
    rows = [_row(state, index, name in selection) for index, name in enumerate(names)]
    chosen = "" if selection else "chosen"
    robot = html(
        "<tr class='{}' {}><td colspan='6'>{}<span class='name whole'>{}</span></td></tr>",
        chosen,
        press("robot", ""),
        HULL,
        state.layout.name,
    )
    heads += Markup("<th class='place' title='Azimuth of the shaft'>shaft</th><th></th>")
    return html(
        "<div class='fl fin-list'><table><tr><th></th>{}</tr>{}{}</table><div class='dim "
        "units'>Press to select, with Ctrl or Shift several; press twice to edit. <span "
        "class='place'>x, y, z in m, shaft in °.</span></div></div>",
        heads,
        robot,
        rows,
    )


def _row(state: State, index: int, chosen: bool) -> str:
    fin, key = state.layout.fins[index], str(index)
    name = fin.name
    kinds = ["chosen"] * chosen + ["off"] * (fin.name in state.hidden)
    places = Markup().join(
        _cell(edit(f"fin-{axis}", key, _exact(value, 4), f"{axis} of {fin.name} [m]"), f"{value:.3f}")
        for axis, value in zip(AXES, fin.position, strict=True)
    )
    degrees = math.degrees(fin.mounting_angle)
    shaft = _cell(edit("fin-shaft", key, _exact(degrees, 2), f"shaft of {fin.name} [°]"), f"{degrees:.0f}")
    called = edit("fin-name", key, fin.name, f"name of {fin.name}")
    twin = partner(state.links, fin.name)
    paired = "" if twin is None else html("<span class='dim' title='moves with {}'>⇄</span>", twin)
    words = html("<span class='name edit' title='{}' {}>{}</span>", name, called, name)
    marks = Markup().join(_mark(mark, key, name, fin.name in getattr(state, mark)) for mark in MARKS)
    return html(
        "<tr class='{}' data-fin='{}' {}><td>{}{}{}</td>{}{}<td class='marks'>{}</td></tr>",
        " ".join(kinds),
        name,
        press("fin", key),
        swatch(index, fin.name in state.failed),
        words,
        paired,
        places,
        shaft,
        marks,
    )


def _exact(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _cell(attributes: str, shown: str) -> str:
    # Zero has no sign: rounded numbers may have lost all but that.
    plain = (shown if float(shown) else shown.lstrip("-")).replace("-", "−")
    return html("<td class='place'><span class='edit' {}>{}</span></td>", attributes, plain)


def _mark(mark: str, key: str, name: str, on: bool) -> str:
    return html(
        "<button class='icon{}' {} aria-pressed='{}' aria-label='{} {}' title='{}'><svg "
        "width='14' height='14' viewBox='0 0 14 14'>{}</svg></button>",
        " on" if on else "",
        press(mark, key),
        str(on).lower(),
        mark,
        name,
        SAYS[mark, on],
        SHAPES[mark, on],
    )
