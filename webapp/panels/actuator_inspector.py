"""Widgets about the selected actuators: name, position, directions, limits and model. An edit
counts for all of them. `webapp.panels.inspectors` says which boxes a kind has."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup

from finlab.actuators.actuator import Actuator
from finlab.axes import Vector3
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.markup.answer import swatch
from webapp.markup.words import html
from webapp.page import Page
from webapp.panels.actuator_model import add_fit, add_model, of_selected
from webapp.panels.inspectors import Box, NumberBox, RangeBox, all_inspectors, inspector_of
from webapp.scene.stage import arrow_size
from webapp.session.state import number

LARGEST = 1e9
"""Largest size of a number that a box takes, in its unit; its field has narrower bounds."""
PLACE_STEP_M = 0.005
"""Step of a coordinate, on a robot of the size of a U-CAT [m]."""
SNAPS: dict[str, Vector3] = {
    "+x": (1.0, 0.0, 0.0),
    "−x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "−y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "−z": (0.0, 0.0, -1.0),
}
"""Label of a button -> the direction to which it points the actuator, body frame."""


def add_actuator(page: Page) -> None:
    """Widgets about the selected actuators."""
    session = page.session
    gui = page.gui

    def rename(name: str) -> None:
        if session.selected is not None:
            session.rename(session.selected, name)

    inspectors = all_inspectors()
    page.add_html(_headline)
    with gui.add_folder(None) as full:
        page.bind(gui.add_text("Name", ""), rename, lambda selected: selected or "")
        with gui.add_folder("Place"):
            _add_place(page)
        with gui.add_folder("Limits"):
            _add_boxes(page, [inspector.limits for inspector in inspectors])
        with gui.add_folder("Model"):
            add_model(page)
            _add_boxes(page, [inspector.law for inspector in inspectors])
            add_fit(page)
    page.board.show(full, visible=lambda selected: selected is not None)


def _add_place(page: Page) -> None:
    session = page.session
    gui = page.gui
    board = page.board

    def turn(degrees: Any) -> None:
        session.turn_selected(math.radians(number(degrees, "shaft [°]", -3600.0, 3600.0)))

    def aim(degrees: tuple[Any, Any]) -> None:
        azimuth, elevation = (
            math.radians(number(angle, "direction [°]", -3600.0, 3600.0)) for angle in degrees
        )
        level = math.cos(elevation)
        x = level * math.cos(azimuth)
        y = level * math.sin(azimuth)
        session.point_selected((x, y, math.sin(elevation)))

    hint = "x forward, y left, z up, from the centre of gravity."
    position = gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=PLACE_STEP_M, hint=hint)
    board.show(position, step=lambda layout: PLACE_STEP_M * arrow_size(layout))
    page.bind_number(
        position, session.place_selected, of_selected(lambda actuator: actuator.position)
    )
    hint = "Azimuth of the shaft, 0 is ahead, 90 to the left."
    shaft = gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=hint)
    page.bind_number(
        shaft,
        turn,
        of_selected(lambda actuator: math.degrees(_mounting(actuator) or 0.0)),
        digits=2,
    )
    board.show(shaft, visible=of_selected(lambda actuator: _mounting(actuator) is not None))
    hint = (
        "Force of a thruster, of an azimuth at angle 0, or the shaft out of the hull; any length."
    )
    direction = gui.add_vector3("Axis", (1.0, 0.0, 0.0), step=0.05, hint=hint)
    page.bind_number(
        direction, session.point_selected, of_selected(lambda actuator: actuator.direction)
    )
    board.show(direction, label=of_selected(lambda actuator: actuator.KIND.pointed.capitalize()))
    hint = "The same: azimuth, 90 is to the left, and how far it rises."
    page.bind_number(
        gui.add_vector2("Angles [°]", (0.0, 0.0), step=5.0, hint=hint),
        aim,
        of_selected(_angles),
        digits=2,
    )
    snaps = {word: partial(session.point_selected, vector) for word, vector in SNAPS.items()}
    page.add_buttons("Snap to", snaps, hint="Ahead, astern, left, right, up, down.")
    hint = "Across that: where a fin pushes at φ = 0, the leading edge, or what a pod turns about."
    second_axis = gui.add_vector3("Zero", (0.0, 0.0, 0.0), step=0.05, hint=hint)
    page.bind_number(
        second_axis,
        session.turn_about,
        of_selected(lambda actuator: actuator.frame[0 if actuator.KIND.pointed_row else 1]),
    )
    board.show(
        second_axis,
        label=of_selected(lambda actuator: inspector_of(type(actuator)).other_axis),
        visible=of_selected(_has_second_axis),
    )


def _has_second_axis(actuator: Actuator) -> bool:
    """Whether its second axis is free: a mounting angle fixes that of a fin."""
    return len(actuator.KIND.axes) > 1 and _mounting(actuator) is None


def _mounting(actuator: Actuator) -> float | None:
    return getattr(actuator, "mounting_angle", None)


def _angles(actuator: Actuator) -> tuple[float, float]:
    """Azimuth and rise of a direction [deg]."""
    x, y, z = actuator.direction
    return math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))


def _has(actuator: Actuator, box: Box) -> bool:
    """Whether the inspector of an actuator, with the model that it has, shows a box."""
    inspector = inspector_of(type(actuator))
    if box not in inspector.limits and box not in inspector.law:
        return False
    if box.key == actuator.KIND.arc and getattr(actuator, "barred", False):
        return False  # two numbers do not hold several arcs: the head tells them
    return isinstance(box, RangeBox) or box.model in ("", actuator.model_type)


def _value(actuator: Actuator, box: Box) -> Any:
    """Value of an actuator that a box shows, in its unit; the box's default where it has none."""
    value = actuator.value(box.key) if _has(actuator, box) else None
    if value is not None:
        return np.degrees(value).tolist() if box.degrees else value
    if isinstance(box, RangeBox):
        return 0.0, 0.0
    return math.nan if box.may_be_empty else box.default


def _add_boxes(page: Page, boxes_by_kind: Sequence[Sequence[Box]]) -> None:
    """The boxes of all kinds; one that several kinds have stands once."""
    boxes: dict[Box, None] = {}
    for of_kind in boxes_by_kind:
        boxes |= dict.fromkeys(of_kind)
    for box in boxes:
        if isinstance(box, RangeBox):
            _add_range_box(page, box)
        else:
            _add_number_box(page, box)


def _add_range_box(page: Page, box: RangeBox) -> None:
    def set_range(typed: tuple[Any, Any]) -> None:
        page.session.set_value(box.key, tuple(_in_field(box, end) for end in typed))

    handle = page.gui.add_vector2(
        box.label, (0.0, 0.0), step=box.step, hint=box.hint, visible=False
    )
    digits = 2 if box.degrees else 4
    page.bind_number(handle, set_range, of_selected(lambda actuator: _value(actuator, box)), digits)
    page.board.show(handle, visible=of_selected(lambda actuator: _has(actuator, box)))


def _add_number_box(page: Page, box: NumberBox) -> None:
    """A box that may be empty is so where the field is None."""

    def set_number(typed: Any) -> None:
        if typed == 0.0 and box.may_be_empty:
            raise FinlabError(f"{box.label}: expected more than 0, or an empty box; {box.hint}")
        page.session.set_value(box.key, None if typed is None else _in_field(box, typed))

    handle = page.gui.add_number(
        box.label, box.default, step=box.step, hint=box.hint, visible=False
    )
    digits = 2 if box.degrees else 5
    page.bind_number(
        handle,
        set_number,
        of_selected(lambda actuator: _value(actuator, box)),
        digits,
        may_be_empty=box.may_be_empty,
    )
    page.board.show(handle, visible=of_selected(lambda actuator: _has(actuator, box)))


def _in_field(box: Box, typed: Any) -> float:
    """A number of a box in the unit of its field. Raises FinlabError: it is none."""
    value = number(typed, box.label, -LARGEST, LARGEST)
    return math.radians(value) if box.degrees else value


def _headline(layout: Layout, selection: tuple[str, ...], selected: str | None) -> str:
    if not selection:
        sentence = "Press an actuator in the list or in the view to see all about it."
        return html("<div class='fl dim'>{}</div>", sentence)
    badges = Markup().join(swatch(layout.index(name)) for name in selection)
    if len(selection) == 1:
        actuator = layout.actuator(selection[0])
        words = actuator.type
        if getattr(actuator, "barred", ()):  # several arcs have no box
            words = f"{actuator.type}, {actuator.angle_words(0.0, 0.0)}"
        head = "<div class='fl head'>{}<b>{}</b> <span class='dim'>{}</span></div>"
        return html(head, badges, selection[0], words)
    return html(
        "<div class='fl head'>{}<b>{} actuators</b><div class='dim'>The boxes show {}; what "
        "you change counts for all that have it.</div></div>",
        badges,
        len(selection),
        str(selected),
    )
