"""Play one axis of the target through a range, and see what each fin does along the way."""

import time

import numpy as np
import viser
from markupsafe import Markup

from finlab.allocation.evaluate import REACHED
from webapp.handles import option_index, put
from webapp.markup.html import html
from webapp.markup.words import error_digits, three_digits
from webapp.page import Page
from webapp.panels.line_plot import FIN_LINES, LinePlot, top_of
from webapp.session.state import AXIS_UNITS, AXIS_WORDS, MAX_TARGET, number
from webapp.tasks.sweeping import Sweep

EVERY_S = 0.25
"""How often the plot is drawn while the sweep runs [s]."""


class SweepPanel:
    """Which axis, how far, and the plot."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._drawn = 0.0
        self._ends = (-5.0, 5.0)
        self._axis = gui.add_dropdown(
            "Sweep", AXIS_WORDS, hint="Which component of the target goes through the range."
        )
        page.on_change(self._axis, lambda _: self._fit_range())
        page.bind_number(
            gui.add_vector2("From, to", self._ends, step=0.05, hint="Ends of the range [N or N m]."),
            self._set_ends,
            lambda: self._ends,
        )
        self._play = page.add_button("Play the sweep", self._toggle, hint="Back and forth until you stop it.")
        self._plot = LinePlot(gui, FIN_LINES, "fin forces [N]", height=170, widths=(2.0,))
        self._said = gui.add_html("")

    def _toggle(self) -> None:
        sweep = self._page.sweep
        if sweep.running:
            sweep.stop()
        else:
            sweep.start(option_index(self._axis), *self._ends)

    def _set_ends(self, ends: tuple[float, float]) -> None:
        low, high = (number(v, "end of the range", -MAX_TARGET, MAX_TARGET) for v in ends)
        self._ends = low, high

    def _fit_range(self) -> None:
        """Half of what is within reach, both ways: the ends are where it becomes interesting."""
        ranges = self._page.ranging.findings
        axis = option_index(self._axis)
        if ranges is not None and np.isfinite(ranges.high[axis]):
            low, high = float(ranges.low[axis]), float(ranges.high[axis])
            self._ends = round(0.5 * low, 2), round(0.5 * high, 2)

    def refresh(self) -> None:
        """Write the state of the sweep; the plot at most a few times a second."""
        sweep = self._page.sweep
        put(
            self._play,
            label="Stop the sweep" if sweep.running else "Play the sweep",
            icon=viser.Icon.PLAYER_STOP if sweep.running else viser.Icon.PLAYER_PLAY,
        )
        if not sweep.fins or time.monotonic() - self._drawn < EVERY_S:
            return
        self._drawn = time.monotonic()
        self._plot.show(True)
        self._plot.name("fin forces [N]", f"{AXIS_WORDS[sweep.axis]} asked [{AXIS_UNITS[sweep.axis]}]")
        self._plot.draw(sweep.values, list(sweep.force), (0.0, top_of(sweep.force, 0.0)))
        put(self._said, content=html("<div class='fl'>{}</div>", _sentence(sweep)))


def _sentence(sweep: Sweep) -> str:
    """Where along the way the wrench is exact."""
    known = np.isfinite(sweep.error)
    if not known.any():
        return ""
    exact = known & (sweep.error <= REACHED)
    if not exact.any():
        return Markup("<span class='missing'>Nowhere along the way is the wrench delivered exactly.</span>")
    if exact[known].all():
        low, high = (three_digits(float(value)) for value in (np.nanmin(sweep.power), np.nanmax(sweep.power)))
        error = error_digits(float(np.nanmax(sweep.error)))
        return f"Exact all the way: the largest error is {error}; power from {low} to {high} W."
    low, high = (f"{value:.3g}".replace("-", "−") for value in sweep.values[exact][[0, -1]])
    beyond = Markup("<span class='missing'>beyond, something is missing.</span>")
    return f"Exact from {low} to {high} {AXIS_UNITS[sweep.axis]}; {beyond}"
