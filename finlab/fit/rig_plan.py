"""A plan of measurements for a rig: which commands, in which order, for how long."""

import csv
import io
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.measurements import MIN_SAMPLES
from finlab.layout.fin import Limits

REPEATED = 0.1
"""Share of the commands that are measured again at the end, for the noise and the drift."""
CYCLES = 8
"""Cycles averaged at each command ..."""
LEAST_TIME = 3.0
"""... and the least time for it [s]."""
SETTLE = 3
"""Cycles before those, in which the water finds its rhythm."""
CALM = 5.0
"""Time at rest [s] between two zero directions: the sensor's zero, while the water calms down."""
DIRECTIONS = 12
"""Zero directions among which a rig turns; the fin keeps one until all its commands are done."""


class RigPlan(NamedTuple):
    """Commands in the order in which a rig should run them."""

    command: Array
    """Half amplitude [rad], frequency [Hz], zero direction [rad], (n, 3)."""
    seconds: Array
    """How long each one is run, the start-up counted (n,) [s]."""
    repeats: int
    """How many of the last ones repeat earlier ones."""

    @property
    def duration(self) -> float:
        """Expected duration, the pauses counted [s]."""
        turns = 1 + int((np.diff(self.command[:, 2]) != 0.0).sum())
        return float(self.seconds.sum() + CALM * turns)

    def csv(self) -> str:
        """The plan as a CSV file that `finlab fit fin` reads once its forces are filled in."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["A", "f", "phi", "seconds", "Fx", "Fy", "Fz"])
        for command, seconds in zip(self.command, self.seconds, strict=True):
            writer.writerow([*(f"{value:.4f}" for value in command), f"{seconds:.1f}", "", "", ""])
        return text.getvalue()


def plan_measurements(limits: Limits, samples: int = 300, turn: bool = True, seed: int = 0) -> RigPlan:
    """Returns commands that fill the limits evenly, sorted so that the rig turns and waits little.

    Args:
        limits: what the fin may be commanded.
        samples: how many commands, repeats counted.
        turn: whether the rig can turn the fin; if not, the zero direction stays in the middle of its arc.
        seed: scrambles the commands.

    Raises:
        DataError: fewer than 20 samples.
    """
    if samples < MIN_SAMPLES:
        raise DataError(
            f"{samples} samples are too few to tell a fin; expected at least {MIN_SAMPLES}, 300 are "
            "a good number"
        )
    repeats = round(REPEATED * samples)
    drawn = qmc.Sobol(3, rng=np.random.default_rng(seed)).random(1 << (samples - repeats - 1).bit_length())
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    lower[:2] = np.maximum(lower[:2], 0.05 * upper[:2])  # what hardly moves is hardly felt
    command = lower + drawn[: samples - repeats] * (upper - lower)
    if turn:
        step = (upper[2] - lower[2]) / DIRECTIONS
        command[:, 2] = lower[2] + step * (np.floor((command[:, 2] - lower[2]) / step) + 0.5)
    else:
        command[:, 2] = 0.5 * (lower[2] + upper[2])
    # Within one zero direction from gentle to hard strokes: the water is calm again soonest.
    command = command[np.lexsort((command[:, 0] * command[:, 1], command[:, 2]))]
    again = command[np.linspace(0, len(command) - 1, repeats).astype(int)]
    command = np.concatenate([command, again])
    seconds = np.maximum(CYCLES / command[:, 1], LEAST_TIME) + SETTLE / command[:, 1]
    return RigPlan(command, seconds, repeats)
