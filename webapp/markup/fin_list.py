"""The fins as a table: pressed to select, edited where a name or a number stands.

Keys are places in the layout, which stay when a fin gets another name.
"""

import math
from html import escape

from webapp.editables import edit, press
from webapp.markup.answer import swatch
from webapp.session.links import partner
from webapp.session.state import MARKS, State

AXES = ("x", "y", "z")
LOCK = "<rect x='2.5' y='6.5' width='9' height='6' rx='1.2'/><path d='M4.5 6.5V4.5a2.5 2.5 0 0 1 5 0v{}'/>"
EYE = "<path d='M1 7c2.4-4.6 9.6-4.6 12 0c-2.4 4.6-9.6 4.6-12 0z'/><circle cx='7' cy='7' r='1.9'/>{}"
HULL = (
    "<svg class='hull' width='18' height='18' viewBox='0 0 18 18'>"
    "<ellipse cx='9' cy='9' rx='7.5' ry='4.5'/></svg>"
)
"""A small picture of a hull."""
SHAPES = {
    ("locked", True): LOCK.format(2),
    ("locked", False): LOCK.format("0.4"),
    ("hidden", True): EYE.format("<path d='M2 12L12 2'/>"),
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
    heads = "".join(f"<th class='place'>{axis}</th>" for axis in AXES)
    names = state.layout.names
    rows = [_row(state, index, name in selection) for index, name in enumerate(names)]
    chosen = "" if selection else "chosen"
    robot = (
        f"<tr class='{chosen}' {press('robot', '')}><td colspan='6'>{HULL}<span class='name whole'>"
        f"{escape(state.layout.name)}</span></td></tr>"
    )
    heads += "<th class='place' title='Azimuth of the shaft'>shaft</th><th></th>"
    return (
        f"<div class='fl fin-list'><table><tr><th></th>{heads}</tr>{robot}{''.join(rows)}</table>"
        "<div class='dim units'>Press to select, with Ctrl or Shift several; press twice to edit. "
        "<span class='place'>x, y, z in m, shaft in °.</span></div></div>"
    )


def _row(state: State, index: int, chosen: bool) -> str:
    fin, key = state.layout.fins[index], str(index)
    name = escape(fin.name)
    kinds = ["chosen"] * chosen + ["off"] * (fin.name in state.hidden)
    places = "".join(
        _cell(edit(f"fin-{axis}", key, _exact(value, 4), f"{axis} of {fin.name} [m]"), f"{value:.3f}")
        for axis, value in zip(AXES, fin.position, strict=True)
    )
    degrees = math.degrees(fin.mounting_angle)
    shaft = _cell(edit("fin-shaft", key, _exact(degrees, 2), f"shaft of {fin.name} [°]"), f"{degrees:.0f}")
    called = edit("fin-name", key, fin.name, f"name of {fin.name}")
    twin = partner(state.links, fin.name)
    paired = "" if twin is None else f"<span class='dim' title='moves with {escape(twin)}'>⇄</span>"
    words = f"<span class='name edit' title='{name}' {called}>{name}</span>"
    marks = "".join(_mark(mark, key, name, fin.name in getattr(state, mark)) for mark in MARKS)
    return (
        f"<tr class='{' '.join(kinds)}' data-fin='{name}' {press('fin', key)}>"
        f"<td>{swatch(index, fin.name in state.failed)}{words}{paired}</td>{places}{shaft}"
        f"<td class='marks'>{marks}</td></tr>"
    )


def _exact(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _cell(attributes: str, shown: str) -> str:
    # Zero has no sign: rounded numbers may have lost all but that.
    plain = (shown if float(shown) else shown.lstrip("-")).replace("-", "−")
    return f"<td class='place'><span class='edit' {attributes}>{plain}</span></td>"


def _mark(mark: str, key: str, name: str, on: bool) -> str:
    return (
        f"<button class='icon{' on' if on else ''}' {press(mark, key)} aria-pressed='{str(on).lower()}' "
        f"aria-label='{mark} {name}' title='{escape(SAYS[mark, on])}'>"
        f"<svg width='14' height='14' viewBox='0 0 14 14'>{SHAPES[mark, on]}</svg></button>"
    )
