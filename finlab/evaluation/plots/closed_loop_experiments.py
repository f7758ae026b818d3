"""Closed-loop experiments: paths by layout, errors by fault, power against the error of speed."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.experiments.closed_loop_runs import Row, Run
from finlab.evaluation.experiments.faults import ALLOWED, HEALTHY
from finlab.evaluation.plots.style import BLACK, COLOURS, GREY, Picture, picture
from finlab.sim import RunLog

Track = tuple[tuple[str, str], Array]
"""Names of a robot and of its method, and when it swam where: time [s], position and reference [m] (K, 7)."""


def track_of(log: RunLog) -> Array:
    """Time, position and reference of every tick (K, 7)."""
    return np.column_stack([log.time, log.position, log.reference])


def draw_layouts(tracks: Sequence[Track], rows: Sequence[Row]) -> Picture:
    """Every track from above and its depth over time, one column per layout.

    Args:
        tracks: of all layouts and methods.
        rows: of the trajectory table, for the titles: the error of the first method.
    """
    layouts = list(dict.fromkeys(layout for (layout, _), _ in tracks))
    with picture(2, len(layouts), height=4.6, sharex="row", sharey="row") as view:
        for above, depth, layout in zip(view.axes, view.axes[len(layouts) :], layouts, strict=False):
            mine = [(method, track.T) for (name, method), track in tracks if name == layout]
            time, *_, x, y, z = mine[0][1]
            above.plot(x, y, color=GREY, lw=3.0, alpha=0.6, label="reference")
            depth.plot(time, z, color=GREY, lw=3.0, alpha=0.6)
            for method, (time, x, y, z, *_) in mine:
                style: dict[str, Any] = {"color": COLOURS.get(method, GREY), "lw": 1.0, "alpha": 0.8}
                above.plot(x, y, label=method, **style)
                depth.plot(time, z, **style)
            ate = next(row["ate"] for row in rows if row["layout"] == layout)
            above.set(title=f"{layout}: ATE {100 * ate:.1f} cm", xlabel="x [m]")
            above.set_aspect("equal", adjustable="box")
            depth.set(xlabel="time [s]")
        view.axes[0].set_ylabel("y [m]")
        view.axes[len(layouts)].set_ylabel("z [m]")
        return view


def draw_faults(rows: Sequence[Row], printed: Mapping[str, float] | None = None) -> Picture:
    """ATE of every fault and method, mean and spread over runs; dashed: what one lost fin may cost.

    Args:
        rows: of the table of faults.
        printed: the paper's errors by its cases [m], drawn below as diamonds.
    """
    swum, printed = [row for row in rows if row["controllable"]], printed or {}
    faults = list(dict.fromkeys(row["fault"] for row in swum))
    methods = list(dict.fromkeys(row["method"] for row in swum))
    names = [*faults, *printed]
    with picture(height=0.9 + 0.28 * len(names)) as view:
        (axis,) = view.axes
        for k, method in enumerate(methods):
            colour = COLOURS.get(method, GREY)
            own = [row for row in swum if row["method"] == method]
            place = [faults.index(row["fault"]) + 0.16 * (k - 0.5 * (len(methods) - 1)) for row in own]
            values, spreads = [row["ate"] for row in own], [row["ate_std"] for row in own]
            axis.errorbar(values, place, xerr=spreads, fmt="o", color=colour, ms=6, lw=1.4, label=method)
            for row in own:
                if row["fault"] == HEALTHY:
                    axis.axvline(ALLOWED * row["ate"], color=colour, lw=1.0, ls=(0, (4, 3)))
        below = np.arange(len(faults), len(names))
        axis.plot(list(printed.values()), below, "D", color=BLACK, markerfacecolor="none", markersize=6)
        axis.set_yticks(range(len(names)), names)
        axis.set_ylim(len(names) - 0.5, -0.5)
        axis.set(xlabel=f"ATE [m]; dashed: {ALLOWED} times that of the healthy robot", xlim=(0.0, None))
        return view


def draw_velocity(runs: Sequence[Run]) -> Picture:
    """Speed over time of every run, under (speed, method's name), and power against its error."""
    methods = list(dict.fromkeys(method for (_, method), _ in runs))
    speeds = dict.fromkeys(speed for (speed, _), _ in runs)
    with picture(1, 2, height=3.4, legend=len(methods), width_ratios=(1.5, 1)) as view:
        over_time, trade = view.axes
        for (_, method), log in runs:
            over_time.plot(log.time, log.motion[:, 0], color=COLOURS.get(method, GREY), lw=0.7, alpha=0.7)
            over_time.plot(log.time, log.reference_surge, color=GREY, lw=1.2, ls=(0, (4, 3)))
        for method in methods:
            for speed, marker in zip(speeds, "os^Dv", strict=False):
                logs = [log for key, log in runs if key == (speed, method)]
                error = [np.abs(log.motion[:, 0] - log.reference_surge).mean() for log in logs]
                power = [log.inertial_power.sum(axis=1).mean() for log in logs]
                style: dict[str, Any] = {"color": COLOURS.get(method, GREY), "ms": 5, "alpha": 0.8}
                if method == methods[0]:  # a ring around those that do the same
                    style |= {"ms": 9, "markerfacecolor": "none", "alpha": 1.0}
                trade.plot(error, power, marker, label=f"{method}, {speed:.2f} m/s", **style)
        over_time.set(xlabel="time [s]", ylabel="surge speed [m/s]", title="Speed, reference dashed")
        trade.set(
            xlabel="MAE of the speed [m/s]", ylabel="inertial power [W]", title="Left and low is better"
        )
        trade.set(xlim=(0.0, None), ylim=(0.0, None))
        trade.locator_params(axis="x", nbins=5)
        return view
