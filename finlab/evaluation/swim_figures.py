"""Figures of the closed-loop experiments: paths by layout, faults, power against error of the speed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finlab.evaluation.faults import HEALTHY
from finlab.evaluation.report.pictures.style import COLOURS, GREY, ORANGE, VERMILION, clean, picture
from finlab.evaluation.swim_pictures import failures, save
from finlab.evaluation.trajectory_errors import absolute_error
from finlab.sim import SwimLog

METHOD_COLOURS = {**COLOURS, "on-board": ORANGE, "learned-power": VERMILION}
"""Method -> colour."""
MAX_COLUMNS = 4

Run = tuple[Any, SwimLog]


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


def save_faults_figure(runs: Sequence[Run], path: Path) -> None:
    """The path of every fault from above; where a fin was lost on the way, the place is marked."""
    faults = list(dict.fromkeys(fault for (fault, _), _ in runs))
    columns = min(MAX_COLUMNS, len(faults))
    rows = -(-len(faults) // columns)
    with picture(rows, columns, height=2.5 * rows + 0.4, sharex=True, sharey=True) as drawn:
        for axis in drawn.axes[len(faults) :]:
            axis.set_axis_off()
        for axis, fault in zip(drawn.axes, faults, strict=False):
            logs = [(method, log) for (name, method), log in runs if name == fault]
            reference = logs[0][1].reference
            axis.plot(reference[:, 0], reference[:, 1], color=GREY, lw=3.0, label="reference")
            for method, log in logs:
                style: dict[str, Any] = {"color": METHOD_COLOURS.get(method, ORANGE), "lw": 0.9, "alpha": 0.8}
                axis.plot(log.position[:, 0], log.position[:, 1], label=method, **style)
            for time, _ in failures(logs[0][1]):
                if time > 0.0:
                    at = logs[0][1].position[int(np.searchsorted(logs[0][1].time, time))]
                    axis.plot(at[0], at[1], "X", color=VERMILION, ms=7, label="fin lost here")
            axis.set_title(_title(fault), fontsize=8.5)
            axis.set_aspect("equal", adjustable="box")
            clean(axis)
        for k, axis in enumerate(drawn.axes):
            if k % columns == 0:
                axis.set_ylabel("y [m]")
            if k + columns >= len(faults):
                axis.set_xlabel("x [m]")
                axis.xaxis.set_tick_params(labelbottom=True)
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


def _title(fault: str) -> str:
    """A fault in two short lines."""
    if fault == HEALTHY:
        return fault
    fins, _, when = fault.partition(" lost")
    return f"without {fins}{when}".replace("_", " ").replace(" + ", ",\n")
