"""Fins follow late: which of the wrenches that are expected a command given now will be in time for."""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout


def in_time(layout: Layout, target: Array, reference: Array, period_s: float) -> Array:
    """The wrench (6,) of the moment at which the slowest fin will have followed.

    A filter with a double pole p is 2 / p late, and a command that is held for a period half of that.

    Args:
        layout: the fins.
        target: the wrench (6,) of now.
        reference: those of the next K ticks (K, 6); after the last, the last.
        period_s: time between ticks [s].
    """
    late = 2.0 / float(layout.servo_poles.min()) / period_s + 0.5
    before = min(int(late), len(reference))
    after = min(before + 1, len(reference))
    expected = np.concatenate([target[None], reference])
    result: Array = expected[before] + (late - int(late)) * (expected[after] - expected[before])
    return result
