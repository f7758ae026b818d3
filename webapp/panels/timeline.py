"""What happens while robots swim: plots over time."""

import time

import numpy as np

from finlab.arrays import Array
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.page import Page
from webapp.panels.line_plot import FIN_LINES, LinePlot, top_of
from webapp.tasks.moment import ASKED as ASKED_COLUMN
from webapp.tasks.moment import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.moment import DEPTH_ERROR, ERROR, FORCES, POWER, TIME, Moment
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
    forces = plot(FIN_LINES, "fins [N]", "time [s]")
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
