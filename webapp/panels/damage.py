"""Which fins have failed, and what is wrong with the others: a button for each fin, and sliders."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import viser

from webapp.handles import numbered, on_user_change, put
from webapp.markup.picking import button_colors
from webapp.page import Page
from webapp.session.state import STRENGTH_RANGE
from webapp.theme import DEAD, css, fin_color, ink


class FinButtons:
    """A row of numbers."""

    def __init__(self, page: Page, label: str, hint: str, marker: str, act: Callable[[str], object]) -> None:
        """Build the row; `marker` is its name on the page, `act` an intent about the fin of a name."""
        self._page, self._marker, self._act = page, marker, act
        gui = page.client.gui
        self._names: Sequence[str] = ()
        self._paint = gui.add_html("")
        self._buttons = gui.add_button_group(label, ("1",), hint=hint)
        on_user_change(self._buttons, self._pressed)

    def _pressed(self, button: str) -> None:
        index = numbered(button, len(self._names))
        if index is not None:
            self._page.do(partial(self._act, self._names[index]))

    def refresh(self, names: Sequence[str], failed: Sequence[str] = (), held: Sequence[str] = ()) -> None:
        self._names = names
        put(
            self._buttons,
            options=tuple(f"{i + 1} ✕" if n in failed else f"{i + 1}" for i, n in enumerate(names)),
        )
        colors = [
            (css(DEAD), "#fff")
            if n in failed
            else ("transparent", "inherit")
            if n in held
            else (css(fin_color(i)), ink(fin_color(i)))
            for i, n in enumerate(names)
        ]
        put(self._paint, content=button_colors(self._marker, colors))


class DamagePanel:
    """What is wrong with the selected fin."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        left = "What is left of its largest amplitude and frequency: a worn motor, a torn fin."
        flaps = "It no longer turns: it flaps about one direction only."
        stays = "Zero direction at which it stays."
        self._fin = gui.add_dropdown("Which fin", ("1",), hint="Also the one that is selected in the view.")
        page.on_change(self._fin, page.session.select)
        page.bind_number(
            gui.add_slider("Strength [%]", 100 * STRENGTH_RANGE[0], 100.0, 5.0, 100.0, hint=left),
            lambda share: page.session.weaken(self._name, share / 100.0),
            lambda: 100.0 * dict(page.session.state.weak).get(self._name, 1.0),
            digits=1,
        )
        page.bind(
            gui.add_checkbox("Stuck", False, hint=flaps),
            lambda stuck: self._jam(stuck, 0.0),
            lambda: self._stop is not None,
        )
        self._angle = page.bind_number(
            gui.add_slider("Stuck at [°]", -180.0, 180.0, 5.0, 0.0, hint=stays, visible=False),
            partial(self._jam, True),
            lambda: math.degrees(self._stop or 0.0),
            digits=1,
        )
        mends = {"This fin": lambda: page.session.mend(self._name), "All fins": page.session.mend_all}
        page.add_buttons("Repair", mends, hint="Repairs the fin; can be undone.")

    @property
    def _name(self) -> str:
        """The fin that the widgets are about: the selected one, or the first."""
        session = self._page.session
        return session.selected or session.state.layout.names[0]

    @property
    def _stop(self) -> float | None:
        """The zero direction [rad] at which that fin is stuck."""
        return dict(self._page.session.state.stuck).get(self._name)

    def _jam(self, stuck: bool, degrees: float) -> None:
        self._page.session.jam(self._name, math.radians(degrees) if stuck else None)

    def refresh(self) -> None:
        put(self._fin, options=self._page.session.state.layout.names, value=self._name)
        put(self._angle, visible=self._stop is not None)
