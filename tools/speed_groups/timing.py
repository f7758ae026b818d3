"""Processor time of calls that take turns, and the rows that are made of it."""

import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.research.evaluation.document import Row

CLOCK_READINGS = 2000
"""Readings of the clock whose least is what one of them takes."""


class Side(NamedTuple):
    """One of the things that are compared: a function, and what it is asked."""

    call: Callable[..., Any]
    """Is called once for each question."""
    questions: Sequence[tuple[Any, ...]]
    """Arguments of each call."""


class Sizes(NamedTuple):
    """How much is measured."""

    questions: int = 200
    """Targets of each robot; ticks of a walk."""
    repeats: int = 9
    """Times that each question is asked."""
    batch: int = 5000
    """Targets of a batch."""
    swim_s: float = 30.0
    """Duration of a swim [s]."""
    steps: int = 60
    """Steps of a training that are timed."""
    drags: int = 2
    """Drags of a slider."""


class Goal(NamedTuple):
    """What a figure is to be."""

    value: float
    """The bound."""
    is_least: bool = False
    """Whether the figure is to be at least the bound; at most by default."""

    def __str__(self) -> str:
        sign = "≥" if self.is_least else "≤"
        return f"{sign} {self.value:g}"

    def is_met(self, figure: float) -> bool:
        """Returns whether a figure is within the bound."""
        return figure >= self.value if self.is_least else figure <= self.value


def least_times(sides: Mapping[str, Side], repeats: int) -> dict[str, Array]:
    """Measures several sides in turns, so that all meet the same machine.

    Args:
        sides: what is compared, by name.
        repeats: how many times each question is asked. In each repeat one side after the other
            goes through all of its questions.

    Returns:
        Processor time of this thread [ns] for each question of a side, the least of the repeats,
        without what reading the clock takes.
    """
    clock = time.thread_time_ns
    least = {name: np.full(len(side.questions), np.inf) for name, side in sides.items()}
    for _ in range(repeats):
        for name, (call, questions) in sides.items():
            times = least[name]
            for i, question in enumerate(questions):
                start = clock()
                call(*question)
                took = clock() - start
                if took < times[i]:
                    times[i] = took
    return {name: np.maximum(times - clock_ns(), 1.0) for name, times in least.items()}


@cache
def clock_ns() -> int:
    """Returns what one reading of the clock takes [ns]."""
    clock = time.thread_time_ns
    least = clock()
    for _ in range(CLOCK_READINGS):
        start = clock()
        least = min(least, clock() - start)
    return least


def ratio_row(
    measured: str,
    robot: str,
    over: str,
    times: Array,
    reference_times: Array,
    goal: Goal | None = None,
) -> Row:
    """Returns the row of one side over another.

    Args:
        measured: what the first side is.
        robot: the robot's name.
        over: what the second side is.
        times: of the first side's questions.
        reference_times: of the second side's questions.
        goal: of the ratio of the medians.
    """
    reference = float(np.median(reference_times))
    p50 = float(np.median(times)) / reference
    p99 = float(np.quantile(times, 0.99)) / reference
    return figure_row(measured, robot, over, p50, goal) | {"p99": p99}


def tail_row(measured: str, robot: str, times: Array, goal: Goal) -> Row:
    """Returns the row of the 99th percentile of a side's questions over their median.

    Args:
        measured: what the side is.
        robot: the robot's name.
        times: of its questions.
        goal: of the ratio.
    """
    ratio = float(np.quantile(times, 0.99) / np.median(times))
    return figure_row(f"{measured}, 99th percentile", robot, "its median", ratio, goal)


def figure_row(
    measured: str, robot: str, over: str, figure: float, goal: Goal | None = None
) -> Row:
    """Returns the row of a single figure.

    Args:
        measured: what is measured.
        robot: the robot's name.
        over: what it is divided by.
        figure: the ratio.
        goal: of the ratio.
    """
    row: Row = {"measured": measured, "robot": robot, "over": over, "figure": figure}
    if goal is not None:
        row["goal"] = str(goal)
        row["met"] = "yes" if goal.is_met(figure) else "no"
    return row


def left_out_row(measured: str, robot: str, over: str, package: str) -> Row:
    """Returns the row of what cannot be measured, since a package is not installed.

    Args:
        measured: what would be measured.
        robot: the robot's name.
        over: what it would be divided by.
        package: the one that is missing.
    """
    return {
        "measured": measured,
        "robot": robot,
        "over": over,
        "met": f"left out: {package} is not installed",
    }
