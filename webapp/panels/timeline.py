"""What happens while robots swim: a slider of time, and plots."""

import time

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import Changes, add_html, hold_kind, option_index, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.panels.line_plot import FIN_LINES, LinePlot, top_of, with_cursor
from webapp.session.state import AXIS_UNITS, AXIS_WORDS
from webapp.tasks.moment import ASKED as ASKED_COLUMN
from webapp.tasks.moment import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.moment import DEPTH_ERROR, ERROR, FORCES, POWER, TIME
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DELIVERED, OTHER, css

EVERY_S = 0.2
"""Least time between two drawings [s]."""
SMALL = 0.01
"""What the vertical axes show at least."""
PLOT_PX = 92
"""Height of a plot [px]."""
STEPS = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0)
"""Where the axes of time may end [s]."""
CERTAIN = 114.0
"""End of the axis of probabilities [%]: some room above what is certain."""
UNSWUM = (
    "Once a swim is started, its distance from the path, power, wrench, fin forces and what is found broken "
    "are plotted here over time."
)
"""What is said before."""
CURSOR = "rgba(120,130,140,.9)"
"""Colour of the moment that is looked at."""
SMOOTH = 1.0
"""Time over which plotted power is averaged [s]."""


class Timeline:
    """The slider and the plots."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, swimming = page, page.swimming
        add_html(gui, marker("fl-timeline"))
        self._none = add_html(gui, html("<div class='fl dim fl-unswum'>{}</div>", UNSWUM))
        hint = "Hold the swim, and look at any moment of it again."
        self._slider = page.bind_number(
            gui.add_slider("At [s]", 0.0, 90.0, 0.1, 0.0, hint=hint),
            swimming.look_at,
            lambda: swimming.seen_time if swimming.swimmers else 0.0,
            digits=1,
        )
        wrench = "Asked in blue, delivered in green, of the first robot."
        self._axis = gui.add_dropdown("Plot wrench", AXIS_WORDS, hint=wrench)
        hold_kind(self._axis)
        self._plots = SwimPlots(gui)

    def refresh(self) -> None:
        swimming = self._page.swimming
        there = bool(swimming.swimmers)
        put(self._none, visible=not there)
        put(self._slider, visible=there)
        put(self._axis, visible=there)
        self._plots.show(there)
        if there:
            put(self._slider, max=round(swimming.swimmers[0].duration_s, 1))
            self._plots.refresh(swimming, option_index(self._axis))


class SwimPlots:
    """Six plots over time."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._drawn = 0.0
        self._changes = Changes()
        robots, wrench = (css(DELIVERED), css(OTHER)), (css(ASKED), css(DELIVERED))

        def plot(colors: tuple[str, ...], title: str, below: str = "") -> LinePlot:
            height = PLOT_PX + (24 if below else 0)
            return LinePlot(gui, (CURSOR, *colors), title, below, height=height, widths=(1.0, 1.5))

        self._error = plot(robots, "off [cm]")
        self._depth = plot(robots, "z off [cm]")
        self._power = plot(robots, "power [W]")
        self._wrench = plot(wrench, "surge [N]", "time [s]")
        self._force = plot(FIN_LINES, "fins [N]", "time [s]")
        self._broken = plot(FIN_LINES, "broken %", "time [s]")

    def show(self, visible: bool) -> None:
        """Show all plots, or none."""
        for plot in (self._error, self._depth, self._power, self._wrench, self._force, self._broken):
            plot.show(visible)

    def refresh(self, swimming: Swimming, axis: int) -> None:
        """Draw errors, power, one axis of the wrench, forces and the monitor's doubts, but no more often than
        an eye can follow."""
        swimmers, at = swimming.swimmers, swimming.at
        moments = tuple(swimmer.shown for swimmer in swimmers)
        soon = time.monotonic() - self._drawn < EVERY_S and swimming.running
        if soon or not len(moments[0].record) or not self._changes(axis, at, *moments):
            return
        self._drawn = time.monotonic()
        record = moments[0].record
        records = [moment.record for moment in moments if len(moment.record)]
        seconds = np.ascontiguousarray(record[:, TIME])
        end = shown_until(float(seconds[-1]), swimmers[0].duration_s)
        for plot, column, scale in (
            (self._error, ERROR, 100.0),
            (self._depth, DEPTH_ERROR, 100.0),
            (self._power, POWER, 1.0),
        ):
            lines = [_line(rows, column, seconds, scale) for rows in records]
            self._draw(plot, seconds, lines, (0.0, top_of(lines, SMALL)), at, end)
        both = [record[:, column + axis] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        self._wrench.name(f"{AXIS_WORDS[axis]} [{AXIS_UNITS[axis]}]", "time [s]")
        ends = (-top_of([-both[0], -both[1]], SMALL), top_of(both, SMALL))
        self._draw(self._wrench, seconds, both, ends, at, end)
        n_fins = len(swimmers[0].fins)
        forces = list(record[:, FORCES : FORCES + n_fins].T)
        self._draw(self._force, seconds, forces, (0.0, top_of(forces, SMALL)), at, end)
        doubts = list(100.0 * record[:, FORCES + n_fins :].T)
        self._draw(self._broken, seconds, doubts, (0.0, CERTAIN), at, end)

    def _draw(
        self,
        plot: LinePlot,
        seconds: Array,
        lines: list[Array],
        ends: tuple[float, float],
        at: float | None,
        end: float,
    ) -> None:
        if at is None:
            plot.draw(seconds, [np.full(len(seconds), np.nan), *lines], ends, end)
        else:
            plot.draw(*with_cursor(seconds, lines, at, ends), ends, end)


def shown_until(time: float, duration: float) -> float:
    """Where the axes of time end [s]: a little beyond what has been swum, in steps that seldom jump."""
    step = next((step for step in STEPS if 1.05 * time <= step), duration)
    return min(step, duration) if time <= duration else time


def _line(rows: Array, column: int, seconds: Array, scale: float) -> Array:
    """A column of a record at some times; NaN after its end."""
    values = rows[:, column]
    if column == POWER and len(rows) > 1:
        ones = np.ones(max(1, min(len(rows), round(SMOOTH / float(rows[1, TIME] - rows[0, TIME])))))
        values = np.convolve(values, ones, "same") / np.convolve(np.ones(len(rows)), ones, "same")
    return scale * np.interp(seconds, rows[:, TIME], values, right=np.nan)
