"""How long an arrow is per newton: a ladder of round scales, and the rung that fits what is shown."""

from webapp.session.display import NEWTONS

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
