"""The contract of all methods: what each promises of every answer, for every kind of robot and
damage, policy, tick and free axis.

A new method is tested here as soon as it stands in `METHODS`, a new kind of robot as soon as it
stands in `KINDS` of `tests/random_robots.py`. The judge is `tests/oracle_plant.py`, a second set of
laws, for robots that are whole or have lost actuators; of others the limits that damage leaves are
checked.
"""

import copy
import math
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from itertools import chain
from typing import Any

import numpy as np
import pytest

from finlab.allocation import METHODS, Allocation, Allocator, BatchAllocation
from finlab.allocation.methods import method_class
from finlab.allocation.policy import POLICY_NAMES
from finlab.allocation.solution import equal
from finlab.arrays import ROUNDING, Array
from finlab.axes import AXES
from finlab.layout import Damage, Layout, parse_layout
from finlab.physics.plant import plant_of
from tests.allocation.quick_allocator import quick_allocator
from tests.oracle_plant import OraclePlant
from tests.random_robots import KINDS, random_flow, random_robot, with_dead_bands, with_rates
from tests.sampled_cases import sampled

SEED = 58
"""Of the robots; another one than that of the tests of the default method."""
DAMAGE_KINDS = ("whole", "lost", "weak", "torn", "stuck", "running")
"""What may be wrong with an actuator, as the keywords of `Damage`, and "whole"."""
REACHES = (0.0, 1.0, 30.0)
"""Sizes of the wrenches, as multiples of that of a command within limits: 0 is rest, 1 is within
reach, 30 is beyond."""
EXTREMES = (1e-6, 1e4)
"""The same of wrenches that are asked for by the default policy alone."""
ARRAYS = (
    *("target", "command", "scale", "wrench", "forces", "unallocated", "expected_miss"),
    *(
        "flow",
        "previous",
        "multipliers",
        "err_norm",
        "power",
        "expected_error",
        "bound",
        "solve_ms",
    ),
)
"""What is read-only in an answer, where it is an array."""


@dataclass(frozen=True)
class Robot:
    """A robot of a kind, and what judges its answers."""

    layout: Layout
    plant: OraclePlant
    flow: Array | None


@cache
def robot_of(kind: str) -> Robot:
    """A robot of one of `KINDS`, whose thrusters have dead bands and whose drives have rates."""
    number = 1
    rng = np.random.default_rng([SEED, KINDS.index(kind)])
    mapping = with_dead_bands(with_rates(random_robot(kind, number, SEED)), rng)
    flow = random_flow(kind, number, SEED)
    return Robot(parse_layout(mapping), OraclePlant(mapping, flow), flow)


def fits(method: str, kind: str) -> bool:
    """Whether a method takes robots of a kind."""
    return method_class(method).fits(robot_of(kind).layout)


def damage_of_kind(layout: Layout, damage_kind: str) -> Damage | None:
    """Damage of the first actuator that can have it; None where no actuator can."""
    if damage_kind == "whole":
        return Damage()
    if damage_kind == "lost":
        return Damage(lost=[layout.names[1]])
    for actuator in layout.actuators:
        kind = actuator.KIND
        if damage_kind not in kind.faults:
            continue
        middle = 0.5 * (np.array(actuator.lower) + np.array(actuator.upper))
        command = middle[: len(kind.numbers)].tolist()
        stuck_number = 0 if kind.stuck_number is None else kind.stuck_number
        values: dict[str, Any] = {
            "weak": 0.4,
            "torn": 0.4,
            "stuck": float(middle[stuck_number]),
            "running": tuple(command),
        }
        return Damage(**{damage_kind: {actuator.name: values[damage_kind]}})
    return None


SLOW_METHODS = ("ipopt", "paper", "sqp", "paper_sqp", "qp")
"""Methods that take so long that a share of their cases is asked every day."""
METHODS_WHOSE_ROWS_DIFFER = ("mdn", "paper", "ipopt", "sqp", "paper_sqp", "qp")
"""Methods whose rows share starts, time or single precision: many wrenches get answers as good as
each alone, which are not the same numbers."""


def cases_of(method: str) -> list[Any]:
    """The kinds of robot that a method takes, whole and damaged; of the default method whole and
    with a lost actuator each of them every day, of all else a share."""
    always = list[Any]()
    others = list[Any]()
    for kind in KINDS:
        for damage_kind in DAMAGE_KINDS:
            if not fits(method, kind) or damage_of_kind(robot_of(kind).layout, damage_kind) is None:
                continue
            name = f"{method}-{kind.replace(' ', '_')}-{damage_kind}"
            case = pytest.param(method, kind, damage_kind, id=name)
            if method == "dual" and damage_kind in ("whole", "lost"):
                always.append(case)
            else:
                others.append(case)
    return [*always, *sampled(others, 11 if method in SLOW_METHODS else 6)]


CASES = list(chain.from_iterable(map(cases_of, METHODS)))
"""Method, kind of robot and kind of damage of every case."""


@dataclass(frozen=True)
class Question:
    """One call of `allocate`."""

    description: str
    """What a failure says of it."""
    wrench: Array
    """Wrench (6,) [N, N m]."""
    arguments: dict[str, Any]
    """Other arguments of `allocate`."""
    delivering: Array | None = None
    """A command (n, 3) that gives the wrench; None where none is known."""


def questions(
    method: str, allocator: Allocator, robot: Robot, damage: Damage
) -> Iterator[Question]:
    """Questions by each policy of the method: within reach and beyond, outside of ticks and in one,
    with all axes and with one that is free."""
    layout = damage.applied_to(allocator.layout)
    plant = plant_of(layout).at(robot.flow)
    lost = [name in damage.lost for name in layout.names]
    rng = np.random.default_rng([SEED, len(method)])

    def random_command() -> Array:
        """A command (n, 3) within the limits, NaN of lost actuators."""
        command = plant.sample(rng, (1,))[0]
        command[lost] = np.nan
        return command

    policies = POLICY_NAMES if "policy" in method_class(method).reads else POLICY_NAMES[:1]
    for number, policy in enumerate(policies):
        arguments: dict[str, Any] = {"policy": policy, "damage": damage}
        for reach in REACHES:
            command = random_command()
            wrench = reach * plant.wrench(command)
            description = f"{policy}, {reach:g} of a command"
            yield Question(description, wrench, arguments, command if reach == 1.0 else None)
            in_tick = arguments | {"previous": random_command()}
            yield Question(f"{description}, in a tick", wrench, in_tick)
        free = AXES[number : number + 1]
        if set(layout.axes) - set(free):
            yield Question(f"{policy}, {free} free", wrench, arguments | {"free": free})
    for size in EXTREMES:
        wrench = size * plant.wrench(random_command())
        yield Question(f"{size:g} of a command", wrench, {"damage": damage})


@pytest.mark.parametrize(("method", "kind", "damage_kind"), CASES)
def test_what_every_answer_keeps(method: str, kind: str, damage_kind: str) -> None:
    robot = robot_of(kind)
    damage = damage_of_kind(robot.layout, damage_kind)
    assert damage is not None
    allocator = quick_allocator(method).on(robot.layout)
    first: Allocation | None = None
    for question in questions(method, allocator, robot, damage):
        target = question.wrench.copy()
        answer = allocator.allocate(target, flow=robot.flow, **question.arguments)
        try:
            np.testing.assert_array_equal(target, question.wrench)  # not written to
            check_answer(answer, robot, damage_kind)
            check_figures(answer, question.wrench, question.arguments.get("free", ()))
            if method == "dual":
                check_default(answer, question, robot, damage_kind)
        except AssertionError as error:
            raise AssertionError(f"{question.description}: {error}") from error
        if first is None:
            first = answer
            first_question = question
    assert first is not None
    check_frozen(first)
    check_frozen(answer)
    check_copies(answer)
    # What was asked in between leaves no trace, and another allocator says the same.
    for other in (allocator, allocator.on(robot.layout)):
        assert (
            other.allocate(first_question.wrench, flow=robot.flow, **first_question.arguments)
            == first
        )


@pytest.mark.parametrize(("method", "kind", "damage_kind"), CASES)
def test_many_wrenches_get_the_answers_of_each(method: str, kind: str, damage_kind: str) -> None:
    robot = robot_of(kind)
    damage = damage_of_kind(robot.layout, damage_kind)
    assert damage is not None
    allocator = quick_allocator(method).on(robot.layout)
    wrenches_of_policy: dict[str, list[Array]] = {}
    for question in questions(method, allocator, robot, damage):
        policy = question.arguments.get("policy", POLICY_NAMES[0])
        wrenches_of_policy.setdefault(policy, []).append(question.wrench)
    for policy, wrenches in wrenches_of_policy.items():
        arguments: dict[str, Any] = {"policy": policy, "damage": damage, "flow": robot.flow}
        targets = np.array(wrenches)
        batch = allocator.allocate_batch(targets, **arguments)
        np.testing.assert_array_equal(targets, wrenches)  # not written to
        assert len(batch) == len(wrenches)
        assert (batch.wrench_expected is not None) == (method == "paper")
        check_frozen(batch)
        for row, wrench in enumerate(wrenches):
            answer = allocator.allocate(wrench, **arguments)
            check_row(batch, row, answer, is_same=method not in METHODS_WHOSE_ROWS_DIFFER)
    assert pickle.loads(pickle.dumps(batch)) == batch


def check_row(batch: BatchAllocation, row: int, answer: Allocation, is_same: bool) -> None:
    """An answer of many is what a question of its own gets, and keeps what that keeps."""
    assert batch.reachable[row] == answer.reachable
    if is_same or (batch.method == "mdn" and not answer.reachable):
        np.testing.assert_allclose(batch.command[row], answer.command, rtol=1e-9, atol=1e-9)
        for figure in ("wrench", "forces", "unallocated", "err_norm", "power", "expected_error"):
            of_row = getattr(batch, figure)[row]
            of_answer = getattr(answer, figure)
            np.testing.assert_allclose(of_row, of_answer, rtol=1e-9, atol=1e-9, err_msg=figure)
    else:
        works = ~np.isnan(answer.command).any(axis=1)
        command = batch.command[row][works]
        assert (command >= batch.layout.lower[works]).all()
        assert (command <= batch.layout.upper[works]).all()
        error = np.linalg.norm((batch.target[row] - batch.wrench[row]) / batch.scale)
        assert batch.err_norm[row] == pytest.approx(error, rel=1e-9, abs=1e-12)
    if batch.bound is not None:
        assert 0.0 <= batch.bound[row] <= batch.power[row]


def check_answer(answer: Allocation, robot: Robot, damage_kind: str) -> None:
    """Commands are within limits, lost actuators get none, and the wrench is that of the laws."""
    layout = answer.layout
    lost = np.array([name in answer.damage.lost for name in layout.names])
    assert np.isnan(answer.command[lost]).all()
    assert np.isfinite(answer.command[~lost]).all()
    outside = (answer.command < layout.lower) | (answer.command > layout.upper)
    assert not outside.any(), f"commands outside of limits: {answer.command[outside]}"
    for actuator, is_lost, force in zip(layout.actuators, lost, answer.forces, strict=True):
        assert (answer.commands[actuator.name] is None) == is_lost
        if is_lost:
            assert not force.any()
    if damage_kind in ("whole", "lost"):
        command = robot.plant.commands_of(answer)
        size = np.abs(answer.forces).sum()
        rounding = ROUNDING * np.nanmax(np.abs(command))  # of thrusts that only balance a drag
        np.testing.assert_allclose(
            answer.wrench, robot.plant.wrench(command), rtol=1e-9, atol=1e-9 * size + rounding
        )
        assert answer.power == pytest.approx(robot.plant.power(command), rel=1e-9, abs=1e-12)
    for i, actuator in enumerate(layout.actuators):
        if actuator.type != "thruster":
            continue
        force = answer.command[i, 0]
        if abs(force) < actuator.dead_band and answer.previous is None:
            # Within its dead band a thruster gives nothing, and is asked for nothing.
            assert not answer.forces[i].any()
            assert force == np.clip(0.0, actuator.lower[0], actuator.upper[0])


def check_figures(answer: Allocation, wrench: Array, free: tuple[str, ...]) -> None:
    """What is missing, the error, the verdict and the bound are what the wrench and the target
    say."""
    counts = np.array([axis in answer.layout.axes and axis not in free for axis in AXES])
    np.testing.assert_array_equal(answer.target, np.where(counts, wrench, np.nan))
    missing = np.where(counts, wrench - answer.wrench, 0.0)
    np.testing.assert_allclose(
        answer.unallocated, missing, rtol=0.0, atol=1e-12 * np.abs(wrench).max()
    )
    error = np.linalg.norm(missing / answer.scale)
    assert answer.err_norm == pytest.approx(error, rel=1e-9, abs=1e-12)
    assert answer.reachable == (answer.err_norm <= 1e-3)  # what `Allocation.reachable` promises
    assert np.isfinite(answer.power)
    assert answer.power >= 0.0
    if answer.bound is not None:
        assert 0.0 <= answer.bound <= answer.power, f"bound {answer.bound}, power {answer.power}"


def check_default(answer: Allocation, question: Question, robot: Robot, damage_kind: str) -> None:
    """The default method delivers what can be, at no more power than a command that is known to,
    and no command of a tick has changed faster than its drive can, angles the shorter way round."""
    if question.delivering is not None:
        assert answer.err_norm <= 1e-5
        if damage_kind in ("whole", "lost"):
            assert answer.power <= robot.plant.power(question.delivering) * (1.0 + 1e-6) + 1e-9
    previous = question.arguments.get("previous")
    if previous is None:
        return
    period_s = 0.1  # `USUAL_PERIOD_S`, which no question here changes
    for part, old, new in zip(answer.layout.actuators, previous, answer.command, strict=True):
        if np.isnan(new).any():
            continue
        change = np.abs(new - old)
        turns = np.isclose(np.array(part.upper) - np.array(part.lower), 2.0 * math.pi)
        change[turns] = np.minimum(change, np.abs(2.0 * math.pi - change))[turns]
        max_change = np.array(part.rates) * period_s
        assert (change <= max_change * (1.0 + 1e-9) + 1e-9).all(), (
            f"{part.name}: {old} to {new}, more than {max_change}"
        )


def check_frozen(answer: Allocation | BatchAllocation) -> None:
    """Nothing can be written to."""
    for name in ARRAYS:
        value = getattr(answer, name, None)
        if isinstance(value, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                value[...] = 0.0


def check_copies(answer: Allocation) -> None:
    """Copies are equal, field by field, and as frozen."""
    for twin in (pickle.loads(pickle.dumps(answer)), copy.copy(answer), copy.deepcopy(answer)):
        assert twin == answer and repr(twin) == repr(answer) and len(repr(twin)) <= 400
        for field in fields(answer):
            if field.compare:
                assert equal(getattr(twin, field.name), getattr(answer, field.name)), field.name
        check_frozen(twin)
