"""One look for all pictures: Okabe-Ito colours, one for each method wherever it appears."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, SKY = "#0072B2", "#E69F00", "#009E73", "#56B4E9"
VERMILION, PURPLE, YELLOW, BLACK, GREY = "#D55E00", "#CC79A7", "#F0E442", "#000000", "#8A949E"
INK, SOFT, LINE = "#1c2733", "#5c6b7a", "#e3e8ed"

COLOURS = {
    "dual": BLUE,
    "mdn": "#004B78",
    "paper": ORANGE,
    "analytic": GREEN,
    "sqp": PURPLE,
    "qp": GREY,
    "px4": VERMILION,
    "ardusub": SKY,
    "ipopt": BLACK,
    "ipopt-32": BLACK,
}
DASHES: dict[str, Any] = {"color": GREY, "linestyle": (0, (2, 2)), "linewidth": 1.2}
"""Of a line at a figure of the paper."""
WIDTH = 9.6
FONT = 9.5


@contextmanager
def picture(
    rows: int = 1,
    columns: int = 1,
    *,
    height: float = 3.2,
    grid: str = "both",
) -> Iterator[Picture]:
    """Axes to draw on, in the common look: hairlines behind the data, no box around it, and one legend for
    all axes, above them, where a name that several share is shown once.

    Args:
        rows: of axes.
        columns: of axes.
        height: of the picture in inches.
        grid: axes with hairlines.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(LOOK):
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        FigureCanvasAgg(figure)
        axes = list(figure.subplots(rows, columns, squeeze=False).flat)
        yield Picture(figure, axes)
        names: dict[str, Any] = {}
        for axis in axes:
            clean(axis, grid)
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                names.setdefault(label, handle)
        if names:
            figure.legend(
                list(names.values()), list(names), frameon=False, loc="outside upper left", ncols=len(names)
            )


class Picture:
    """A figure and its axes, in reading order."""

    def __init__(self, figure: Figure, axes: list[Axes]) -> None:
        self.figure, self.axes = figure, axes

    def svg(self, name: str) -> str:
        """The picture; `name` keeps its identifiers apart from those of other pictures on the page."""
        import matplotlib

        text = io.StringIO()
        with matplotlib.rc_context({**LOOK, "svg.hashsalt": name}):
            self.figure.savefig(
                text, format="svg", dpi=160, transparent=True, metadata={"Date": None, "Creator": None}
            )
        return text.getvalue()


def clean(axis: Axes, grid: str) -> None:
    axis.grid(True, axis=grid, color=LINE, linewidth=0.7)  # type: ignore[arg-type]
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axis.spines[side].set_color("#b8c2cc")
    axis.tick_params(colors=SOFT, labelcolor=INK, length=3, width=0.7, which="both")


LOOK: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": FONT,
    "axes.titlesize": FONT + 0.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": FONT,
    "axes.labelcolor": SOFT,
    "axes.titlecolor": INK,
    "text.color": INK,
    "legend.fontsize": FONT,
    "lines.linewidth": 1.8,
    "svg.fonttype": "none",
}
