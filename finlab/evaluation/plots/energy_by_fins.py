"""Energy beside 32 starts of IPOPT, and how many fins rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from finlab.evaluation.plots.style import COLOURS, INK, Picture, clean, picture


def energy_by_fins(rows: Sequence[dict[str, Any]], reference: str) -> Picture:
    """Energy over the reference's, and resting fins, for each number of fins; rows of `energy_rows`."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    fins = sorted({row["fins"] for row in rows if row["fins"] != "all"})
    with picture(1, 2, height=3.3) as view:
        left, right = view.axes
        for k, method in enumerate(methods):
            offset = (k - (len(methods) - 1) / 2) * 0.7 / len(methods)
            mine = [row for row in rows if row["method"] == method and row["fins"] != "all"]
            known = [row for row in mine if row["energy_ratio"] is not None]
            place = [row["fins"] + offset for row in known]
            colour = COLOURS[method]
            inside = "white" if method == reference else colour
            style: dict[str, Any] = {"color": colour, "markerfacecolor": inside, "markersize": 5}
            if method != reference:
                low = [row["energy_ratio"] - row["energy_ratio_low"] for row in known]
                high = [row["energy_ratio_high"] - row["energy_ratio"] for row in known]
                ratio = [row["energy_ratio"] for row in known]
                left.errorbar(place, ratio, [low, high], fmt="o", elinewidth=1.2, label=method, **style)
            resting = [row["resting"] for row in known]
            right.plot(place, resting, "o", label=method, **style)
        left.axhline(1.0, color=INK, linewidth=0.9)
        left.set(ylabel=f"energy over {reference}'s", title="energy, below 1 is cheaper")
        right.set(ylabel="fins at rest, mean", title="fins at rest")
        for axis in view.axes:
            axis.set(xlabel="fins", xticks=fins)
            clean(axis, grid="y")
        view.legend()
        return view
