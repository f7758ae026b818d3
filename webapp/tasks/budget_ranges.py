"""Ranges of the axes of a wrench where a power budget holds, too: what actuators can push is only
given as far as they may take the power for it."""

from functools import lru_cache

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.forces.reach import Ranges
from finlab.layout import Layout
from webapp.session.state import State

HALVINGS = 12
"""Steps by which an end of a range is bracketed: to a share of 1/4096 of it, finer than a mark."""


def ranges_within_budget(question: State, ranges: Ranges) -> Ranges:
    """Returns how far each component of a state's target can go with the others as they are,
    within the power budget of its layout.

    Args:
        question: the robot, its damage and the target.
        ranges: the same without a budget.

    Returns:
        The ranges, too short by a share of 1/4096 at most; NaN where no value of a component is
        within reach.

    Raises:
        FinlabError: the budget cannot be kept for such a robot.
    """
    low = np.full(len(AXES), np.nan)
    high = np.full(len(AXES), np.nan)
    for axis in range(len(AXES)):
        if not np.isfinite(ranges.low[axis]):
            continue
        begin = _value_within(question, axis)
        if begin is not None:
            low[axis] = _end(question, axis, begin, float(ranges.low[axis]))
            high[axis] = _end(question, axis, begin, float(ranges.high[axis]))
    return Ranges(low, high)


@lru_cache(maxsize=8)
def _allocator(layout: Layout) -> Allocator:
    return Allocator(layout)


def _value_within(question: State, axis: int) -> float | None:
    """A value of a component at which the wrench is within reach; None where there is none."""
    value = question.target[axis]
    if _is_within(question, axis, value):
        return value
    allocator = _allocator(question.layout)
    # With the axis free, the cheapest answer gives it the value that takes the least power.
    free = () if not question.layout.commanded[axis] else (AXES[axis],)
    answer = allocator.allocate(question.target, lost=question.lost, free=free, flow=question.flow)
    return float(answer.wrench[axis]) if answer.reachable else None


def _end(question: State, axis: int, begin: float, end: float) -> float:
    """The farthest value of a component from one that is within reach towards another one."""
    inside = begin
    outside = end
    if _is_within(question, axis, end):
        return end
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if _is_within(question, axis, middle):
            inside = middle
        else:
            outside = middle
    return inside


def _is_within(question: State, axis: int, value: float) -> bool:
    """Whether the target is within reach with another value of a component."""
    target: Array = np.array(question.target)
    target[axis] = value
    answer = _allocator(question.layout).allocate(target, lost=question.lost, flow=question.flow)
    return bool(answer.reachable)
