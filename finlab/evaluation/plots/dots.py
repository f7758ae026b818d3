"""One value of each method in several cases: dots with intervals, side by side."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from finlab.evaluation.plots.style import COLOURS, GREY, Picture, picture

FLOOR = 1e-8
"""Values below are drawn here on a logarithmic axis: they are rounding."""


def draw_dots(
    rows: Sequence[dict[str, Any]], value: str, case: str, label: str, *, log: bool = False
) -> Picture:
    """Dots by case and method.

    Args:
        rows: with `method`; rows without the value are left out.
        value: key of what is drawn; its interval is under `<value>_interval`, if there is one.
        case: key of what stands along the axis.
        label: of the other axis, with the unit.
        log: whether that axis is logarithmic.
    """
    rows = [row for row in rows if row.get(value) is not None]
    cases = list(dict.fromkeys(str(row[case]) for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    floor = FLOOR if log else -np.inf
    with picture(height=3.2, grid="y") as view:
        (axis,) = view.axes
        for k, method in enumerate(methods):
            mine = [row for row in rows if row["method"] == method]
            middle = np.maximum([row[value] for row in mine], floor)
            ends = np.array([row.get(f"{value}_interval") or (row[value], row[value]) for row in mine])
            low, high = np.maximum(ends.T, floor)
            place = [
                cases.index(str(row[case])) + (k - (len(methods) - 1) / 2) * 0.7 / len(methods)
                for row in mine
            ]
            reach = np.maximum([middle - low, high - middle], 0.0)
            look: dict[str, Any] = {"color": COLOURS.get(method, GREY), "markersize": 4.5, "elinewidth": 1.2}
            axis.errorbar(place, middle, reach, fmt="o", label=method, **look)
        axis.set_xticks(range(len(cases)), cases)
        axis.set(ylabel=label, yscale="log" if log else "linear")
    return view
