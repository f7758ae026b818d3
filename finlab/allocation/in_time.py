"""Actuators follow late: which of the wrenches that are expected a command given now will be in time for."""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.vehicle.actuator_motion import following_delay


def in_time(layout: Layout, target: Array, reference: Array, period_s: float) -> Array:
    """The wrench (6,) of the moment at which the slowest actuator will have followed; a command that is held
    for a period is late by half of it besides.

    Args:
        layout: the robot.
        target: the wrench (6,) of now.
        reference: those of the next K ticks (K, 6); after the last, the last.
        period_s: time between ticks [s].
    """
    late = following_delay(layout) / period_s + 0.5
    before = min(int(late), len(reference))
    after = min(before + 1, len(reference))
    expected = np.concatenate([target[None], reference])
    result: Array = expected[before] + (late - int(late)) * (expected[after] - expected[before])
    return result
