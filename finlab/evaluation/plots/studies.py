"""Times side by side, what the network's seeds buy, and the small trainings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from finlab.evaluation.plots.style import BLUE, COLOURS, GREEN, GREY, INK, ORANGE, Picture, clean, picture

SEEDS = {"network": BLUE, "random": GREY, "quasi-random": ORANGE}


def latency_dots(rows: Sequence[dict[str, Any]], paper_ms: float) -> Picture:
    """Median and 99th percentile of each method's calls."""
    ordered = sorted(rows, key=lambda row: row["p50_ms"])
    with picture(height=0.9 + 0.26 * len(rows)) as view:
        (axis,) = view.axes
        for k, row in enumerate(ordered):
            colour = COLOURS[row["method"]]
            axis.plot([row["p50_ms"], row["p99_ms"]], [k, k], color=colour, linewidth=4, alpha=0.45)
            axis.plot(row["p50_ms"], k, "o", color=colour, markersize=7)
        axis.axvline(paper_ms, color=INK, linestyle=(0, (2, 2)), linewidth=1.2)
        axis.annotate("the paper's cycle", (paper_ms, -0.9), fontsize=8, ha="center", annotation_clip=False)
        axis.set(xscale="log", xlabel="one call [ms]: median (dot) to 99th percentile")
        axis.set_yticks(range(len(ordered)), [row["method"] for row in ordered])
        axis.invert_yaxis()
        clean(axis, grid="x")
        return view


def seed_lines(rows: Sequence[dict[str, Any]]) -> Picture:
    """Mean error against refinement steps for each number of fins and kind of seed."""
    fins = sorted({row["fins"] for row in rows})
    with picture(1, len(fins), height=2.9, sharey=True) as view:
        for axis, n in zip(view.axes, fins, strict=True):
            for kind, colour in SEEDS.items():
                mine = [row for row in rows if (row["fins"], row["seeds"]) == (n, kind)]
                steps, error = [r["steps"] for r in mine], [max(r["err_norm_mean"], 1e-8) for r in mine]
                axis.plot(range(len(steps)), error, "o-", color=colour, markersize=4, label=kind)
                axis.set_xticks(range(len(steps)), [str(step) for step in steps])
            axis.set(yscale="log", xlabel="refinement steps")
            axis.set_title(f"{n} fins")
            clean(axis)
        view.axes[0].set_ylabel("mean normalized error")
        view.legend()
        return view


def training_bars(rows: Sequence[dict[str, Any]], titles: Mapping[str, str]) -> Picture:
    """Error of each small training before and after refinement, with intervals."""
    with picture(height=0.9 + 0.34 * len(rows)) as view:
        (axis,) = view.axes
        for key, colour, name in (
            ("err_norm_mean", GREY, "best raw candidate"),
            ("refined_err_norm_mean", GREEN, "after 4 Levenberg-Marquardt steps"),
        ):
            value = [row[key] for row in rows]
            low = [max(0.0, row[key] - row[f"{key}_interval"][0]) for row in rows]
            high = [max(0.0, row[f"{key}_interval"][1] - row[key]) for row in rows]
            style: dict[str, Any] = {"color": colour, "markersize": 6, "elinewidth": 1.3, "label": name}
            axis.errorbar(value, range(len(rows)), xerr=[low, high], fmt="o", **style)
        axis.set(xscale="log", xlabel="mean normalized error, by the plant")
        axis.set_yticks(range(len(rows)), [titles[row["change"]] for row in rows])
        axis.invert_yaxis()
        clean(axis)
        view.legend()
        return view
