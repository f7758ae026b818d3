"""Times of calls, the ablation, the small trainings, and the temperature."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from finlab.arrays import AnyArray
from finlab.evaluation.plots import style
from finlab.evaluation.plots.style import Picture, picture


def latency_dots(rows: Sequence[dict[str, Any]], paper_ms: float) -> Picture:
    """Median and 99th percentile of each method's calls."""
    ordered = sorted(rows, key=lambda row: row["p50_ms"])
    with picture(height=0.9 + 0.26 * len(rows), grid="x") as view:
        (axis,) = view.axes
        for k, row in enumerate(ordered):
            colour = style.COLOURS[row["method"]]
            axis.plot([row["p50_ms"], row["p99_ms"]], [k, k], color=colour, linewidth=4, alpha=0.45)
            axis.plot(row["p50_ms"], k, "o", color=colour, markersize=7)
        style.mark_printed(axis, paper_ms, "the paper's cycle")
        axis.set(xscale="log", xlabel="one call [ms]: median (dot) to 99th percentile")
        axis.set_yticks(range(len(ordered)), [row["method"] for row in ordered])
        axis.invert_yaxis()
        return view


def training_bars(rows: Sequence[dict[str, Any]], titles: Mapping[str, str]) -> Picture:
    """Error of each small training before and after refinement, with intervals."""
    with picture(height=0.9 + 0.34 * len(rows)) as view:
        (axis,) = view.axes
        for key, colour, name in (
            ("err_norm_mean", style.GREY, "best raw candidate"),
            ("refined_err_norm_mean", style.GREEN, "after 4 Levenberg-Marquardt steps"),
        ):
            value = [row[key] for row in rows]
            low = [max(0.0, row[key] - row[f"{key}_interval"][0]) for row in rows]
            high = [max(0.0, row[f"{key}_interval"][1] - row[key]) for row in rows]
            look: dict[str, Any] = {"color": colour, "markersize": 6, "elinewidth": 1.3, "label": name}
            axis.errorbar(value, range(len(rows)), xerr=[low, high], fmt="o", **look)
        axis.set(xscale="log", xlabel="mean normalized error, by the plant")
        axis.set_yticks(range(len(rows)), [titles[row["change"]] for row in rows])
        axis.invert_yaxis()
        return view


COLOUR = {"adam": style.ORANGE, "levenberg-marquardt": style.BLUE}


def ablation_dots(
    rows: Sequence[dict[str, Any]], printed: Mapping[str, float], titles: Mapping[str, str]
) -> Picture:
    """Mean J_norm of each row; rows of `variant_rows`, `printed` by variant."""
    variants = list(titles)
    with picture(height=3.1, legend=3) as view:
        (axis,) = view.axes
        for k, (refinement, colour) in enumerate(COLOUR.items()):
            for scored_by, filled in (("plant", True), ("surrogate", False)):
                mine = [r for r in rows if (r["refinement"], r["scored_by"]) == (refinement, scored_by)]
                place = [variants.index(row["variant"]) + 0.16 * (2 * k - 1) for row in mine]
                look: dict[str, Any] = {"color": colour, "markerfacecolor": colour if filled else "white"}
                label = f"{refinement}, scored by the {scored_by}"
                axis.plot([row["j_norm_mean"] for row in mine], place, "o", ms=7, label=label, **look)
        look = {"color": style.BLACK, "markerfacecolor": "none"}
        means = [printed[name] for name in variants]
        axis.plot(means, range(len(variants)), "D", ms=7, label="printed in the paper", **look)
        axis.set(xscale="log", xlabel="mean J_norm")
        axis.set_yticks(range(len(variants)), [titles[name] for name in variants])
        axis.invert_yaxis()
        return view


FLOOR = 1e-5
"""Errors below are drawn here."""


def figure_a(
    rows: Sequence[dict[str, Any]], scatter: Mapping[str, AnyArray], paper_temperature: float
) -> Picture:
    """Left: diversity and best J against T, rows of `temperature_row`. Right: columns of
    `refinement_columns`, one target's candidates, energy against error."""
    temperature = [row["temperature"] for row in rows]
    with picture(1, 3, height=3.2, legend=0, width_ratios=(1, 1, 1.25)) as view:
        spread, best, right = view.axes
        spread.plot(temperature, [row["diversity"] for row in rows], "o-", color=style.BLUE, markersize=4)
        spread.set_title("diversity of 64 candidates")
        ends = np.array([row["best_j_mean_interval"] for row in rows])
        best.fill_between(temperature, *ends.T, color=style.VERMILION, alpha=0.15, linewidth=0)
        mean = [row["best_j_mean"] for row in rows]
        median = [row["best_j_median"] for row in rows]
        best.plot(temperature, mean, "o-", color=style.VERMILION, markersize=4, label="mean")
        best.plot(temperature, median, "o--", color=style.ORANGE, markersize=3, linewidth=1.2, label="median")
        best.set(yscale="log")
        best.set_title("best J among them")
        best.margins(y=0.4)  # room for the legend
        best.legend(frameon=False, loc="upper right")
        for axis in (spread, best):
            axis.axvline(paper_temperature, **style.DASHES)
            axis.set(xscale="log", xlabel="temperature T")
        for refined, colour, name in ((0, style.GREY, "drawn"), (1, style.BLUE, "refined")):
            keep = scatter["refined"] == refined
            error = np.maximum(scatter["err_norm"][keep], FLOOR)
            right.plot(
                scatter["energy"][keep], error, "o", color=colour, markersize=3.5, alpha=0.6, label=name
            )
        right.set(yscale="log", xlabel="energy J_en", ylabel="normalized error, by the surrogate")
        right.set_title("candidates, energy and error")
        right.legend(frameon=False, labelcolor=style.SOFT)
        return view
