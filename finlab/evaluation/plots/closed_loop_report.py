"""Closed loop: the paths on the paper's four layouts, and errors beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from finlab.evaluation.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, clean, picture

METHODS = {"learned": BLUE, "learned-power": SKY, "on-board": ORANGE, "analytic": GREEN}
"""Method -> colour."""


def paths(columns: Mapping[str, NDArray[Any]], rows: Sequence[dict[str, Any]]) -> str:
    """One run on each layout from above; `columns` holds `path <layout> <method>`, (K, 3) [m]."""
    layouts = list(dict.fromkeys(name.split()[1] for name in columns if name.startswith("path ")))
    error = {(row["layout"], row["method"]): row["ate"] for row in rows}
    with picture(1, len(layouts), height=3.1, sharey=True) as view:
        for axis, layout in zip(view.axes, layouts, strict=True):
            reference = columns[f"path {layout} reference"]
            axis.plot(reference[:, 0], reference[:, 1], color=GREY, linewidth=4, alpha=0.5, label="reference")
            for method, colour in METHODS.items():
                position = columns.get(f"path {layout} {method}")
                if position is not None:
                    axis.plot(position[:, 0], position[:, 1], color=colour, linewidth=1.3, label=method)
            axis.set_title(f"{layout}: ATE {100 * error[layout, 'learned']:.1f} cm")
            axis.set_aspect("equal", adjustable="box")
            axis.set_xlabel("x [m]")
            clean(axis)
        view.axes[0].set_ylabel("y [m]")
        view.legend()
        return view.svg("paths")


def fault_dots(rows: Sequence[dict[str, Any]], printed: Mapping[str, float]) -> str:
    """Absolute trajectory error for each fault; `printed`: the paper's for its three cases, in words."""
    swum = [row for row in rows if row["controllable"]]
    names = list(dict.fromkeys(row["fault"] for row in swum))
    with picture(height=0.9 + 0.24 * (len(names) + len(printed))) as view:
        (axis,) = view.axes
        for method, colour in METHODS.items():
            mine = [row for row in swum if row["method"] == method]
            place = [names.index(row["fault"]) for row in mine]
            spread = [row["ate_std"] for row in mine]
            style: dict[str, Any] = {"color": colour, "markersize": 6, "elinewidth": 1.3}
            if mine:
                axis.errorbar(
                    [row["ate"] for row in mine], place, xerr=spread, fmt="o", label=method, **style
                )
        below = [len(names) + k for k in range(len(printed))]
        axis.plot(list(printed.values()), below, "D", color=BLACK, markerfacecolor="none", markersize=6)
        axis.set_yticks(range(len(names) + len(printed)), [*names, *printed])
        axis.set(xlabel="ATE [m]", xlim=(0, None))
        axis.invert_yaxis()
        clean(axis)
        view.legend()
        return view.svg("faults")
