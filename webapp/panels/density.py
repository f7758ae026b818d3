"""Three plots of the network's mixture: one line per fin over amplitude, frequency and zero direction."""

import viser

from finlab.layout.layout import MAX_FINS
from webapp.handles import Changes, put
from webapp.panels.line_plot import LinePlot
from webapp.tasks.density import Densities
from webapp.theme import css, fin_color

TITLES = ("amplitude [°]", "frequency [Hz]", "zero direction [°]")


class DensityPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build the plots, empty. The number of lines is fixed: lines without a fin hold no numbers."""
        self._changes = Changes()
        with gui.add_folder("What the network proposes", expand_by_default=False) as self._folder:
            gui.add_html(
                "<div class='fl dim'>How likely each command is, in the fin's colour; every curve has its "
                "highest point at the top.</div>"
            )
            colors = [css(fin_color(i)) for i in range(MAX_FINS)]
            # Fins that do the same have the same curve: each next line is thinner, so that all are seen.
            self._plots = [
                LinePlot(gui, colors, "", title, height=112, widths=(6.0, 4.5, 3.0, 1.5), visible=True)
                for title in TITLES
            ]

    def refresh(self, densities: Densities | None) -> None:
        """Draw densities, or hide the plots where the method has none."""
        put(self._folder, visible=densities is not None)
        if densities is None or not self._changes(densities):
            return
        for k, plot in enumerate(self._plots):
            plot.draw(densities.places[k], list(densities.curves[:, k]), (0.0, 1.08))
