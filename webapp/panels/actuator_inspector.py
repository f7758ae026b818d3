"""What a layout says of the selected fins: place, limits, model, drive. An edit counts for all of them."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from markupsafe import Markup

from finlab.layout import Fin, Layout
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY
from webapp.handles import add_html
from webapp.markup.answer import swatch
from webapp.markup.html import html
from webapp.markup.words import listed
from webapp.page import Page
from webapp.panels.fin_model import add_fin_model
from webapp.session.state import number

LIMITS = Markup("<div class='fl dim'>Least and most of A, f and the zero direction φ.</div>")
NOMINAL = Fin("nominal", (0.0, 0.0, 0.0), 0.0)


def fin_of(selected: str | None, layout: Layout) -> Fin:
    """The fin that was selected last; a nominal one where none is."""
    return NOMINAL if selected is None else layout.fins[layout.index(selected)]


def of_fin(value: Callable[[Fin], Any]) -> Callable[[str | None, Layout], Any]:
    """What is shown of the fin that was selected last."""
    return lambda selected, layout: value(fin_of(selected, layout))


def add_fin(page: Page) -> None:
    """Widgets about the selected fins."""
    session, gui = page.session, page.gui

    def rename(name: str) -> None:
        if session.selected is not None:
            session.rename(session.selected, name)

    def turn(degrees: Any) -> None:
        session.turn_selected(math.radians(number(degrees, "shaft [°]", -3600.0, 3600.0)))

    page.add_html(_headline)
    with gui.add_folder(None) as whole:
        page.bind(gui.add_text("Name", ""), rename, lambda selected: selected or "")
        with gui.add_folder("Place"):
            about = "x forward, y left, z up, from the centre of gravity."
            place = gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=0.005, hint=about)
            page.bind_number(place, session.place_selected, of_fin(lambda fin: fin.position))
            about = "Azimuth of the shaft, 0 is ahead, 90 to the left."
            shaft = gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=about)
            page.bind_number(shaft, turn, of_fin(lambda fin: math.degrees(fin.shaft_azimuth)), digits=2)
        with gui.add_folder("Limits"):
            _add_limits(page)
        add_fin_model(page, fin_of)
    page.board.show(whole, visible=lambda selected: selected is not None)


def _add_limits(page: Page) -> None:
    gui, limit = page.gui, page.session.set_value

    def limit_direction(degrees: tuple[Any, Any]) -> None:
        low, high = (math.radians(number(end, "zero direction [°]", -360.0, 360.0)) for end in degrees)
        limit("zero_direction", (low, high))

    add_html(gui, LIMITS)
    about = f"Least and most, up to {MAX_AMPLITUDE:.2f} rad."
    box = gui.add_vector2("A [rad]", (0.0, 0.0), step=0.05, hint=about)
    page.bind_number(box, partial(limit, "amplitude"), of_fin(lambda fin: fin.limits.amplitude))
    about = f"Least and most, up to {MAX_FREQUENCY:g} Hz."
    box = gui.add_vector2("f [Hz]", (0.0, 0.0), step=0.1, hint=about)
    page.bind_number(box, partial(limit, "frequency"), of_fin(lambda fin: fin.limits.frequency))
    about = "From and to, counter-clockwise; −180 to 180 is any direction."
    box = gui.add_vector2("φ [°]", (0.0, 0.0), step=5.0, hint=about)
    ends = of_fin(lambda fin: tuple(math.degrees(end) for end in fin.limits.zero_direction))
    page.bind_number(box, limit_direction, ends, digits=2)


def _headline(layout: Layout, selection: tuple[str, ...], selected: str | None) -> str:
    if not selection:
        return Markup("<div class='fl dim'>Press a fin in the list or in the view to see all about it.</div>")
    if len(selection) == 1:
        (name,) = selection
        return html("<div class='fl head'>{}<b>{}</b></div>", swatch(layout.index(name)), name)
    badges = Markup().join(swatch(layout.index(name)) for name in selection)
    differ = differences([layout.fins[layout.index(name)] for name in selection])
    said = f"They differ in {differ}. " if differ else "They are alike but for their place. "
    return html(
        "<div class='fl head'>{}<b>{} fins</b><div class='dim'>{}The boxes show {}; what "
        "you change counts for all.</div></div>",
        badges,
        len(selection),
        said,
        str(selected),
    )


def differences(fins: list[Fin]) -> str:
    """What of some fins is not the same, in words; nothing is said of their places."""
    parts: dict[str, set[object]] = {
        "shaft": {round(fin.shaft_azimuth, 6) for fin in fins},
        "limits": {fin.limits for fin in fins},
        "model": {fin.model for fin in fins},
        "drive": {fin.servo for fin in fins},
    }
    differ = [word for word, values in parts.items() if len(values) > 1]
    return listed(differ) if differ else ""
