"""Live plots of a swim, a few times a second: the way off, a wrench axis, the fins' forces."""

import time

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.layout.layout import MAX_FINS
from webapp.handles import Changes, hold_kind
from webapp.panels.line_plot import LinePlot
from webapp.session.state import AXIS_UNITS, AXIS_WORDS
from webapp.session.targets import nice_limit
from webapp.tasks.swimmer import ASKED as ASKED_COLUMN
from webapp.tasks.swimmer import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.swimmer import ERROR, FORCES, TIME
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DELIVERED, OTHER, css, fin_color

EVERY_S = 0.2
"""Least time between two drawings [s]."""
ROOM = 1.08
"""Room above the last tick, so that its number is not cut off."""
Array = NDArray[np.float64]


class SwimPlots:
    """Three plots over time."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build them, empty."""
        self._drawn = 0.0
        self._changes = Changes()
        self._error = LinePlot(gui, (css(DELIVERED), css(OTHER)), "off path [cm]")
        self._wrench = LinePlot(gui, (css(ASKED), css(DELIVERED)), "surge [N]")
        colors = [css(fin_color(i)) for i in range(MAX_FINS)]
        self._force = LinePlot(gui, colors, "fins [N]", "time [s]", height=124)
        self._axis: viser.GuiDropdownHandle[str] | None = None

    def add_axis_choice(self, gui: viser.GuiApi) -> viser.GuiDropdownHandle[str]:
        """Let the user choose which axis of the wrench is drawn."""
        self._axis = gui.add_dropdown(
            "Plot the wrench of", AXIS_WORDS, hint="Asked in blue, delivered in green, of the first robot."
        )
        hold_kind(self._axis)
        return self._axis

    def refresh(self, swimming: Swimming) -> None:
        """Draw, but no more often than an eye can follow."""
        swimmers = swimming.swimmers
        moments = tuple(swimmer.shown for swimmer in swimmers)
        for plot in (self._error, self._wrench, self._force):
            plot.show(bool(swimmers))
        axis = 0
        if self._axis is not None and self._axis.value in AXIS_WORDS:
            axis = AXIS_WORDS.index(self._axis.value)
        soon = time.monotonic() - self._drawn < EVERY_S and swimming.running
        if not moments or soon or not len(moments[0].record) or not self._changes(axis, *moments):
            return
        self._drawn = time.monotonic()
        record = moments[0].record
        seconds = np.ascontiguousarray(record[:, TIME])
        lines = [
            100 * np.interp(seconds, m.record[:, TIME], m.record[:, ERROR]) for m in moments if len(m.record)
        ]
        self._error.draw(seconds, lines, (0.0, _top(lines)))
        both = [record[:, column + axis] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        self._wrench.name(f"{AXIS_WORDS[axis]} [{AXIS_UNITS[axis]}]", "")
        self._wrench.draw(seconds, both, (-_top([-both[0], -both[1]]), _top(both)))
        forces = list(record[:, FORCES:].T)
        self._force.draw(seconds, forces, (0.0, _top(forces)))


def _top(lines: list[Array]) -> float:
    return ROOM * nice_limit(max(float(np.nanmax(line, initial=0.01)) for line in lines) / 1.2)
