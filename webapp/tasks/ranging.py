"""How far each component of the target can go with the others as they are: a mark on its slider."""

from dataclasses import dataclass

from finlab.forces.axis_ranges import Ranges, axis_ranges
from finlab.layout import Layout

REST_S = 0.12
"""How long the target may not change before the marks are worked out again [s]."""


@dataclass(frozen=True)
class Beside:
    """A robot and what is asked of it."""

    layout: Layout
    """The robot."""
    failed: tuple[str, ...]
    """Names of failed fins."""
    target: tuple[float, float, float, float, float, float]
    """Wrench [N, N m]."""


def find_ranges(question: Beside) -> Ranges:
    """The range of each component."""
    return axis_ranges(question.layout, question.target, question.failed)
