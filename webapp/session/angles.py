"""Angles that come round."""

import math


def wrapped(angle: float) -> float:
    """The angle [rad] within (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2 * math.pi)
