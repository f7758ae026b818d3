"""A picture of the timeline of a judgement, by matplotlib (extra `plot`); `finlab log --plot`.

The app draws the same timeline as SVG (`webapp/panels/log_tab.py`), in its theme, and with a line
at the moment that is on the robot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from finlab.axes import MOTIONS, UNITS
from finlab.display.figures import COLORS, panels
from finlab.log.judgement import Judgement

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def timeline_picture(judgement: Judgement) -> Figure:
    """Returns a figure of the demanded and the delivered wrench over time, along each axis that was
    demanded, and of the actuators at limits."""
    timeline = judgement.timeline
    time = timeline.time
    names = judgement.robot.names
    shown = judgement.demanded_axes or (0,)
    figure, rows = panels((9.0, 1.6 * len(shown) + 2.2), len(shown) + 1, sharex=True)
    *wrench_axes, limit_axes = rows[:, 0]
    for k, axes in zip(shown, wrench_axes, strict=True):
        demand = timeline.demand[:, k]
        delivered = timeline.given[:, k]
        axes.step(time, demand, where="post", color="0.55", label="asked for")
        axes.step(time, delivered, where="post", color=COLORS[0], label="given")
        axes.fill_between(
            time,
            demand,
            delivered,
            where=np.abs(timeline.missing[:, k]) > 0.0,
            step="post",
            color=COLORS[1],
            alpha=0.5,
            lw=0,
            label="missing",
        )
        axes.set_ylabel(f"{MOTIONS[k]} [{UNITS[k]}]")
    wrench_axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    edges = np.append(time, time[-1] + judgement.seconds / len(time))
    limit_axes.pcolormesh(
        edges, np.arange(len(names) + 1), timeline.limits.T, cmap="Oranges", vmin=0.0, vmax=1.0
    )
    limit_axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize="x-small")
    limit_axes.set(ylabel="at a limit", xlabel="time of the log [s]")
    figure.suptitle(judgement.source)
    return figure
