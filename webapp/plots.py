"""Data of the candidates' plot, in the shape that uPlot wants: one rising x, and a column per series."""

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from finlab.allocation.allocation import Allocation, Candidates
from webapp.handles import put
from webapp.theme import DELIVERED, SKY, VERMILLION, css

Array = NDArray[np.float64]
LOWEST, HIGHEST = -5.0, 1.5
"""Powers of ten on the error axis; what lies beyond is drawn at the edge."""
FONT = "11px sans-serif"


class CandidatePlot:
    """A plot of energy against error; of many answers in a row, each is put in once."""

    def __init__(self, gui: viser.GuiApi, height: int) -> None:
        """Build it, empty; `height` in pixels."""
        self._shows: tuple[Allocation, int] | None = None
        self._plot = gui.add_uplot(
            candidate_data(None, None, 0),
            (
                uplot.Series(label="energy"),
                _dots("sampled", css(SKY, 0.75), 5),
                _dots("refined", css(DELIVERED), 8),
                _dots("shown", css(VERMILLION), 15, filled=False),
            ),
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(auto=False, range=(LOWEST, HIGHEST))},
            axes=(_axis("energy", 30), _axis("log₁₀ error", 42)),
            height=height,
        )

    def refresh(self, answer: Allocation | None, shown: int) -> None:
        """Put an answer's samples and candidates in; `shown` is the one on the robot."""
        if answer is None or (
            self._shows is not None and self._shows[0] is answer and self._shows[1] == shown
        ):
            return
        self._shows = (answer, shown)
        put(self._plot, data=candidate_data(answer.samples, answer.candidates, shown))


def _dots(label: str, color: str, size: int, filled: bool = True) -> uplot.Series:
    points = uplot.Series_Points(show=True, size=size, stroke=color, width=1.5)
    if filled:
        points["fill"] = color
    return uplot.Series(label=label, stroke=color, width=0, points=points)


def _axis(label: str, size: int) -> uplot.Axis:
    return uplot.Axis(label=label, labelSize=18, size=size, labelFont=FONT, font=FONT)


def candidate_data(samples: Candidates | None, refined: Candidates | None, shown: int) -> tuple[Array, ...]:
    """Columns: energy, log10 of the errors of samples, of refined ones, of the shown one; NaN is no dot."""
    groups = [(1, samples), (2, refined)]
    rows = [
        (energy, column, error)
        for column, group in groups
        if group is not None
        for energy, error in zip(group.energy, group.err_norm, strict=True)
    ]
    if refined is not None and shown < len(refined.energy):
        rows.append((refined.energy[shown], 3, refined.err_norm[shown]))
    rows = [row for row in rows if np.isfinite(row[0]) and np.isfinite(row[2])]
    if not rows:
        rows = [(0.0, 0, 0.0)]
    rows.sort(key=lambda row: row[0])
    data = np.full((4, len(rows)), np.nan)
    for k, (energy, column, error) in enumerate(rows):
        data[0, k] = energy
        if column > 0:
            data[column, k] = np.clip(np.log10(max(error, 1e-12)), LOWEST + 0.2, HIGHEST - 0.2)
    return tuple(np.ascontiguousarray(column) for column in data)
