"""Three plots of the network's mixture: one line per fin over amplitude, frequency and zero direction."""

import numpy as np
import viser
from viser import uplot

from finlab.layout.layout import MAX_FINS
from webapp.handles import Changes, put
from webapp.tasks.density import Densities
from webapp.theme import css, fin_color

TITLES = ("amplitude [°]", "frequency [Hz]", "zero direction [°]")
FONT = "11px sans-serif"


class DensityPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build the plots, empty. The number of lines is fixed: lines without a fin hold no numbers."""
        self._changes = Changes()
        series = (
            uplot.Series(label="x"),
            # Fins that do the same have the same curve: each next line is thinner, so that all are seen.
            *(
                uplot.Series(label=str(i + 1), stroke=css(fin_color(i)), width=max(6.0 - 1.5 * i, 1.5))
                for i in range(MAX_FINS)
            ),
        )
        empty = tuple(np.full(2, float(k == 0)) * [0, 1] for k in range(MAX_FINS + 1))
        with gui.add_folder("What the network proposes", expand_by_default=False) as self._folder:
            gui.add_html(
                "<div class='fl dim'>How likely each command is, in the fin's colour; every curve has its "
                "highest point at the top.</div>"
            )
            self._plots = [
                gui.add_uplot(
                    empty,
                    series,
                    scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=False, range=(0.0, 1.08))},
                    axes=(
                        uplot.Axis(label=title, labelSize=18, size=28, labelFont=FONT, font=FONT),
                        uplot.Axis(show=False),
                    ),
                    legend=uplot.Legend(show=False),
                    cursor=uplot.Cursor(show=False),
                    height=112,
                )
                for title in TITLES
            ]

    def refresh(self, densities: Densities | None) -> None:
        """Draw densities, or hide the plots where the method has none."""
        put(self._folder, visible=densities is not None)
        if densities is None or not self._changes(densities):
            return
        n, _, points = densities.curves.shape
        for k, plot in enumerate(self._plots):
            lines = np.full((MAX_FINS, points), np.nan)
            lines[:n] = densities.curves[:, k]
            plot.data = (np.ascontiguousarray(densities.places[k]), *np.ascontiguousarray(lines))
