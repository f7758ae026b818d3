"""One call of `allocate`: over the unit, over a solve in C, and what else is asked of an answer."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from finlab import Allocator
from finlab.arrays import Array
from finlab.research.evaluation.document import Row
from tools.speed_groups.questions import (
    allocator_of,
    as_questions,
    core_side,
    rim_targets,
    unit_side,
    walk,
)
from tools.speed_groups.timing import Goal, Side, Sizes, least_times, ratio_row, tail_row

UNIT = "the unit"
"""What column "over" says of it."""
CORE = "a solve in C"
"""What column "over" says of a solve of the core without anything around it."""
GOALS_OVER_UNIT = {
    "bluerov2_heavy": (Goal(3), Goal(4)),
    "A": (Goal(4), Goal(4)),
    "turtle_hybrid": (Goal(4), Goal(6)),
    "bluerov2": (Goal(4), Goal(5)),
    "catamaran": (Goal(3), Goal(3)),
    "fish": (Goal(4), Goal(5)),
}
"""Robots whose calls are timed; goals of `allocate` over the unit at 0.3 and at 0.97 of reach."""
GOALS_OVER_CORE = dict.fromkeys(("bluerov2_heavy", "A", "turtle_hybrid"), Goal(3))
"""Goals of `allocate` over a solve in C."""
SHARES = (0.3, 0.97)
"""Of reach."""
IN_FLOW = ("torpedo", np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
"""A robot of foils, and its velocity through the water [m/s, rad/s]."""
MOST_IN_FLOW = Goal(4)
"""Of its solve in C over the unit: 15 us where the unit takes 3.7 us."""
MOST_TAIL = Goal(4)
"""Of the 99th percentile over the median, near the rim."""
MOST_TICK_TAIL = Goal(6)
"""The same of ticks."""
LOST = ("bluerov2_heavy", "front_left")
"""A robot, and the actuator that it loses."""
MOST_WITH_LOSS = Goal(1.3)
"""Of an answer with a loss, over one of the whole robot."""
BEYOND = 1.5
"""Of reach, where policies are asked."""
WITHIN = 0.5
"""Of reach, what answers beyond it are compared with."""
GOALS_BEYOND = {
    "bluerov2_heavy": {"closest": Goal(2), "direction": Goal(2), "priority": Goal(8)},
    "A": {"closest": Goal(6), "direction": Goal(6)},
    "turtle_hybrid": {"closest": Goal(6), "direction": Goal(6)},
}
"""Goals of policies beyond reach, over an answer within it, by robot."""
POLICIES = ("closest", "direction", "priority")
"""Of `allocate`, beyond reach."""
GOALS_OF_READING = {"bound": Goal(4), "print": Goal(12)}
"""Of an answer of which something is read, over the answer alone."""
READ_ROBOTS = ("bluerov2_heavy", "A", "fish")
"""Robots whose answers are read."""


def call_rows(sizes: Sizes) -> Iterator[Row]:
    """Returns the rows of the call."""
    for robot in GOALS_OVER_UNIT:
        yield from _rows_within(robot, sizes)
    yield from _rows_in_flow(sizes)
    for robot in GOALS_OVER_UNIT:
        yield from _rows_of_ticks(robot, sizes)
    yield _row_with_loss(sizes)
    for robot in GOALS_BEYOND:
        yield from _rows_beyond(robot, sizes)
    for robot in READ_ROBOTS:
        yield from _rows_of_reading(robot, sizes)


def _rows_within(robot: str, sizes: Sizes) -> Iterator[Row]:
    """Rows of a robot's answers within reach."""
    allocator = allocator_of(robot)
    for share, goal in zip(SHARES, GOALS_OVER_UNIT[robot], strict=True):
        targets = rim_targets(allocator, share, sizes.questions)
        times = least_times(
            {
                UNIT: unit_side(sizes.questions),
                CORE: core_side(allocator.layout, targets),
                "allocate": Side(allocator.allocate, as_questions(targets)),
            },
            sizes.repeats,
        )
        at_share = f"`allocate` at {share:g} of reach"
        answer = times["allocate"]
        yield ratio_row(at_share, robot, UNIT, answer, times[UNIT], goal)
        yield ratio_row(at_share, robot, CORE, answer, times[CORE], GOALS_OVER_CORE.get(robot))
        yield ratio_row(f"{CORE} at {share:g} of reach", robot, UNIT, times[CORE], times[UNIT])
        if share == SHARES[-1]:
            yield tail_row(at_share, robot, answer, MOST_TAIL)


def _rows_in_flow(sizes: Sizes) -> Iterator[Row]:
    """Rows of foils in a flow."""
    robot, flow = IN_FLOW
    allocator = allocator_of(robot)
    targets = rim_targets(allocator, WITHIN, sizes.questions, flow=flow)
    times = least_times(
        {
            UNIT: unit_side(sizes.questions),
            CORE: core_side(allocator.layout, targets, flow=flow),
            "allocate": Side(partial(allocator.allocate, flow=flow), as_questions(targets)),
        },
        sizes.repeats,
    )
    place = f"at {WITHIN:g} of reach, {flow[0]:g} m/s"
    answer = times["allocate"]
    yield ratio_row(f"`allocate` {place}", robot, UNIT, answer, times[UNIT])
    yield ratio_row(f"`allocate` {place}", robot, CORE, answer, times[CORE])
    yield ratio_row(f"{CORE} {place}", robot, UNIT, times[CORE], times[UNIT], MOST_IN_FLOW)


def _rows_of_ticks(robot: str, sizes: Sizes) -> Iterator[Row]:
    """Rows of a robot whose targets walk, with the command of the tick before."""
    allocator = allocator_of(robot)
    targets = walk(allocator, sizes.questions)
    previous = _previous_commands(allocator, targets)
    ticks = list(zip(targets, previous, strict=True))

    def tick(target: Array, before: Array) -> None:
        allocator.allocate(target, previous=before)

    times = least_times(
        {
            UNIT: unit_side(sizes.questions),
            CORE: core_side(allocator.layout, targets, previous),
            "tick": Side(tick, ticks),
        },
        sizes.repeats,
    )
    measured = "`allocate`, a tick"
    yield ratio_row(measured, robot, UNIT, times["tick"], times[UNIT])
    yield ratio_row(measured, robot, CORE, times["tick"], times[CORE])
    yield tail_row(measured, robot, times["tick"], MOST_TICK_TAIL)


def _previous_commands(allocator: Allocator, targets: Array) -> Array:
    """Commands (N, n, 3) that the answers of a walk (N, 6) begin from: each that of the target
    before."""
    command = allocator.allocate(targets[0]).command
    previous = []
    for target in targets:
        previous.append(command)
        command = allocator.allocate(target, previous=command).command
    return np.array(previous)


def _row_with_loss(sizes: Sizes) -> Row:
    """The row of answers that work without one actuator."""
    robot, name = LOST
    allocator = allocator_of(robot)
    damaged = Allocator(allocator.layout.without([name]))
    questions = as_questions(rim_targets(damaged, WITHIN, sizes.questions))
    with_loss = partial(allocator.allocate, lost=[name])
    times = least_times(
        {"whole": Side(allocator.allocate, questions), "lost": Side(with_loss, questions)},
        sizes.repeats,
    )
    measured = "`allocate` with one actuator lost"
    return ratio_row(
        measured, robot, "the whole robot", times["lost"], times["whole"], MOST_WITH_LOSS
    )


def _rows_beyond(robot: str, sizes: Sizes) -> Iterator[Row]:
    """Rows of a robot beyond its reach, by policies."""
    allocator = allocator_of(robot)
    within = as_questions(rim_targets(allocator, WITHIN, sizes.questions))
    beyond = as_questions(rim_targets(allocator, BEYOND, sizes.questions))
    sides = {"within": Side(allocator.allocate, within)}
    for policy in POLICIES:
        sides[policy] = Side(partial(allocator.allocate, policy=policy), beyond)
    times = least_times(sides, sizes.repeats)
    for policy in POLICIES:
        measured = f"`allocate` at {BEYOND:g} of reach, policy `{policy}`"
        over = f"`allocate` at {WITHIN:g}"
        goal = GOALS_BEYOND[robot].get(policy)
        yield ratio_row(measured, robot, over, times[policy], times["within"], goal)


def _rows_of_reading(robot: str, sizes: Sizes) -> Iterator[Row]:
    """Rows of a robot's answers, of which something is read."""
    allocator = allocator_of(robot)
    questions = as_questions(rim_targets(allocator, WITHIN, sizes.questions))

    def with_bound(target: Array) -> None:
        _ = allocator.allocate(target).bound

    def printed(target: Array) -> None:
        str(allocator.allocate(target))

    times = least_times(
        {
            "allocate": Side(allocator.allocate, questions),
            "bound": Side(with_bound, questions),
            "print": Side(printed, questions),
        },
        sizes.repeats,
    )
    words = {"bound": "`allocate` and its `bound`", "print": "`allocate`, printed"}
    for name, measured in words.items():
        goal = GOALS_OF_READING[name]
        yield ratio_row(measured, robot, "`allocate`", times[name], times["allocate"], goal)
