"""What a layout says of the selected actuators: place, direction, limits, model. An edit counts for all."""

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from finlab.layout import Actuator, Azimuth, Fin, Layout
from finlab.layout.directions import Vector, axis_names, direction, part_of, pointed
from finlab.layout.fin import MAX_FREQUENCY
from finlab.layout.fin_model import FIN_MODELS
from webapp.markup.answer import swatch
from webapp.markup.words import html
from webapp.page import Page
from webapp.panels.actuator_model import add_fit, add_model, kind_of, of_part
from webapp.session.actuator_edits import FORMULAS, LAW_KEYS, words
from webapp.session.state import number

SNAPS: dict[str, Vector] = {
    "+x": (1.0, 0.0, 0.0),
    "−x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "−y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "−z": (0.0, 0.0, -1.0),
}
FIN, FIXED, PODS, RUDDER = ("fin",), ("thruster",), ("azimuth", "tilt"), ("rudder",)
POINTS = {"axis": "Axis", "shaft": "Shaft", "zero": "Zero"}
OTHERS = {"fin": "Zero", "rudder": "Leading edge"}


class Box(NamedTuple):
    """A box for a number, or for two: least and greatest."""

    label: str
    key: str
    """Field of the actuator, of its limits or of its law."""
    types: tuple[str, ...]
    hint: str
    step: float = 0.1
    degrees: bool = False
    """Whether the field is in radians."""
    free: bool = False
    """Whether it may be empty: nothing is said of it then; 0 empties it."""
    law: str = ""
    """Type of the model of a fin that it belongs to, if to one."""
    usual: float = 0.0
    """What is shown of an actuator without it."""


PAIRS = ("amplitude", "frequency", "zero_direction", "force", "arc", "deflection")
"""Fields that are a least and a greatest number."""
LIMITS = (
    Box("A [°]", "amplitude", FIN, "Half of the beat: least and most, up to 90.", 5.0, True),
    Box("f [Hz]", "frequency", FIN, f"Least and most, up to {MAX_FREQUENCY:g} Hz."),
    Box("φ [°]", "zero_direction", FIN, "From and to; −180 to 180 is any direction.", 5.0, True),
    Box("Force [N]", "force", FIXED, "Least and most along the axis; astern it is negative.", 1.0),
    Box("Force [N]", "force", PODS, "Least and most; above 0: it cannot stop.", 1.0),
    Box("Arc [°]", "arc", PODS, "Least and greatest angle from zero; −180 to 180 is any.", 5.0, True),
    Box("Deflection [°]", "deflection", RUDDER, "Least and greatest.", 1.0, True),
    Box("Dead band [N]", "dead_band", (*FIXED, *PODS), "Forces smaller than this, but 0, cannot be held."),
    Box("Turn rate [°/s]", "turn_rate", PODS, "How fast it turns; 0: at once.", 5.0, True, True),
    Box("Rate [N/s]", "rate", (*FIXED, *PODS), "How fast the force changes; 0: at once.", free=True),
    Box("Rate [°/s]", "rate", RUDDER, "How fast it turns; 0: at once.", 5.0, True, True),
    Box("Lag [s]", "time_constant", (*FIXED, *PODS, *RUDDER), "Time to 63 % of a new command.", 0.05),
    Box("Torque/force [m]", "torque_per_newton", (*FIXED, *PODS), "Reaction torque, signed.", 0.001),
)
LAW = (
    Box("Ahead [W]", "forward", (*FIXED, *PODS), "Power at 1 N; F newtons take it times F^exponent."),
    Box("Astern [W]", "reverse", (*FIXED, *PODS), "The same of a negative force; 0: as ahead.", free=True),
    Box("Exponent", "exponent", (*FIXED, *PODS), "1.5 is that of an ideal propeller at rest."),
    Box("Area [m²]", "area", RUDDER, "Of the foil.", 0.001),
    Box("Aspect ratio", "aspect_ratio", RUDDER, "2 span²/area for a foil on a hull."),
    Box("Lift slope [1/rad]", "lift_slope", RUDDER, "0: by the aspect ratio.", free=True),
    Box("Drag", "drag", RUDDER, "Drag coefficient without lift; 0.0065 is NACA 0015.", 0.001),
    Box("Stall [°]", "stall", RUDDER, "Angle to the flow at which it separates.", 1.0, True),
)


def _fin_box(law: str, key: str, rule: Any) -> Box:
    unit = f" [{rule.unit}]".replace("^2", "²").replace("^3", "³") if rule.unit else ""
    hint = f"{rule.meaning[0].upper()}{rule.meaning[1:]}. Usual: {rule.default:g}."
    step = (abs(rule.default) or 1.0) / 20
    return Box(f"{words(key)}{unit}", key, FIN, hint, step, law=law, usual=rule.default)


FIN_LAWS = tuple(_fin_box(law, key, rule) for law in FORMULAS for key, rule in FIN_MODELS[law].items())


def add_actuator(page: Page) -> None:
    """Widgets about the selected actuators."""
    session, gui = page.session, page.gui

    def rename(name: str) -> None:
        if session.selected is not None:
            session.rename(session.selected, name)

    page.add_html(_headline)
    with gui.add_folder(None) as full:
        page.bind(gui.add_text("Name", ""), rename, lambda selected: selected or "")
        with gui.add_folder("Place"):
            _add_place(page)
        with gui.add_folder("Limits"):
            for box in LIMITS:
                _add_box(page, box)
        with gui.add_folder("Model"):
            add_model(page)
            for box in (*FIN_LAWS, *LAW):
                _add_box(page, box)
            add_fit(page)
    page.board.show(full, visible=lambda selected: selected is not None)


def _add_place(page: Page) -> None:
    session, gui, board = page.session, page.gui, page.board

    def turn(degrees: Any) -> None:
        session.turn_selected(math.radians(number(degrees, "shaft [°]", -3600.0, 3600.0)))

    def aim(degrees: tuple[Any, Any]) -> None:
        turn, rise = (math.radians(number(end, "direction [°]", -3600.0, 3600.0)) for end in degrees)
        level = math.cos(rise)
        session.point_selected((level * math.cos(turn), level * math.sin(turn), math.sin(rise)))

    about = "x forward, y left, z up, from the centre of gravity."
    place = gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=0.005, hint=about)
    page.bind_number(place, session.place_selected, of_part(lambda part: part.position))
    about = "Azimuth of the shaft, 0 is ahead, 90 to the left."
    shaft = gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=about)
    page.bind_number(shaft, turn, of_part(lambda part: math.degrees(_mounting(part) or 0.0)), digits=2)
    board.show(shaft, visible=of_part(lambda part: _mounting(part) is not None))
    about = "Force of a thruster, of an azimuth at angle 0, or the shaft out of the hull; any length."
    way = gui.add_vector3("Axis", (1.0, 0.0, 0.0), step=0.05, hint=about)
    page.bind_number(way, session.point_selected, of_part(direction))
    board.show(way, label=of_part(lambda part: POINTS[pointed(part)]))
    about = "The same: azimuth, 90 is to the left, and how far it rises."
    page.bind_number(
        gui.add_vector2("Angles [°]", (0.0, 0.0), step=5.0, hint=about), aim, of_part(_angles), 2
    )
    snaps = {word: partial(session.point_selected, vector) for word, vector in SNAPS.items()}
    page.add_buttons("Snap to", snaps, hint="Ahead, astern, left, right, up, down.")
    about = "Across that: where a fin pushes at φ = 0, the leading edge, or what a pod turns about."
    other = gui.add_vector3("Zero", (0.0, 0.0, 0.0), step=0.05, hint=about)
    page.bind_number(other, session.turn_about, of_part(_other))
    board.show(
        other,
        label=of_part(lambda part: OTHERS.get(part.type, "Turns about")),
        visible=of_part(lambda part: len(axis_names(part)) > 1 and _mounting(part) is None),
    )


def _mounting(part: Actuator) -> float | None:
    return part.mounting_angle if isinstance(part, Fin) else None


def _angles(part: Actuator) -> tuple[float, float]:
    """Azimuth and rise of a direction [deg]."""
    x, y, z = direction(part)
    return math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))


def _other(part: Actuator) -> Vector:
    """The own axis that is not the direction."""
    return part.frame[0 if isinstance(part, Azimuth) else 1]


def _has(part: Actuator, box: Box) -> bool:
    law = "power_law" if box.key in LAW_KEYS else box.law
    return part.type in box.types and law in ("", kind_of(part))


def _value(part: Actuator, box: Box) -> Any:
    """What an actuator has in a box, in its unit; what is usual where nothing is said of it."""
    value = None
    if _has(part, box):
        known = part.model.values() if isinstance(part, Fin) and box.law else {}
        holders = (getattr(part, "limits", part), getattr(part, "model", None))
        value = known.get(box.key, next((getattr(h, box.key) for h in holders if hasattr(h, box.key)), None))
    if value is None:
        return (0.0, 0.0) if box.key in PAIRS else math.nan if box.free else box.usual
    return np.degrees(value).tolist() if box.degrees else value


def _add_box(page: Page, box: Box) -> None:
    """A box that may be empty is so where nothing is said, and 0 brings that back."""
    pair = box.key in PAIRS

    def put(value: Any) -> None:
        checked = [number(end, box.label, -1e6, 1e6) for end in (value if pair else (value,))]
        meant = tuple(math.radians(v) if box.degrees else v for v in checked)
        page.session.set_value(box.key, meant if pair else None if box.free and not meant[0] else meant[0])

    add: Any = page.gui.add_vector2 if pair else page.gui.add_number
    handle = add(box.label, (0.0, 0.0) if pair else box.usual, step=box.step, hint=box.hint, visible=False)
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
        return html(head, badges, selection[0], part_of(layout, selection[0]).type)
    return html(
        "<div class='fl head'>{}<b>{} actuators</b><div class='dim'>The boxes show {}; what "
        "you change counts for all that have it.</div></div>",
        badges,
        len(selection),
        str(selected),
    )
