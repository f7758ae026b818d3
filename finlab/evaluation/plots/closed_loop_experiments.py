"""Figures of the closed-loop experiments: paths by layout, errors by fault, power against error of speed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finlab.evaluation.experiments.closed_loop_runs import Row
from finlab.evaluation.experiments.faults import ALLOWED, HEALTHY
from finlab.evaluation.plots.closed_loop_run import save
from finlab.evaluation.plots.style import COLOURS, GREY, ORANGE, VERMILION, clean, picture
from finlab.evaluation.statistics.trajectory_errors import absolute_error
from finlab.sim import RunLog

METHOD_COLOURS = {**COLOURS, "on-board": ORANGE, "learned-power": VERMILION}
"""Method -> colour."""

Run = tuple[Any, RunLog]


def save_layouts_figure(runs: Sequence[Run], path: Path) -> None:
    """The path of every run from above and its depth over time, one column per layout."""
    layouts = list(dict.fromkeys(layout for (layout, _), _ in runs))
    with picture(2, len(layouts), height=4.6, sharex="row", sharey="row") as drawn:
        for column, layout in enumerate(layouts):
            above, depth = drawn.axes[column], drawn.axes[len(layouts) + column]
            logs = [(method, log) for (name, method), log in runs if name == layout]
            reference, time = logs[0][1].reference, logs[0][1].time
            above.plot(reference[:, 0], reference[:, 1], color=GREY, lw=3.0, label="reference")
            depth.plot(time, reference[:, 2], color=GREY, lw=3.0)
            for method, log in logs:
                style: dict[str, Any] = {"color": METHOD_COLOURS.get(method, ORANGE), "lw": 0.9, "alpha": 0.8}
                above.plot(log.position[:, 0], log.position[:, 1], label=method, **style)
                depth.plot(log.time, log.position[:, 2], **style)
            ate = np.mean([absolute_error(log.position, log.reference) for _, log in logs])
            above.set(title=f"Layout {layout}: ATE {100 * ate:.1f} cm", xlabel="x [m]")
            above.set_aspect("equal", adjustable="box")
            depth.set(xlabel="time [s]")
            for axis in (above, depth):
                clean(axis)
        drawn.axes[0].set_ylabel("y [m]")
        drawn.axes[len(layouts)].set_ylabel("z [m]")
        drawn.legend()
        save(drawn, path)


def save_faults_figure(rows: Sequence[Row], path: Path) -> None:
    """ATE of every fault and method, mean and spread over runs; dashed: 1.15 times the healthy one."""
    swum = [row for row in rows if row["controllable"]]
    faults = list(dict.fromkeys(row["fault"] for row in swum))
    methods = list(dict.fromkeys(row["method"] for row in swum))
    with picture(1, 1, height=0.9 + 0.3 * len(faults)) as drawn:
        (axis,) = drawn.axes
        for k, method in enumerate(methods):
            colour = METHOD_COLOURS.get(method, GREY)
            own = [row for row in swum if row["method"] == method]
            place = [faults.index(row["fault"]) + 0.16 * (k - 0.5 * (len(methods) - 1)) for row in own]
            values, spreads = [row["ate"] for row in own], [row["ate_std"] for row in own]
            axis.errorbar(values, place, xerr=spreads, fmt="o", color=colour, ms=6, lw=1.4, label=method)
            healthy = [row["ate"] for row in own if row["fault"] == HEALTHY]
            if healthy:
                axis.axvline(ALLOWED * healthy[0], color=colour, lw=1.0, ls=(0, (4, 3)))
        axis.set_yticks(range(len(faults)), [fault.replace("_", " ") for fault in faults])
        axis.set_ylim(len(faults) - 0.5, -0.5)
        axis.set_xlim(left=0.0)
        axis.set_xlabel(f"ATE [m]; dashed: {ALLOWED} times that of the healthy robot")
        clean(axis)
        drawn.legend()
        save(drawn, path)


def save_velocity_figure(runs: Sequence[Run], path: Path) -> None:
    """Speed over time of every run, and power against the error of the speed."""
    methods = list(dict.fromkeys(method for (method, _), _ in runs))
    with picture(1, 2, height=3.4, gridspec_kw={"width_ratios": [1.5, 1]}) as drawn:
        over_time, trade = drawn.axes
        for (method, _), log in runs:
            colour = METHOD_COLOURS.get(method, GREY)
            over_time.plot(log.time, log.motion[:, 0], color=colour, lw=0.7, alpha=0.7)
            over_time.plot(log.time, log.reference_surge, color=GREY, lw=1.2, ls=(0, (4, 3)))
        markers = {speed: marker for speed, marker in zip(_speeds(runs), "os^Dv", strict=False)}
        for method in methods:
            for speed, marker in markers.items():
                logs = [log for key, log in runs if key == (method, speed)]
                error = [np.abs(log.motion[:, 0] - log.reference_surge).mean() for log in logs]
                power = [log.inertial_power.sum(axis=1).mean() for log in logs]
                trade.plot(
                    error,
                    power,
                    marker,
                    color=METHOD_COLOURS.get(method, GREY),
                    ms=5,
                    alpha=0.8,
                    label=f"{method}, {speed:.2f} m/s",
                )
        over_time.set(xlabel="time [s]", ylabel="surge speed [m/s]", title="Speed, reference dashed")
        trade.set(
            xlabel="MAE of the speed [m/s]", ylabel="inertial power [W]", title="Left and low is better"
        )
        trade.set_xlim(left=0.0)
        trade.set_ylim(bottom=0.0)
        for axis in drawn.axes:
            clean(axis)
        drawn.legend(ncols=len(methods))
        save(drawn, path)


def _speeds(runs: Sequence[Run]) -> list[float]:
    return list(dict.fromkeys(speed for (_, speed), _ in runs))
