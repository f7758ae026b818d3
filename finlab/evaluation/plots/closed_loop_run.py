"""Pictures of one swim: path, errors, commands, wrench asked against delivered."""

from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    SOFT,
    VERMILION,
    YELLOW,
    Picture,
    picture,
)
from finlab.layout.angles import wrapped
from finlab.sim import RunLog
from finlab.vehicle.attitude import euler

FIN_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, YELLOW)
"""Colour of each fin, in the layout's order."""


def save_pictures(log: RunLog, folder: Path) -> list[Path]:
    """Writes path.png, errors.png, commands.png and wrench.png into a folder; returns their paths."""
    drawers = {"path": draw_path, "errors": draw_errors, "commands": draw_commands, "wrench": draw_wrench}
    return [draw(log).save(folder / f"{name}.png") for name, draw in drawers.items()]


def failures(log: RunLog) -> list[tuple[float, str]]:
    """When which fin stopped: (time [s], name), in order."""
    alive = log.alive
    stopped = [(0.0, i) for i in np.flatnonzero(~alive[0])]
    stopped += [(float(log.time[k + 1]), i) for k, i in np.argwhere(alive[:-1] & ~alive[1:])]
    return [(time, log.fins[i]) for time, i in stopped]


def draw_path(log: RunLog) -> Picture:
    """The path from above and from the side, with the reference."""
    with picture(1, 2, height=4.2) as drawn:
        above, side = drawn.axes
        for axis, second, label in ((above, 1, "y [m]"), (side, 2, "z [m]")):
            axis.plot(*log.reference[:, [0, second]].T, color=GREY, lw=2.4, label="reference")
            axis.plot(*log.position[:, [0, second]].T, color=BLUE, lw=1.4, label="robot")
            axis.plot(*log.position[0, [0, second]], "o", color=BLUE, ms=5, label="start")
            for time, name in failures(log):
                at = log.position[int(np.searchsorted(log.time, time))]
                axis.plot(*at[[0, second]], "X", color=VERMILION, ms=8, label=f"{name} lost at {time:.0f} s")
            axis.set(xlabel="x [m]", ylabel=label)
        above.set_aspect("equal", adjustable="datalim")
        above.set_title("From above")
        side.set_title("From the side")
        low, high = side.get_ylim()
        middle = 0.5 * (low + high)
        side.set_ylim(min(low, middle - 0.3), max(high, middle + 0.3))
        return drawn


def draw_errors(log: RunLog) -> Picture:
    """Distance to the reference, its parts, and the attitude over time."""
    error = log.position - log.reference
    with picture(2, 1, height=4.4, sharex=True) as drawn:
        top, bottom = drawn.axes
        top.plot(log.time, np.linalg.norm(error, axis=1), color=BLACK, label="distance")
        top.plot(log.time, np.linalg.norm(error[:, :2], axis=1), color=BLUE, lw=1.2, label="horizontal")
        top.plot(log.time, error[:, 2], color=ORANGE, lw=1.2, label="depth, up positive")
        top.set(ylabel="error [m]", title="Error")
        angles = np.degrees(euler(log.quaternion))
        bottom.plot(log.time, angles[:, 0], color=GREEN, lw=1.2, label="roll")
        bottom.plot(log.time, angles[:, 1], color=PURPLE, lw=1.2, label="pitch")
        bottom.set(ylabel="angle [deg]", xlabel="time [s]", title="Roll and pitch")
        _finish(drawn, log)
        return drawn


def draw_commands(log: RunLog) -> Picture:
    """Amplitude, frequency and zero direction of each fin: thin as commanded, thick what the servo did."""
    labels = ("amplitude [deg]", "frequency [Hz]", "zero direction [deg]")
    scale = np.array([180 / np.pi, 1.0, 180 / np.pi])
    with picture(3, 1, height=6.2, sharex=True) as drawn:
        for k, (axis, label) in enumerate(zip(drawn.axes, labels, strict=True)):
            for i, name in enumerate(log.fins):
                colour = FIN_COLOURS[i % len(FIN_COLOURS)]
                asked, did = log.command[:, i, k], log.fin_motion[:, i, k]
                if k == 2:
                    asked, did = _broken(asked), _broken(did)
                did = np.where(log.alive[:, i], did, np.nan)
                axis.plot(log.time, asked * scale[k], color=colour, lw=0.9, alpha=0.55)
                axis.plot(log.time, did * scale[k], color=colour, lw=1.7, label=name)
            axis.set_ylabel(label)
        drawn.axes[0].set_title("Thin: command. Thick: the fin, behind its servo.")
        drawn.axes[2].set(ylim=(-185, 185), yticks=[-180, -90, 0, 90, 180], xlabel="time [s]")
        _finish(drawn, log)
        return drawn


def draw_wrench(log: RunLog) -> Picture:
    """Six axes: asked by the controller, and delivered by the fins."""
    with picture(3, 2, height=6.2, sharex=True) as drawn:
        for k, name in enumerate(("Fx [N]", "Fy [N]", "Fz [N]", "Tx [N m]", "Ty [N m]", "Tz [N m]")):
            axis = drawn.axes[2 * (k % 3) + k // 3]
            axis.plot(log.time, log.asked[:, k], color=BLUE, lw=1.8, label="asked")
            axis.plot(log.time, log.delivered[:, k], color=GREEN, lw=1.1, label="delivered")
            axis.set_ylabel(name)
            half = 0.1 if k < 3 else 0.05
            low, high = axis.get_ylim()
            axis.set_ylim(min(low, -half), max(high, half))
        for axis in drawn.axes[-2:]:
            axis.set_xlabel("time [s]")
        _finish(drawn, log)
        return drawn


def _finish(drawn: Picture, log: RunLog) -> None:
    """The whole run in time, with a mark where a fin is lost on the way."""
    for axis in drawn.axes:
        axis.set_xlim(0.0, float(log.time[-1]))
        for time, name in failures(log):
            if time > 0.0:
                axis.axvline(time, color=SOFT, lw=1.0, ls=(0, (4, 3)), label=f"{name} lost")


def _broken(angle: Array) -> Array:
    """Angles wrapped to [-pi, pi) with a gap where they pass the seam, so that no line crosses the plot."""
    shown = wrapped(angle)
    jump = np.abs(np.diff(shown, prepend=shown[:1])) > np.pi
    return np.where(jump, np.nan, shown)
