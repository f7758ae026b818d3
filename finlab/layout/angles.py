"""Angles: the one way to wrap them, and the one arc that counts as a full turn."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array

TURN = 2.0 * math.pi
"""A full turn [rad]."""
FULL_TURN_TOLERANCE = 1e-6
"""By how much [rad] an arc may fall short of a full turn and still be one."""
FILE_TURN_TOLERANCE = 1e-3
"""By how much [rad] zero directions in a file, which are rounded, may miss a full turn or exceed it."""


def is_full_turn(arc: Any) -> Any:
    """Says whether arcs [rad] cover the circle, for a number, an array or a tensor."""
    return arc >= TURN - FULL_TURN_TOLERANCE


def wrapped(angle: ArrayLike) -> Array:
    """Returns the same angles within [-pi, pi) [rad]."""
    return np.asarray(np.mod(np.asarray(angle) + math.pi, TURN) - math.pi)


def command_change(command: ArrayLike) -> Array:
    """Changes from each command to the next, without their sign: (T, n, 3) to (T - 1, n, 3).

    Amplitude [rad], frequency [Hz], and the zero direction the short way round [rad]; NaN stays NaN.
    """
    change = np.abs(np.diff(np.asarray(command), axis=0))
    change[..., 2] = np.abs(wrapped(change[..., 2]))
    return change
