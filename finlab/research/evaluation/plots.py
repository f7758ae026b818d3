"""Pictures of experiments: their rows, as the paper's figures show them.

Drawn by `finlab.display.figures`; each is the `picture` of an `Experiment`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.display.figures import COLORS, panels
from finlab.errors import DataError
from finlab.research.evaluation.document import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD^v<>"
"""Markers of the splits of one method, which has one color."""
ERROR_MIN = 1e-12
"""Errors below this one are drawn there: a logarithmic axis has no 0."""


def temperature_picture(rows: Sequence[Row]) -> Figure:
    """Returns a figure of the candidates' diversity and best J over the temperature (the paper's
    figure A, left), from the rows of experiment `temperature`."""
    rows = sorted(rows, key=lambda row: row["temperature"])
    figure, left = _axes("Candidates of the mixture over the temperature of the draw")
    right = left.twinx()
    temperature = [row["temperature"] for row in rows]
    ends = np.array([row["best_j_mean_interval"] for row in rows])
    lines = [
        *left.plot(
            temperature,
            [row["diversity"] for row in rows],
            "o-",
            color=COLORS[0],
            label="diversity",
        ),
        *right.plot(
            temperature,
            [row["best_j_mean"] for row in rows],
            "s--",
            color=COLORS[1],
            label="best J, mean",
        ),
        right.fill_between(
            temperature, *ends.T, color=COLORS[1], alpha=0.1, lw=0, label="its interval"
        ),
    ]
    left.set(xscale="log", xlabel="temperature T", ylabel="diversity [share of the command ranges]")
    left.set_ylim(bottom=0.0)
    right.set(yscale="log", ylabel="best J before refinement")
    for axes, color in ((left, COLORS[0]), (right, COLORS[1])):
        axes.yaxis.label.set_color(color)
    left.legend(
        handles=lines, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False
    )
    return figure


def candidates_picture(rows: Sequence[Row]) -> Figure:
    """Returns a figure of effort over error, of raw and refined candidates (the paper's figure A,
    right).

    Args:
        rows: of experiment `ablation`; "points" of one is a list with an entry for each robot,
            which has under "raw" and "refined" a list (S, 2) of candidates, the best first:
            normalized error and effort of each.

    Raises:
        DataError: no row has any.
    """
    figure, axes = _axes("Candidates before and after their refinement")
    robots: list[dict[str, Any]] = []
    for row in rows:
        robots.extend(row.get("points", ()))
    if not robots:
        raise DataError("plot: no candidates to draw; take variant ours")
    styles: dict[str, dict[str, Any]] = {
        "raw": {"color": COLORS[0], "s": 7, "alpha": 0.35},
        "refined": {"color": COLORS[1], "s": 22, "alpha": 0.9},
    }
    for name, style in styles.items():
        error, effort = np.concatenate([candidates[name] for candidates in robots]).T
        style["label"] = f"{name} ({len(error):,})"
        axes.scatter(np.maximum(error, ERROR_MIN), effort, linewidths=0, **style)
    for k, candidates in enumerate(robots):
        error, effort = np.transpose([candidates["raw"][0], candidates["refined"][0]])
        label = None if k else "from the best raw one to the best refined one"
        axes.plot(
            np.maximum(error, ERROR_MIN), effort, color="0.5", linewidth=0.7, label=label, zorder=1
        )
    axes.set(xscale="log", xlabel="normalized wrench error, by the surrogate", ylabel="effort J_en")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
    return figure


def fins_picture(rows: Sequence[Row]) -> Figure:
    """Returns a figure of the error by number of fins, for each split and method (the paper's
    figure B): median, and the range from the 5th to the 95th percentile. From the rows of
    experiment `wrench`."""
    rows = [row for row in rows if row.get("fins") is not None]
    figure, axes = _axes("Wrench error by number of fins")
    series = sorted({(row["method"], row["split"]) for row in rows})
    splits = list(dict.fromkeys(row["split"] for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    counts = sorted({row["fins"] for row in rows})
    for k, (method, split) in enumerate(series):
        # Series stand side by side within 0.7 of the width that a number of fins has.
        shift = 0.7 * ((k + 0.5) / len(series) - 0.5)
        x = []
        percentiles = []
        for row in rows:
            if (row["method"], row["split"]) == (method, split):
                x.append(counts.index(row["fins"]) + shift)
                percentiles.append(
                    (row["err_norm_p05"], row["err_norm_median"], row["err_norm_p95"])
                )
        low, median, high = np.maximum(percentiles, ERROR_MIN).T
        axes.errorbar(
            x,
            median,
            yerr=[median - low, high - median],
            fmt=MARKERS[splits.index(split) % len(MARKERS)],
            color=COLORS[methods.index(method) % len(COLORS)],
            markersize=5,
            capsize=3,
            label=f"{method}, {split}",
        )
    axes.set_xticks(range(len(counts)), [str(count) for count in counts])
    axes.set(yscale="log", xlabel="number of fins", ylabel="err_norm: median, 5 to 95 %")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _axes(title: str) -> tuple[Figure, Axes]:
    """A figure of one panel with a title, and its axes."""
    figure, axes = panels((7.0, 4.4))
    axes[0, 0].set_title(title)
    return figure, axes[0, 0]
