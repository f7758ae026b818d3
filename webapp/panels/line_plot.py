"""A small plot of several lines over one axis, as all tabs draw it."""

from collections.abc import Iterable, Sequence

import numpy as np
import viser
from viser import uplot

from finlab.arrays import Array
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import put
from webapp.session.targets import nice_limit
from webapp.theme import css, fin_color

FONT = "13px sans-serif"
FIN_LINES = tuple(css(fin_color(i)) for i in range(MAX_ACTUATORS))
"""Colours of lines that belong to a fin each."""
ROOM = 1.14
"""Room above the last tick, so that its number is not cut off."""


class LinePlot:
    """A fixed number of lines; those that are not needed hold no numbers."""

    def __init__(
        self,
        gui: viser.GuiApi,
        colors: Sequence[str],
        title: str,
        below: str = "",
        *,
        height: int = 100,
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
