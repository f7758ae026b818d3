"""How long an arrow is per newton: a ladder of round scales, and the rung that fits what is shown."""

NEWTONS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Forces [N] that an arrow of 0.1 m may stand for."""
LENGTH = 0.1
"""Length that the legend speaks of [m]."""
LONGEST, SHORTEST = 0.42, 0.14
"""The longest arrow stays within these [m]; between them the scale is left alone, so it seldom jumps."""


def fitting_newtons(largest: float, current: float) -> float:
    """Force per 0.1 m [N] for arrows up to `largest` [N]; `current` while that is good enough."""
    length = LENGTH * largest / current
    if largest < 1e-6 or SHORTEST <= length <= LONGEST:
        return current
    return next((step for step in NEWTONS if LENGTH * largest / step <= LONGEST), NEWTONS[-1])
