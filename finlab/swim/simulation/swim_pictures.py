"""Pictures of swims: paths from above and depth over time, beside their references.

For `finlab simulate --plot` and the experiment `trajectory`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from finlab.arrays import Array
from finlab.display.figures import COLORS, panels
from finlab.swim.simulation.log import RunLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = ("-", "--", ":", "-.")
"""Of the lines of one color, which the first word of a name has."""


def swim_picture(log: RunLog) -> Figure:
    """The path of one swim from above and its depth over time, with the reference and each loss."""
    figure = paths_picture(
        {log.layout: (log.time, log.reference, {log.method: (log.time, log.position)})}
    )
    above = figure.axes[0]
    for name, works in zip(log.names, log.alive.T, strict=True):
        if not works.all():
            x, y = log.position[int((~works).argmax()), :2]
            above.plot(x, y, "kx", markersize=8)
            above.annotate(f"{name} lost", (x, y), textcoords="offset points", xytext=(6, 6))
    figure.suptitle(f"{log.layout} along {log.task}, controller {log.controller}")
    return figure


def paths_picture(
    swims: Mapping[str, tuple[Array, Array, Mapping[str, tuple[Array, Array]]]],
) -> Figure:
    """Paths from above, and heights over time below them, in one column for each robot.

    Args:
        swims: robot to times (N,) [s] and positions (N, 3) [m] of its reference, and the same of
            each swim by its name; names that begin with one word have one color.
    """
    figure, axes = panels((max(4.2 * len(swims), 6.0), 7.0), 2, len(swims), height_ratios=(3, 1))
    names = [name for _, _, paths in swims.values() for name in paths]
    first_words = list(dict.fromkeys(name.partition(",")[0] for name in names))
    for (above, below), (robot, (time, reference, paths)) in zip(
        axes.T, swims.items(), strict=True
    ):
        above.plot(*reference[:, :2].T, color="0.6", linewidth=3.0, label="reference")
        below.plot(time, reference[:, 2], color="0.6", linewidth=3.0)
        for name in paths:
            color = first_words.index(name.partition(",")[0])
            same_color = [other for other in paths if other.partition(",")[0] == first_words[color]]
            style = {
                "color": COLORS[color % len(COLORS)],
                "ls": STYLES[same_color.index(name) % len(STYLES)],
            }
            times, position = paths[name]
            above.plot(*position[:, :2].T, linewidth=1.2, label=name, **style)
            below.plot(times, position[:, 2], linewidth=1.2, **style)
        above.set(title=robot, xlabel="x [m]", ylabel="y [m]")
        above.axis("equal")
        above.legend(
            fontsize="small",
            loc="upper center",
            bbox_to_anchor=(0.5, -0.12),
            ncols=2,
            frameon=False,
        )
        below.set(xlabel="time [s]", ylabel="z [m]")
    return figure
