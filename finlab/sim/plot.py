"""Pictures of swims' paths, drawn by matplotlib (extra `plot`), which is imported when one is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from finlab.arrays import Array
from finlab.sim.log import RunLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, which most people can tell apart."""
STYLES = ("-", "--", ":", "-.")
"""Of the lines of one color, which the first word of a name has."""


def swim_picture(log: RunLog) -> Figure:
    """The path of one swim from above and its depth over time, with the reference and each loss."""
    figure = paths_picture({log.layout: (log.time, log.reference, {log.method: (log.time, log.position)})})
    above = figure.axes[0]
    for name, works in zip(log.names, log.alive.T, strict=True):
        if not works.all():
            x, y = log.position[int((~works).argmax()), :2]
            above.plot(x, y, "kx", markersize=8)
            above.annotate(f"{name} lost", (x, y), textcoords="offset points", xytext=(6, 6))
    figure.suptitle(f"{log.layout} along {log.task}, controller {log.controller}")
    return figure


def paths_picture(swims: Mapping[str, tuple[Array, Array, Mapping[str, tuple[Array, Array]]]]) -> Figure:
    """Paths from above, and heights over time below them, in one column for each robot.

    Args:
        swims: robot to times (N,) [s] and positions (N, 3) [m] of its reference, and the same of each swim by
            its name; names that begin with one word have one color.
    """
    from matplotlib.figure import Figure

    size: dict[str, Any] = {"figsize": (max(4.2 * len(swims), 6.0), 7.0), "layout": "constrained"}
    figure = Figure(**size)
    axes: Any = figure.subplots(2, len(swims), squeeze=False, height_ratios=(3, 1))
    names = [name for _, _, paths in swims.values() for name in paths]
    firsts = list(dict.fromkeys(name.partition(",")[0] for name in names))
    for (above, below), (robot, (time, reference, paths)) in zip(axes.T, swims.items(), strict=True):
        above.plot(*reference[:, :2].T, color="0.6", linewidth=3.0, label="reference")
        below.plot(time, reference[:, 2], color="0.6", linewidth=3.0)
        shown: Sequence[str] = list(paths)
        for name in shown:
            color = firsts.index(name.partition(",")[0])
            kin = [other for other in shown if other.partition(",")[0] == firsts[color]]
            look = {"color": COLORS[color % len(COLORS)], "ls": STYLES[kin.index(name) % len(STYLES)]}
            times, swum = paths[name]
            above.plot(*swum[:, :2].T, linewidth=1.2, label=name, **look)
            below.plot(times, swum[:, 2], linewidth=1.2, **look)
        above.set(title=robot, xlabel="x [m]", ylabel="y [m]")
        above.axis("equal")
        above.legend(
            fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, frameon=False
        )
        below.set(xlabel="time [s]", ylabel="z [m]")
        for each in (above, below):
            each.grid(alpha=0.3)
    return figure
