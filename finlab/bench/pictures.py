"""Pictures of the benchmark's page."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

from finlab.bench.metrics import LEVELS, SOLVED
from finlab.evaluation.plots import style
from finlab.evaluation.plots.style import Picture, picture

OTHERS = ("#C2185B", "#6D4C41", "#7CB342", "#5E35B1")
"""Colours of methods that have none of their own, in turn; no other method has them."""
OWN = 3.0
"""Width of the lines of methods that stand out among stored ones."""


def profile_and_times(rows: Sequence[dict[str, Any]]) -> Picture:
    """Share of targets met within a relative error, and the times of calls, of each method."""
    spare = cycle(OTHERS)
    colours = {row["method"]: style.COLOURS.get(row["method"]) or next(spare) for row in rows}
    timed = sorted((row for row in rows if row["summary"]["p50_ms"]), key=lambda r: -r["summary"]["p50_ms"])
    with picture(1, 2, height=3.8, legend=6, width_ratios=(1.5, 1)) as view:
        left, right = view.axes
        for row in rows:
            share = [100.0 * value for value in row["profile"]]
            look: dict[str, Any] = {"color": colours[row["method"]], "label": row["method"]}
            if row.get("_kind") == "ours":
                look |= {"linewidth": OWN, "zorder": 3}
            left.plot(LEVELS, share, **look)
        left.axvline(SOLVED, **style.DASHES)
        left.set(xscale="log", xlabel="relative error, up to", ylabel="targets [%]", ylim=(-2, 102))
        left.set_xlim(LEVELS[0], LEVELS[-1])
        for k, row in enumerate(timed):
            colour, summary = colours[row["method"]], row["summary"]
            right.plot([summary["p50_ms"], summary["p99_ms"]], [k, k], color=colour, linewidth=4, alpha=0.45)
            right.plot(summary["p50_ms"], k, "o", color=colour, markersize=7)
        right.set(xscale="log", xlabel="one call [ms]")
        right.set_yticks(range(len(timed)), [row["method"] for row in timed])
        return view
