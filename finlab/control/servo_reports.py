"""What servos report of their fins, as evidence for what has become of each."""

import numpy as np

from finlab.arrays import Array
from finlab.layout.angles import TURN

AMPLITUDE_RAD = 0.08
"""How far the amplitude of a fin that follows may be off its model, standard deviation [rad]."""
DIRECTION_RAD = 0.3
"""The same of its zero direction [rad]."""
MOST = 6.0
"""Most that one report says against a belief (negative logarithm), so that no single one decides."""


def report_evidence(reported: Array, expected: Array, other: Array, kinds: int) -> Array:
    """Logarithm (n, kinds + 1) of how well a report fits each belief about each fin.

    Args:
        reported: amplitude, frequency, zero direction (n, 3) [rad, Hz, rad]; NaN where a servo is silent.
        expected: the same of fins that follow their commands.
        other: zero directions (n,) of the last belief [rad]; NaN where it is that the fin follows.
        kinds: how many beliefs there are about a fin; the first is that it is lost, the last that its
            direction is the other one.

    Returns:
        (n, kinds), 0 for what fits as well as that the fin is as it is taken to be, and follows.
    """
    still = _far(reported[:, 0], 0.0, AMPLITUDE_RAD)
    beats = _far(reported[:, 0], expected[:, 0], AMPLITUDE_RAD)
    points = _turned(reported[:, 2], expected[:, 2])
    follows = np.minimum(beats + points, MOST)
    result = np.zeros((len(reported), kinds))
    # The servo of a lost fin may still turn, its blade gone.
    result[:, 0] = follows - np.minimum(still, follows)
    aside = np.where(np.isnan(other), points, _turned(reported[:, 2], other))
    result[:, -1] = follows - np.minimum(beats + aside, MOST)
    result[np.isnan(result)] = 0.0
    return result


def _far(value: Array, aim: Array | float, std: float) -> Array:
    return 0.5 * np.square((value - aim) / std)


def _turned(value: Array, aim: Array) -> Array:
    off = value - aim
    return _far(off - TURN * np.round(off / TURN), 0.0, DIRECTION_RAD)
