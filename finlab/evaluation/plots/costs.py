"""Cost over a yardstick's for each number of fins, one panel per objective."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from finlab.evaluation.plots.style import BLUE, COLOURS, GREEN, GREY, INK, VERMILION, Picture, picture
from finlab.evaluation.statistics.tables import Row

NOTHING = 0.01
"""Part of the cost that is always drawn above and below one, so that noise looks like noise."""
STARTS = {"network": BLUE, "random": VERMILION, "sub-layouts": GREEN, "one": GREY}
"""Where a search begins -> colour."""


def cost_by_fins(rows: Sequence[Row]) -> Picture:
    """Of each method over the best of many starts; rows of `cost_rows`."""
    return _by_fins(rows, "method", COLOURS, "cost over the best of the starts")


def cost_by_starts(rows: Sequence[Row]) -> Picture:
    """Of each place where the search begins over that of all; rows of `network_rows`."""
    return _by_fins([row for row in rows if row["seeds"] in STARTS], "seeds", STARTS, "cost over that of all")


def _by_fins(rows: Sequence[Row], name: str, colours: Mapping[str, str], label: str) -> Picture:
    rows = [row for row in rows if row["fins"] != "all" and row.get("cost_ratio") is not None]
    objectives = list(dict.fromkeys(row["objective"] for row in rows))
    names = list(dict.fromkeys(row[name] for row in rows))
    fins = sorted({row["fins"] for row in rows})
    with picture(1, max(len(objectives), 1), height=3.3, grid="y") as view:
        for axis, objective in zip(view.axes, objectives, strict=False):
            for k, each in enumerate(names):
                mine = [row for row in rows if (row["objective"], row[name]) == (objective, each)]
                place = [
                    fins.index(row["fins"]) + (k - (len(names) - 1) / 2) * 0.7 / len(names) for row in mine
                ]
                ends = np.array([row["cost_ratio_interval"] for row in mine]).reshape(-1, 2)
                ratio = np.array([row["cost_ratio"] for row in mine])
                reach = np.maximum([ratio - ends[:, 0], ends[:, 1] - ratio], 0.0)
                look: dict[str, Any] = {"color": colours[each], "markersize": 5, "elinewidth": 1.2}
                axis.errorbar(place, ratio, reach, fmt="o", label=each, **look)
            axis.axhline(1.0, color=INK, linewidth=0.9)
            low, high = axis.get_ylim()
            axis.set_ylim(min(low, 1.0 - NOTHING), max(high, 1.0 + NOTHING))
            axis.set_xticks(range(len(fins)), [str(count) for count in fins])
            axis.set(xlabel="fins")
            axis.set_title(f"{objective}, below 1 is cheaper")
        view.axes[0].set_ylabel(label)
        return view
