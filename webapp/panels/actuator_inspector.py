"""What a layout says of the selected actuators: place, direction, limits, model. An edit counts for
all."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup

from finlab.actuators.actuator import Actuator, Box
from finlab.actuators.kinds import KINDS
from finlab.axes import Vector
from finlab.layout import Layout
from webapp.markup.answer import swatch
from webapp.markup.words import html
from webapp.page import Page
from webapp.panels.actuator_model import add_fit, add_model, of_part
from webapp.session.state import number

SNAPS: dict[str, Vector] = {
    "+x": (1.0, 0.0, 0.0),
    "−x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "−y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "−z": (0.0, 0.0, -1.0),
}


def add_actuator(page: Page) -> None:
    """Widgets about the selected actuators."""
    session = page.session
    gui = page.gui

    def rename(name: str) -> None:
        if session.selected is not None:
            session.rename(session.selected, name)

    page.add_html(_headline)
    with gui.add_folder(None) as full:
        page.bind(gui.add_text("Name", ""), rename, lambda selected: selected or "")
        with gui.add_folder("Place"):
            _add_place(page)
        with gui.add_folder("Limits"):
            _add_boxes(page, [kind.BOXES for kind in KINDS.values()])
        with gui.add_folder("Model"):
            add_model(page)
            _add_boxes(page, [kind.LAW_BOXES for kind in KINDS.values()])
            add_fit(page)
    page.board.show(full, visible=lambda selected: selected is not None)


def _add_place(page: Page) -> None:
    session = page.session
    gui = page.gui
    board = page.board

    def turn(degrees: Any) -> None:
        session.turn_selected(math.radians(number(degrees, "shaft [°]", -3600.0, 3600.0)))

    def aim(degrees: tuple[Any, Any]) -> None:
        turn, rise = (
            math.radians(number(end, "direction [°]", -3600.0, 3600.0)) for end in degrees
        )
        level = math.cos(rise)
        session.point_selected((level * math.cos(turn), level * math.sin(turn), math.sin(rise)))

    about = "x forward, y left, z up, from the centre of gravity."
    place = gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=0.005, hint=about)
    page.bind_number(place, session.place_selected, of_part(lambda part: part.position))
    about = "Azimuth of the shaft, 0 is ahead, 90 to the left."
    shaft = gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=about)
    page.bind_number(
        shaft, turn, of_part(lambda part: math.degrees(_mounting(part) or 0.0)), digits=2
    )
    board.show(shaft, visible=of_part(lambda part: _mounting(part) is not None))
    about = (
        "Force of a thruster, of an azimuth at angle 0, or the shaft out of the hull; any length."
    )
    way = gui.add_vector3("Axis", (1.0, 0.0, 0.0), step=0.05, hint=about)
    page.bind_number(way, session.point_selected, of_part(lambda part: part.direction))
    board.show(way, label=of_part(lambda part: part.AXES[part.POINTED].capitalize()))
    about = "The same: azimuth, 90 is to the left, and how far it rises."
    page.bind_number(
        gui.add_vector2("Angles [°]", (0.0, 0.0), step=5.0, hint=about), aim, of_part(_angles), 2
    )
    snaps = {word: partial(session.point_selected, vector) for word, vector in SNAPS.items()}
    page.add_buttons("Snap to", snaps, hint="Ahead, astern, left, right, up, down.")
    about = "Across that: where a fin pushes at φ = 0, the leading edge, or what a pod turns about."
    other = gui.add_vector3("Zero", (0.0, 0.0, 0.0), step=0.05, hint=about)
    page.bind_number(
        other, session.turn_about, of_part(lambda part: part.frame[0 if part.POINTED else 1])
    )
    board.show(
        other,
        label=of_part(lambda part: part.OTHER),
        visible=of_part(lambda part: len(part.AXES) > 1 and _mounting(part) is None),
    )


def _mounting(part: Actuator) -> float | None:
    return getattr(part, "mounting_angle", None)


def _angles(part: Actuator) -> tuple[float, float]:
    """Azimuth and rise of a direction [deg]."""
    x, y, z = part.direction
    return math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))


def _has(part: Actuator, box: Box) -> bool:
    return box in (*part.BOXES, *part.LAW_BOXES) and box.law in ("", part.model_type)


def _value(part: Actuator, box: Box) -> Any:
    """What an actuator has in a box, in its unit; what is usual where nothing is said of it."""
    value = part.value(box.key) if _has(part, box) else None
    if value is None:
        return (0.0, 0.0) if box.pair else math.nan if box.free else box.usual
    return np.degrees(value).tolist() if box.degrees else value


def _add_boxes(page: Page, of_kinds: Sequence[Sequence[Box]]) -> None:
    """The boxes of all kinds, one that several have once."""
    for box in dict.fromkeys(box for boxes in of_kinds for box in boxes):
        _add_box(page, box)


def _add_box(page: Page, box: Box) -> None:
    """A box that may be empty is so where nothing is said, and 0 brings that back."""
    pair = box.pair

    def put(value: Any) -> None:
        checked = [number(end, box.label, -1e6, 1e6) for end in (value if pair else (value,))]
        meant = tuple(math.radians(v) if box.degrees else v for v in checked)
        page.session.set_value(
            box.key, meant if pair else None if box.free and not meant[0] else meant[0]
        )

    add: Any = page.gui.add_vector2 if pair else page.gui.add_number
    handle = add(
        box.label, (0.0, 0.0) if pair else box.usual, step=box.step, hint=box.hint, visible=False
    )
    digits = 2 if box.degrees else 4 if pair else 5
    page.bind_number(handle, put, of_part(lambda part: _value(part, box)), digits)
    page.board.show(handle, visible=of_part(lambda part: _has(part, box)))


def _headline(layout: Layout, selection: tuple[str, ...], selected: str | None) -> str:
    if not selection:
        said = "Press an actuator in the list or in the view to see all about it."
        return html("<div class='fl dim'>{}</div>", said)
    badges = Markup().join(swatch(layout.index(name)) for name in selection)
    if len(selection) == 1:
        head = "<div class='fl head'>{}<b>{}</b> <span class='dim'>{}</span></div>"
        return html(head, badges, selection[0], layout.part(selection[0]).type)
    return html(
        "<div class='fl head'>{}<b>{} actuators</b><div class='dim'>The boxes show {}; what "
        "you change counts for all that have it.</div></div>",
        badges,
        len(selection),
        str(selected),
    )
