"""Live plots of a swim, a few times a second: the way off, a wrench axis, the fins' forces."""

import time

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from finlab.layout.layout import MAX_FINS
from webapp.handles import Changes, hold_kind, put
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
FONT = "11px sans-serif"
Array = NDArray[np.float64]


class SwimPlots:
    """Three plots over time."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build them, empty."""
        self._drawn = 0.0
        self._changes = Changes()
        self._error = _plot(gui, (css(DELIVERED), css(OTHER)), "off path [cm]")
        self._wrench = _plot(gui, (css(ASKED), css(DELIVERED)), "surge [N]")
        self._force = _plot(gui, tuple(css(fin_color(i)) for i in range(MAX_FINS)), "fins [N]", "time [s]")
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
            put(plot, visible=bool(swimmers))
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
        lines += [np.full(len(seconds), np.nan)] * (2 - len(lines))
        _draw(self._error, seconds, lines, (0.0, _top(lines)))
        both = [record[:, column + axis] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        put(self._wrench, axes=_axes(f"{AXIS_WORDS[axis]} [{AXIS_UNITS[axis]}]", ""))
        _draw(self._wrench, seconds, both, (-_top([-both[0], -both[1]]), _top(both)))
        forces = list(record[:, FORCES:].T)
        top = _top(forces)
        forces += [np.full(len(seconds), np.nan)] * (MAX_FINS - len(forces))
        _draw(self._force, seconds, forces, (0.0, top))


def _top(lines: list[Array]) -> float:
    return ROOM * nice_limit(max(float(np.nanmax(line, initial=0.01)) for line in lines) / 1.2)


def _draw(plot: viser.GuiUplotHandle, x: Array, lines: list[Array], ends: tuple[float, float]) -> None:
    # A scale of its own: lines that hold no numbers would spoil an automatic one.
    scales = {"x": uplot.Scale(time=False), "y": uplot.Scale(auto=False, range=ends)}
    put(plot, scales=scales)
    put(plot, data=(x, *(np.ascontiguousarray(line) for line in lines)))


def _plot(gui: viser.GuiApi, colors: tuple[str, ...], title: str, below: str = "") -> viser.GuiUplotHandle:
    empty = tuple(np.array([0.0, 1.0]) if k == 0 else np.full(2, np.nan) for k in range(len(colors) + 1))
    return gui.add_uplot(
        empty,
        (uplot.Series(label="t"), *(uplot.Series(label="", stroke=color, width=1.5) for color in colors)),
        scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=False, range=(0.0, 1.0))},
        axes=_axes(title, below),
        legend=uplot.Legend(show=False),
        cursor=uplot.Cursor(show=False),
        height=124 if below else 100,
        visible=False,
    )


def _axes(title: str, below: str) -> tuple[uplot.Axis, uplot.Axis]:
    return (
        uplot.Axis(
            label=below, labelSize=16 if below else 0, size=30 if below else 24, labelFont=FONT, font=FONT
        ),
        uplot.Axis(label=title, labelSize=16, size=42, labelFont=FONT, font=FONT),
    )
