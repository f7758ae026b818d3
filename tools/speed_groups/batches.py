"""Batches: what a target costs among many, and what two threads gain."""

import time
from collections.abc import Iterator

import numpy as np

from finlab import Allocator
from finlab.arrays import Array
from finlab.research.evaluation.document import Row
from tools.speed_groups.questions import allocator_of, as_questions, rim_targets, unit_side
from tools.speed_groups.timing import Goal, Side, Sizes, figure_row, least_times

SHARE = 0.5
"""Of reach."""
DIRECTIONS = 100
"""Different targets of a batch."""
GOALS = {"bluerov2_heavy": Goal(0.2), "A": Goal(0.4), "fish": Goal(0.5), "bluerov2": Goal(0.5)}
"""Robots, and goals of a target over the unit."""
THREADED = ("bluerov2_heavy", "A")
"""Robots whose batches two threads answer."""
MOST_OF_TWO_THREADS = Goal(0.56)
"""Time of two threads over that of one: 1.8 times as quick."""
BATCHES_OF_THREADS = 10
"""How many times larger the batch is that threads share, so that starting them counts for
little."""


def batch_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of batches."""
    for robot, goal in GOALS.items():
        yield from _rows_of(robot, goal, sizes)
    for robot in THREADED:
        yield _row_of_threads(robot, sizes)


def _rows_of(robot: str, goal: Goal, sizes: Sizes) -> Iterator[Row]:
    """Rows of a robot's batch."""
    allocator = allocator_of(robot)
    batch = _batch(allocator, sizes.batch)
    singles = batch[: min(DIRECTIONS, sizes.batch)]
    times = least_times(
        {
            "unit": unit_side(len(singles)),
            "single": Side(allocator.allocate, as_questions(singles)),
            "batch": Side(allocator.allocate_batch, [(batch,)]),
        },
        sizes.repeats,
    )
    of_target = times["batch"][0] / len(batch)
    measured = f"a target in a batch of {sizes.batch:,}"
    unit = float(np.median(times["unit"]))
    single = float(np.median(times["single"]))
    yield figure_row(measured, robot, "the unit", of_target / unit, goal)
    yield figure_row(measured, robot, "`allocate`", of_target / single)


def _batch(allocator: Allocator, count: int) -> Array:
    """Targets (N, 6) at the share of reach, `DIRECTIONS` different ones in turn."""
    targets = rim_targets(allocator, SHARE, DIRECTIONS)
    times = -(-count // DIRECTIONS)
    return np.tile(targets, (times, 1))[:count]


def _row_of_threads(robot: str, sizes: Sizes) -> Row:
    """The row of a batch in two threads over the same in one, on the wall."""
    allocator = allocator_of(robot)
    batch = _batch(allocator, BATCHES_OF_THREADS * sizes.batch)
    least_s = {1: np.inf, 2: np.inf}
    for _ in range(sizes.repeats):
        for threads, before_s in least_s.items():
            start_s = time.perf_counter()
            allocator.allocate_batch(batch, threads=threads)
            least_s[threads] = min(before_s, time.perf_counter() - start_s)
    measured = f"a batch of {len(batch):,} in two threads, time on the wall"
    return figure_row(measured, robot, "one thread", least_s[2] / least_s[1], MOST_OF_TWO_THREADS)
