"""What happens while robots swim: plots over time."""

import time

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import Changes, add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.page import Page
from webapp.panels.line_plot import FIN_LINES, LinePlot, top_of
from webapp.tasks.moment import ASKED as ASKED_COLUMN
from webapp.tasks.moment import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.moment import DEPTH_ERROR, ERROR, FORCES, POWER, TIME
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DELIVERED, css

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
SMOOTH = 1.0
"""Time over which plotted power is averaged [s]."""


class Timeline:
    """What is said before a swim, and the plots."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        add_html(gui, marker("fl-timeline"))
        self._none = add_html(gui, html("<div class='fl dim fl-unswum'>{}</div>", UNSWUM))
        self._plots = SwimPlots(gui)

    def refresh(self) -> None:
        swimming = self._page.swimming
        swimmer = swimming.swimmer
        there = swimmer is not None
        put(self._none, visible=not there)
        self._plots.show(there)
        if swimmer is not None:
            self._plots.refresh(swimmer, swimming.running)


class SwimPlots:
    """Six plots over time."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._drawn = 0.0
        self._changes = Changes()
        robot, wrench = (css(DELIVERED),), (css(ASKED), css(DELIVERED))

        def plot(colors: tuple[str, ...], title: str, below: str = "") -> LinePlot:
            height = PLOT_PX + (24 if below else 0)
            return LinePlot(gui, colors, title, below, height=height)

        self._error = plot(robot, "off [cm]")
        self._depth = plot(robot, "z off [cm]")
        self._power = plot(robot, "power [W]")
        self._wrench = plot(wrench, "surge [N]", "time [s]")
        self._force = plot(FIN_LINES, "fins [N]", "time [s]")
        self._broken = plot(FIN_LINES, "broken %", "time [s]")

    def show(self, visible: bool) -> None:
        """Show all plots, or none."""
        for plot in (self._error, self._depth, self._power, self._wrench, self._force, self._broken):
            plot.show(visible)

    def refresh(self, swimmer: Swimmer, running: bool) -> None:
        """Draw errors, power, surge asked and delivered, forces and the monitor's doubts, no more often than
        an eye can follow."""
        record = swimmer.shown.record
        soon = time.monotonic() - self._drawn < EVERY_S and running
        if soon or not len(record) or not self._changes(swimmer.shown):
            return
        self._drawn = time.monotonic()
        seconds = np.ascontiguousarray(record[:, TIME])
        end = shown_until(float(seconds[-1]), swimmer.duration_s)
        for plot, column, scale in (
            (self._error, ERROR, 100.0),
            (self._depth, DEPTH_ERROR, 100.0),
            (self._power, POWER, 1.0),
        ):
            lines = [_line(record, column, scale)]
            plot.draw(seconds, lines, (0.0, top_of(lines, SMALL)), end)
        both = [record[:, column] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        ends = (-top_of([-both[0], -both[1]], SMALL), top_of(both, SMALL))
        self._wrench.draw(seconds, both, ends, end)
        n_fins = len(swimmer.fins)
        forces = list(record[:, FORCES : FORCES + n_fins].T)
        self._force.draw(seconds, forces, (0.0, top_of(forces, SMALL)), end)
        doubts = list(100.0 * record[:, FORCES + n_fins :].T)
        self._broken.draw(seconds, doubts, (0.0, CERTAIN), end)


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
