"""What happens while robots swim: plots over time."""

import time
from collections.abc import Iterable, Sequence

import numpy as np
import viser
from viser import uplot

from finlab.arrays import Array
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html, put
from webapp.markup.html import html, marker
from webapp.page import Page
from webapp.session.targets import nice_limit
from webapp.tasks.moment import ASKED as ASKED_COLUMN
from webapp.tasks.moment import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.moment import DEPTH_ERROR, ERROR, FORCES, POWER, TIME, Moment
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DELIVERED, css, fin_color

FONT = "13px sans-serif"
FIN_LINES = tuple(css(fin_color(i)) for i in range(MAX_ACTUATORS))
ROOM = 1.14
"""Room above the last tick, so that its number is not cut off."""
EVERY_S = 0.2
"""Least time between two drawings [s]."""
SMALL = 0.01
PLOT_PX = 92
"""Height of a plot [px]."""
STEPS = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0)
"""Where the axes of time may end [s]."""
CERTAIN = 114.0
"""End of the axis of probabilities [%]: some room above what is certain."""
UNSWUM = (
    "Once a swim is started, its distance from the path, power, wrench, forces and what is found broken "
    "are plotted here over time."
)
SMOOTH = 1.0
"""Time over which plotted power is averaged [s]."""


def add_timeline(page: Page) -> None:
    """What is said before a swim, and six plots over time."""
    gui = page.gui
    add_html(gui, marker("fl-timeline"))
    none = add_html(gui, html("<div class='fl dim fl-unswum'>{}</div>", UNSWUM))
    page.board.show(none, visible=lambda swimmer: swimmer is None)
    robot, wrench = (css(DELIVERED),), (css(ASKED), css(DELIVERED))

    def plot(colors: tuple[str, ...], title: str, below: str = "") -> LinePlot:
        return LinePlot(gui, colors, title, below, height=PLOT_PX + (24 if below else 0))

    off, deep, power = plot(robot, "off [cm]"), plot(robot, "z off [cm]"), plot(robot, "power [W]")
    surge = plot(wrench, "surge [N]", "time [s]")
    forces = plot(FIN_LINES, "forces [N]", "time [s]")
    broken = plot(FIN_LINES, "broken %", "time [s]")
    drawn = 0.0

    def show(swimmer: Swimmer | None) -> None:
        for one in (off, deep, power, surge, forces, broken):
            one.show(swimmer is not None)

    def draw(swimmer: Swimmer | None, moment: Moment | None, paused: bool) -> None:
        """Errors, power, surge asked and delivered, forces and the monitor's doubts, no more often than an
        eye can follow."""
        nonlocal drawn
        if swimmer is None or moment is None or not len(moment.record):
            return
        now, record = time.monotonic(), moment.record
        if now - drawn < EVERY_S and not (paused or moment.done):
            return
        drawn = now
        seconds = np.ascontiguousarray(record[:, TIME])
        end = shown_until(float(seconds[-1]), swimmer.duration_s)
        for one, column, scale in ((off, ERROR, 100.0), (deep, DEPTH_ERROR, 100.0), (power, POWER, 1.0)):
            lines = [_line(record, column, scale)]
            one.draw(seconds, lines, (0.0, top_of(lines, SMALL)), end)
        both = [record[:, column] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        ends = (-top_of([-both[0], -both[1]], SMALL), top_of(both, SMALL))
        surge.draw(seconds, both, ends, end)
        n = len(swimmer.fins)
        sizes = list(record[:, FORCES : FORCES + n].T)
        forces.draw(seconds, sizes, (0.0, top_of(sizes, SMALL)), end)
        broken.draw(seconds, list(100.0 * record[:, FORCES + n :].T), (0.0, CERTAIN), end)

    page.board.act(show)
    page.board.act(draw)


def shown_until(time: float, duration: float) -> float:
    """Where the axes of time end [s]: a little beyond what has been swum, in steps that seldom jump."""
    step = next((step for step in STEPS if 1.05 * time <= step), duration)
    return min(step, duration) if time <= duration else time


def _line(rows: Array, column: int, scale: float) -> Array:
    """A column of a record; power is averaged."""
    values = rows[:, column]
    if column == POWER and len(rows) > 1:
        ones = np.ones(max(1, min(len(rows), round(SMOOTH / float(rows[1, TIME] - rows[0, TIME])))))
        values = np.convolve(values, ones, "same") / np.convolve(np.ones(len(rows)), ones, "same")
    return np.asarray(scale * values)


class LinePlot:
    """A fixed number of lines; those that are not needed hold no numbers."""

    def __init__(
        self, gui: viser.GuiApi, colors: Sequence[str], title: str, below: str = "", *, height: int = 100
    ) -> None:
        """Build it, empty.

        Args:
            gui: the panel.
            colors: of the lines, as CSS.
            title: beside the vertical axis; where it is empty there is no such axis.
            below: below the horizontal axis.
            height: of the plot [px].
        """
        self._n_lines = len(colors)
        self._plot = gui.add_uplot(
            (np.array([0.0, 1.0]), *(np.full(2, np.nan) for _ in colors)),
            (
                uplot.Series(label="x"),
                *(uplot.Series(label="", stroke=color, width=1.5, spanGaps=True) for color in colors),
            ),
            scales=_scales((0.0, 1.0)),
            axes=_axes(title, below),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(show=False),
            height=height,
            visible=False,
        )

    def show(self, visible: bool) -> None:
        """Show it, or hide it."""
        put(self._plot, visible=visible)

    def draw(
        self, x: Array, lines: Sequence[Array], ends: tuple[float, float], across: float | None = None
    ) -> None:
        """Draw lines over `x`, between two ends of the vertical axis; from 0 to `across` where that is given.

        The scale is fixed: lines that hold no numbers would spoil an automatic one.
        """
        rest = [np.full(len(x), np.nan)] * (self._n_lines - len(lines))
        put(self._plot, scales=_scales(ends, across))
        put(self._plot, data=tuple(np.ascontiguousarray(line) for line in (x, *lines, *rest)))


def top_of(lines: Iterable[Array], least: float) -> float:
    """Where a vertical axis ends that shows all of some lines, and at least a value."""
    return ROOM * nice_limit(max(float(np.nanmax(line, initial=least)) for line in lines) / 1.2)


def _scales(ends: tuple[float, float], across: float | None = None) -> dict[str, uplot.Scale]:
    x = uplot.Scale(time=False) if across is None else uplot.Scale(time=False, range=(0.0, across))
    return {"x": x, "y": uplot.Scale(auto=False, range=ends)}


def _axes(title: str, below: str) -> tuple[uplot.Axis, uplot.Axis]:
    across = uplot.Axis(
        label=below, labelSize=18 if below else 0, size=30 if below else 28, labelFont=FONT, font=FONT
    )
    if not title:
        return across, uplot.Axis(show=False)
    return across, uplot.Axis(label=title, labelSize=16, size=42, labelFont=FONT, font=FONT)
