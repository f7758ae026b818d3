"""The paper's figure A: the temperature of the draw, and candidates before and after refinement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.evaluation.plots.style import BLUE, GREY, ORANGE, SOFT, VERMILION, Picture, clean, picture

FLOOR = 1e-5
"""Errors below are drawn here."""


def figure_a(
    rows: Sequence[dict[str, Any]], scatter: Mapping[str, NDArray[Any]], paper_temperature: float
) -> Picture:
    """Left: diversity and best J against T, rows of `temperature_row`. Right: columns of
    `refinement_columns`, one target's candidates, energy against error."""
    temperature = [row["temperature"] for row in rows]
    with picture(1, 3, height=3.2, width_ratios=(1, 1, 1.25)) as view:
        spread, best, right = view.axes
        spread.plot(temperature, [row["diversity"] for row in rows], "o-", color=BLUE, markersize=4)
        spread.set_title("diversity of 64 candidates")
        ends = np.array([row["best_j_mean_interval"] for row in rows])
        best.fill_between(temperature, *ends.T, color=VERMILION, alpha=0.15, linewidth=0)
        mean = [row["best_j_mean"] for row in rows]
        median = [row["best_j_median"] for row in rows]
        best.plot(temperature, mean, "o-", color=VERMILION, markersize=4, label="mean")
        best.plot(temperature, median, "o--", color=ORANGE, markersize=3, linewidth=1.2, label="median")
        best.set(yscale="log")
        best.set_title("best J among them")
        best.legend(frameon=False)
        for axis in (spread, best):
            axis.axvline(paper_temperature, color=GREY, linestyle=(0, (2, 2)), linewidth=1.2)
            axis.set(xscale="log", xlabel="temperature T")
        for refined, colour, name in ((0, GREY, "drawn"), (1, BLUE, "refined")):
            keep = scatter["refined"] == refined
            error = np.maximum(scatter["err_norm"][keep], FLOOR)
            right.plot(
                scatter["energy"][keep], error, "o", color=colour, markersize=3.5, alpha=0.6, label=name
            )
        right.set(yscale="log", xlabel="energy J_en", ylabel="normalized error, by the surrogate")
        right.set_title("candidates, energy and error")
        right.legend(frameon=False, labelcolor=SOFT)
        for axis in view.axes:
            clean(axis)
        return view
