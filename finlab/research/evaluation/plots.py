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
"""Of the splits of one color."""
ERROR_MIN = 1e-12
"""Errors below this one are drawn there: a logarithmic axis has no 0."""


def temperature_picture(rows: Sequence[Row]) -> Figure:
    """Diversity of the candidates and the best J over the temperature (the paper's figure A,
    left)."""
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
    """Effort over error of raw and refined candidates (the paper's figure A, right).

    Args:
        rows: of the experiment; "points" of one is a list with an entry for each robot, which has
            under "raw" and "refined" a list (S, 2) of candidates, the best first: normalized error
            and effort of each.

    Raises:
        DataError: no row has any.
    """
    figure, axes = _axes("Candidates before and after their refinement")
    marks = {"raw": (COLORS[0], 7, 0.35), "refined": (COLORS[1], 22, 0.9)}
    points = [each for row in rows for each in row.get("points", ())]
    if not points:
        raise DataError("plot: no candidates to draw; take variant ours")
    for name, (color, size, alpha) in marks.items():
        error, effort = np.concatenate([each[name] for each in points]).T
        about: dict[str, Any] = {"s": size, "color": color, "alpha": alpha, "linewidths": 0}
        axes.scatter(
            np.maximum(error, ERROR_MIN), effort, label=f"{name} ({len(error):,})", **about
        )
    for k, each in enumerate(points):
        error, effort = np.transpose([each["raw"][0], each["refined"][0]])
        label = None if k else "from the best raw one to the best refined one"
        axes.plot(
            np.maximum(error, ERROR_MIN), effort, color="0.5", linewidth=0.7, label=label, zorder=1
        )
    axes.set(xscale="log", xlabel="normalized wrench error, by the surrogate", ylabel="effort J_en")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
    return figure


def fins_picture(rows: Sequence[Row]) -> Figure:
    """Error by number of fins, of each split and method (the paper's figure B): median, and the
    range from the 5th to the 95th percentile."""
    rows = [row for row in rows if row.get("fins") is not None]
    figure, axes = _axes("Wrench error by number of fins")
    series = sorted({(row["split"], row["method"]) for row in rows}, key=lambda pair: pair[::-1])
    splits, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("split", "method"))
    counts = sorted({row["fins"] for row in rows})
    for k, pair in enumerate(series):
        some = [row for row in rows if (row["split"], row["method"]) == pair]
        place = [counts.index(row["fins"]) + 0.7 * ((k + 0.5) / len(series) - 0.5) for row in some]
        keys = "err_norm_p05", "err_norm_median", "err_norm_p95"
        low, middle, high = np.maximum([[row[key] for key in keys] for row in some], ERROR_MIN).T
        color = COLORS[methods.index(pair[1]) % len(COLORS)]
        bars: dict[str, Any] = {"yerr": [middle - low, high - middle], "color": color, "capsize": 3}
        bars["fmt"] = MARKERS[splits.index(pair[0]) % len(MARKERS)]
        axes.errorbar(place, middle, label=f"{pair[1]}, {pair[0]}", markersize=5, **bars)
    axes.set_xticks(range(len(counts)), [str(count) for count in counts])
    axes.set(yscale="log", xlabel="number of fins", ylabel="err_norm: median, 5 to 95 %")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _axes(title: str) -> tuple[Figure, Axes]:
    """A figure of one panel."""
    figure, axes = panels((7.0, 4.4))
    axes[0, 0].set_title(title)
    return figure, axes[0, 0]
