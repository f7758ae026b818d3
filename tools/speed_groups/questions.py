"""Targets at shares of a robot's reach, walks of targets, and the two sides that all others are
compared with: one line of numpy, and a solve of the core in C without anything around it."""

import ctypes
from functools import cache
from typing import Any

import numpy as np

from finlab import Allocator, load_layout
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.policy import CLOSEST
from finlab.arrays import Array
from finlab.core import library
from finlab.core.calls import NOMINAL, ROWS, AnswerMemory, Conditions, QuestionRecord, prepared_work
from finlab.layout import Layout
from finlab.physics import plant_of
from tools.speed_groups.timing import Side

FAR = 50.0
"""How many times drawn wrenches lie beyond the reach of every robot."""
WALK_CENTER = 0.5
"""Where a walk begins, as a share of reach."""
WALK_SIZE = 0.2
"""How far a walk goes along an axis, as a share of the wrench scale."""
UNIT_ROBOT = "bluerov2_heavy"
"""The robot whose pseudo-inverse is the unit: six axes, eight thrusters."""


@cache
def allocator_of(robot: str) -> Allocator:
    """Returns the allocator of a shipped layout, by method `dual`."""
    return Allocator(load_layout(robot))


def rim_targets(
    allocator: Allocator, share: float, count: int, seed: int = 2, flow: Array | None = None
) -> Array:
    """Returns wrenches (N, 6) [N, N m] in drawn directions, in the axes that the robot commands.

    Args:
        allocator: of the robot.
        share: their size over the most that the robot gives in their direction.
        count: how many, N.
        seed: of the draws.
        flow: velocity (6,) of the body through the water [m/s, rad/s]; None at rest.
    """
    drawn = np.random.default_rng(seed).normal(size=(count, 6))
    commanded = allocator.layout.commanded
    direction = drawn * allocator.scale * commanded
    rim = allocator.allocate_batch(FAR * direction, flow=flow, policy="direction").wrench
    return np.asarray(share * rim * commanded)


def walk(allocator: Allocator, count: int, seed: int = 5) -> Array:
    """Returns a random walk of wrenches (N, 6) [N, N m] that begins half way to the robot's rim.

    Args:
        allocator: of the robot.
        count: how many, N.
        seed: of the draws.
    """
    steps = np.random.default_rng(seed).normal(size=(count, 6))
    path = np.cumsum(steps, axis=0)
    share = WALK_SIZE * path / np.abs(path).max()
    begin = rim_targets(allocator, WALK_CENTER, 1)[0]
    return np.asarray(begin + share * allocator.scale * allocator.layout.commanded)


def as_questions(targets: Array) -> list[tuple[Array]]:
    """Returns targets (N, 6) as N lists of arguments."""
    return [(target,) for target in targets]


def unit_side(count: int) -> Side:
    """Returns the unit: the pseudo-inverse's forces for a wrench, clipped at the limits. It is that
    of the same robot for whatever it is compared with.

    Args:
        count: how many targets, within reach.
    """
    allocator = allocator_of(UNIT_ROBOT)
    B = thruster_effectiveness(allocator.layout)
    low = allocator.layout.lower[:, 0]
    high = allocator.layout.upper[:, 0]
    pinv = np.linalg.pinv(B)

    def clipped(w: Array) -> Array:
        # u = clip(B^+ w)
        return np.clip(pinv @ w, low, high)

    return Side(clipped, as_questions(rim_targets(allocator, 0.5, count)))


def thruster_effectiveness(layout: Layout) -> Array:
    """Returns the effectiveness matrix B (6, n) of a robot of thrusters: wrench [N, N m] per newton
    of each."""
    return np.asarray(plant_of(layout).effectiveness[:, 0].T)


def core_side(
    layout: Layout, targets: Array, previous: Array | None = None, flow: Array | None = None
) -> Side:
    """Returns solves of the core in C: what `allocate` asks of it, through ctypes, with questions
    that are written before and addresses that are known.

    Args:
        layout: the robot.
        targets: (N, 6) [N, N m].
        previous: commands (N, n, 3) of the ticks before; None outside of ticks.
        flow: velocity (6,) of the body through the water [m/s, rad/s]; None at rest.
    """
    compiled = Compiled.of(layout).at(plant_of(layout).inflow(flow))
    work = prepared_work(compiled.block)
    memory = AnswerMemory(layout.n)
    policy = core_policy(CLOSEST)
    block_address = compiled.block.ctypes.data
    work_address = ctypes.addressof(work)
    questions = list[tuple[Any, ...]]()
    records = list[QuestionRecord]()
    for i, target in enumerate(targets):
        record = QuestionRecord(layout.n)
        record.write_wrench(target)
        conditions = NOMINAL if previous is None else Conditions(previous=previous[i])
        record.write(policy, None, conditions)
        records.append(record)
        row = memory.address_of(i % ROWS)
        questions.append((block_address, work_address, record.address, -1.0, row))
    solve = library().fl_answer_into_row

    def call(*addresses: Any, keep: Any = (compiled, work, memory, records)) -> int:
        # What the addresses point at lives as long as this function.
        return int(solve(*addresses))

    return Side(call, questions)
