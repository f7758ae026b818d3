"""What a layout says of the selected fins: place, limits, model, drive. An edit counts for all of them."""

import math
from functools import partial
from typing import Any

import viser
from markupsafe import Markup

from finlab.layout import Fin
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.layout.servo import Servo
from webapp.handles import add_html, put
from webapp.markup.answer import swatch
from webapp.markup.html import html
from webapp.markup.words import listed
from webapp.page import Page
from webapp.panels.fin_model import FinModelPanel
from webapp.session.state import number

DRIVE = {
    "amplitude_pole": ("Amplitude pole [rad/s]", "How the amplitude follows: half of the way after 1.7/p."),
    "frequency_pole": ("Frequency pole [rad/s]", "The same of the frequency."),
    "direction_pole": ("Direction pole [rad/s]", "The same of the zero direction."),
    "speed_limit": ("Fastest turn [rad/s]", "Cuts the amplitude of fast flapping."),
    "amplitude_rate": ("Amplitude rate [rad/s]", "How fast the asked amplitude changes at most."),
    "frequency_rate": ("Frequency rate [Hz/s]", "How fast the asked frequency changes at most."),
    "direction_rate": ("Direction rate [rad/s]", "How fast the asked zero direction changes at most."),
}
"""Fields of `Servo`: labels and hints."""
LIMITS = Markup("<div class='fl dim'>Least and most of A, f and the zero direction φ.</div>")
NOMINAL = Fin("nominal", (0.0, 0.0, 0.0), 0.0)
"""What stands in the boxes while no fin is selected."""


class FinInspector:
    """Widgets about the selected fins."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, session = page, page.session
        self._head = gui.add_html("")
        with gui.add_folder(None) as self._all:
            page.bind(gui.add_text("Name", ""), self._rename, lambda: session.selected or "")
            with gui.add_folder("Place"):
                about = "x forward, y left, z up, from the centre of gravity."
                page.bind_number(
                    gui.add_vector3("Position [m]", (0.0, 0.0, 0.0), step=0.005, hint=about),
                    self._place,
                    lambda: self._fin.position,
                )
                about = "Azimuth of the shaft, 0 is ahead, 90 to the left."
                page.bind_number(
                    gui.add_slider("Shaft [°]", -180.0, 180.0, 1.0, 0.0, hint=about),
                    self._turn,
                    lambda: math.degrees(self._fin.shaft_azimuth),
                    digits=2,
                )
            with gui.add_folder("Limits"):
                self._add_limits(gui)
            self._model = FinModelPanel(gui, page)
            with gui.add_folder("Drive", expand_by_default=False):
                for key, (label, hint) in DRIVE.items():
                    usual = f"{hint} Usual: {getattr(Servo(), key):.4g}."
                    page.bind_number(
                        gui.add_number(label, 1.0, step=0.5, hint=usual),
                        partial(session.set_servo, key),
                        partial(self._drive, key),
                    )

    def _add_limits(self, gui: viser.GuiApi) -> None:
        page, session = self._page, self._page.session
        add_html(gui, LIMITS)
        about = f"Least and most, up to {MAX_AMPLITUDE:.2f} rad."
        page.bind_number(
            gui.add_vector2("A [rad]", (0.0, 0.0), step=0.05, hint=about),
            partial(session.limit_selected, "amplitude"),
            lambda: self._fin.limits.amplitude,
        )
        about = f"Least and most, up to {MAX_FREQUENCY:g} Hz."
        page.bind_number(
            gui.add_vector2("f [Hz]", (0.0, 0.0), step=0.1, hint=about),
            partial(session.limit_selected, "frequency"),
            lambda: self._fin.limits.frequency,
        )
        about = "From and to, counter-clockwise; −180 to 180 is any direction."
        page.bind_number(
            gui.add_vector2("φ [°]", (0.0, 0.0), step=5.0, hint=about),
            self._limit_direction,
            lambda: tuple(math.degrees(end) for end in self._fin.limits.zero_direction),
            digits=2,
        )

    @property
    def _fin(self) -> Fin:
        """The fin that was selected last; a nominal one where none is."""
        session = self._page.session
        layout = session.state.layout
        return NOMINAL if session.selected is None else layout.fins[layout.index(session.selected)]

    def _rename(self, name: str) -> None:
        if self._page.session.selected is not None:
            self._page.session.rename_fin(self._page.session.selected, name)

    def _drive(self, key: str) -> float:
        return float(getattr(self._fin.servo, key))

    def _place(self, position: tuple[float, float, float]) -> None:
        self._page.session.place_selected(position)

    def _turn(self, degrees: Any) -> None:
        checked = number(degrees, "shaft [°]", -3600.0, 3600.0)
        self._page.session.turn_selected(math.radians(checked))

    def _limit_direction(self, degrees: tuple[Any, Any]) -> None:
        low, high = (math.radians(number(end, "zero direction [°]", -360.0, 360.0)) for end in degrees)
        self._page.session.limit_selected("zero_direction", (low, high))

    def refresh(self) -> None:
        session = self._page.session
        put(self._all, visible=session.selected is not None)
        put(self._head, content=self._headline())
        self._model.refresh()

    def _headline(self) -> str:
        session = self._page.session
        layout, names = session.state.layout, session.selection
        if not names:
            return Markup(
                "<div class='fl dim'>Press a fin in the list or in the view to see all about it.</div>"
            )
        if len(names) == 1:
            (name,) = names
            return html("<div class='fl head'>{}<b>{}</b></div>", swatch(layout.index(name)), name)
        badges = Markup().join(swatch(layout.index(name)) for name in names)
        differ = differences([layout.fins[layout.index(name)] for name in names])
        said = f"They differ in {differ}. " if differ else "They are alike but for their place. "
        return html(
            "<div class='fl head'>{}<b>{} fins</b><div class='dim'>{}The boxes show {}; what "
            "you change counts for all.</div></div>",
            badges,
            len(names),
            said,
            str(session.selected),
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
