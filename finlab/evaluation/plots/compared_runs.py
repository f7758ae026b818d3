"""Swims side by side: their paths, how far off they were, and what it took."""

from collections.abc import Mapping

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.plots.style import BLUE, GREY, ORANGE, PURPLE, Picture, picture
from finlab.sim import RunLog

RUN_COLOURS = (BLUE, ORANGE, PURPLE)
"""Of the swims, in their order."""
SMOOTH_S = 1.0
"""Over which power is averaged [s]; within the beat and from tick to tick it jumps."""


def draw_compared(logs: Mapping[str, RunLog]) -> Picture:
    """Paths from above, distance to the reference and driving power of up to three swims by their names.

    Raises:
        DataError: there is none, or there are more.
    """
    if not 1 <= len(logs) <= len(RUN_COLOURS):
        raise DataError(f"compared swims: expected one to {len(RUN_COLOURS)}, got {len(logs)}")
    with picture(1, 3, height=3.6) as drawn:
        above, off, power = drawn.axes
        first = next(iter(logs.values()))
        above.plot(*first.reference[:, :2].T, color=GREY, lw=2.4, label="reference")
        for (name, log), colour in zip(logs.items(), RUN_COLOURS, strict=False):
            above.plot(*log.position[:, :2].T, color=colour, lw=1.4, label=name)
            off.plot(log.time, distance_cm(log), color=colour, lw=1.4, label=name)
            power.plot(log.time, smooth_power(log), color=colour, lw=1.2, label=name)
        above.set_aspect("equal", adjustable="datalim")
        above.set(xlabel="x [m]", ylabel="y [m]", title="From above")
        off.set(xlabel="time [s]", ylabel="[cm]", title="Off the path", ylim=(0.0, None))
        power.set(xlabel="time [s]", ylabel="[W]", title="Power, mean of 1 s", ylim=(0.0, None))
        return drawn


def distance_cm(log: RunLog) -> Array:
    """Distance from where the robot should be (N,) [cm]; what the task does not say does not count."""
    off: Array = 100.0 * np.linalg.norm(np.nan_to_num(log.position - log.reference), axis=1)
    return off


def smooth_power(log: RunLog) -> Array:
    """Driving power of all fins with motor losses (N,) [W], mean over `SMOOTH_S` around each row."""
    power = log.driving_power.sum(axis=1)
    ones = np.ones(min(len(power), round(SMOOTH_S / float(log.time[1] - log.time[0]))))
    smooth: Array = np.convolve(power, ones, "same") / np.convolve(np.ones(len(power)), ones, "same")
    return smooth
