"""What every method promises of every answer: kinds of robot, damage, policies and ticks in one
table.

The judge is `tests/oracle_plant.py`, a second set of laws, for robots that are whole or have lost
actuators; of others the limits that damage leaves are checked.
"""

import copy
import math
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
import pytest

from finlab.allocation import METHODS, Allocation, Allocator, BatchAllocation
from finlab.allocation.methods import method_class
from finlab.allocation.solution import equal
from finlab.arrays import Array
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
POLICIES = ("closest", "direction", "priority")
"""The kinds of policy."""
REACHES = (0.0, 1.0, 30.0)
"""How large wrenches are, in that of a command within limits: at 1 it can be delivered."""
EXTREMES = (1e-6, 1e4)
"""The same of wrenches that are asked for once."""
ARRAYS = (
    *("target", "command", "scale", "wrench", "forces", "unallocated", "expected_miss"),
    *("flow", "previous", "prices", "err_norm", "power", "expected_error", "bound", "solve_ms"),
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


def damaged(layout: Layout, word: str) -> Damage | None:
    """A robot whose first actuator that can be is damaged so; None where none can."""
    if word == "whole":
        return Damage()
    if word == "lost":
        return Damage(lost=[layout.names[1]])
    for part in layout.actuators:
        if word not in part.KIND.faults:
            continue
        middle = 0.5 * (np.array(part.lower) + np.array(part.upper))
        angle = middle[part.KIND.stuck_number] if part.KIND.stuck_number is not None else middle[0]
        value = {"weak": 0.4, "torn": 0.4, "stuck": float(angle)}
        kept = tuple(float(number) for number in middle[: len(part.KIND.numbers)])
        return Damage(**{word: {part.name: kept if word == "running" else value[word]}})
    return None


SLOW_METHODS = ("ipopt", "paper", "sqp", "paper_sqp", "qp")
"""Methods that take so long that a share of their cases is asked every day."""
ROWS_ALONE = ("mdn", "paper", "ipopt", "sqp", "paper_sqp", "qp")
"""Methods whose rows share starts, time or single precision: many wrenches get answers as good as
each alone, which are not the same numbers."""


def cases_of(method: str) -> list[Any]:
    """The kinds of robot that a method takes, whole and damaged; of the default method whole and
    with a lost actuator each of them every day, of all else a share."""
    always = list[Any]()
    others = list[Any]()
    for kind in KINDS:
        for word in DAMAGE_KINDS:
            if not fits(method, kind) or damaged(robot_of(kind).layout, word) is None:
                continue
            case = pytest.param(method, kind, word, id=f"{method}-{kind.replace(' ', '_')}-{word}")
            often = method == "dual" and word in ("whole", "lost")
            (always if often else others).append(case)
    return [*always, *sampled(others, 7 if method in SLOW_METHODS else 4)]


CASES = [case for method in METHODS for case in cases_of(method)]
"""Method, kind of robot and kind of damage of every case."""


@dataclass(frozen=True)
class Question:
    """What is asked of a robot."""

    about: str
    wrench: Array
    """Wrench (6,) [N, N m]."""
    asked: dict[str, Any]
    """Other arguments of `allocate`."""
    known: Array | None = None
    """A command (n, 3) that gives the wrench; None where none has to."""


def questions(
    method: str, allocator: Allocator, robot: Robot, damage: Damage
) -> Iterator[Question]:
    """What is asked: each policy of the method, within reach and beyond, outside of ticks and in
    one, with all axes and with one that is free."""
    layout = damage.applied_to(allocator.layout)
    plant = plant_of(layout).at(robot.flow)
    lost = [name in damage.lost for name in layout.names]
    rng = np.random.default_rng([SEED, len(method)])

    def drawn() -> Array:
        command = plant.sample(rng, (1,))[0]
        command[lost] = np.nan
        return command

    policies = POLICIES if method_class(method).every_policy else POLICIES[:1]
    for number, policy in enumerate(policies):
        asked: dict[str, Any] = {"policy": policy, "damage": damage}
        for reach in REACHES:
            command = drawn()
            wrench = reach * plant.wrench(command)
            about = f"{policy}, {reach:g} of a command"
            yield Question(about, wrench, asked, command if reach == 1.0 else None)
            yield Question(f"{about}, in a tick", wrench, asked | {"previous": drawn()})
        free = AXES[number : number + 1]
        if set(layout.axes) - set(free):
            yield Question(f"{policy}, {free} free", wrench, asked | {"free": free})
    for size in EXTREMES:
        yield Question(f"{size:g} of a command", size * plant.wrench(drawn()), {"damage": damage})


@pytest.mark.parametrize(("method", "kind", "word"), CASES)
def test_what_every_answer_keeps(method: str, kind: str, word: str) -> None:
    robot = robot_of(kind)
    damage = damaged(robot.layout, word)
    assert damage is not None
    allocator = quick_allocator(method).on(robot.layout)
    first: Allocation | None = None
    for question in questions(method, allocator, robot, damage):
        given = question.wrench.copy()
        answer = allocator.allocate(given, flow=robot.flow, **question.asked)
        try:
            np.testing.assert_array_equal(given, question.wrench)
            check_answer(answer, robot, word)
            check_figures(answer, question.wrench, question.asked.get("free", ()))
            if method == "dual":
                check_default(answer, question, robot, word)
        except AssertionError as error:
            raise AssertionError(f"{question.about}: {error}") from error
        if first is None:
            first = answer
            asked_first = question
    assert first is not None
    check_frozen(first)
    check_frozen(answer)
    check_copies(answer)
    # What was asked in between leaves no trace, and another allocator says the same.
    for other in (allocator, allocator.on(robot.layout)):
        assert other.allocate(asked_first.wrench, flow=robot.flow, **asked_first.asked) == first


@pytest.mark.parametrize(("method", "kind", "word"), CASES)
def test_many_wrenches_get_the_answers_of_each(method: str, kind: str, word: str) -> None:
    robot = robot_of(kind)
    damage = damaged(robot.layout, word)
    assert damage is not None
    allocator = quick_allocator(method).on(robot.layout)
    together: dict[str, list[Array]] = {}
    for question in questions(method, allocator, robot, damage):
        together.setdefault(question.asked.get("policy", POLICIES[0]), []).append(question.wrench)
    for policy, wrenches in together.items():
        asked: dict[str, Any] = {"policy": policy, "damage": damage, "flow": robot.flow}
        given = np.array(wrenches)
        batch = allocator.allocate_batch(given, **asked)
        np.testing.assert_array_equal(given, wrenches)
        assert len(batch) == len(wrenches)
        assert (batch.wrench_expected is not None) == (method == "paper")
        check_frozen(batch)
        for row, wrench in enumerate(wrenches):
            check_row(
                batch, row, allocator.allocate(wrench, **asked), alike=method not in ROWS_ALONE
            )
    assert pickle.loads(pickle.dumps(batch)) == batch


def check_row(batch: BatchAllocation, row: int, answer: Allocation, alike: bool) -> None:
    """An answer of many is what a question of its own gets, and keeps what that keeps."""
    assert batch.reachable[row] == answer.reachable
    if alike or (batch.method == "mdn" and not answer.reachable):
        np.testing.assert_allclose(batch.command[row], answer.command, rtol=1e-9, atol=1e-9)
        for figure in ("wrench", "forces", "unallocated", "err_norm", "power", "expected_error"):
            told = getattr(batch, figure)[row]
            np.testing.assert_allclose(
                told, getattr(answer, figure), rtol=1e-9, atol=1e-9, err_msg=figure
            )
    else:
        works = ~np.isnan(answer.command).any(axis=1)
        command = batch.command[row][works]
        assert (command >= batch.layout.lower[works]).all() and (
            command <= batch.layout.upper[works]
        ).all()
        error = np.linalg.norm((batch.target[row] - batch.wrench[row]) / batch.scale)
        assert batch.err_norm[row] == pytest.approx(error, rel=1e-9, abs=1e-12)
    if batch.bound is not None:
        assert 0.0 <= batch.bound[row] <= batch.power[row]


def check_answer(answer: Allocation, robot: Robot, word: str) -> None:
    """Commands are within limits, those that are lost get none, and their wrench is that of the
    laws."""
    layout = answer.layout
    lost = np.array([name in answer.damage.lost for name in layout.names])
    assert np.isnan(answer.command[lost]).all() and np.isfinite(answer.command[~lost]).all()
    outside = (answer.command < layout.lower) | (answer.command > layout.upper)
    assert not outside.any(), f"commands outside of limits: {answer.command[outside]}"
    for part, is_lost, force in zip(layout.actuators, lost, answer.forces, strict=True):
        command = answer.commands[part.name]
        assert (command is None) == is_lost and (not is_lost or not force.any())
    if word in ("whole", "lost"):
        command = robot.plant.commands_of(answer)
        size = np.abs(answer.forces).sum()
        np.testing.assert_allclose(
            answer.wrench, robot.plant.wrench(command), rtol=1e-9, atol=1e-9 * size
        )
        assert answer.power == pytest.approx(robot.plant.power(command), rel=1e-9, abs=1e-12)
    for place, part in enumerate(layout.actuators):
        if part.type != "thruster":
            continue
        force = answer.command[place, 0]
        if abs(force) < part.dead_band and answer.previous is None:
            assert not answer.forces[place].any() and force == np.clip(
                0.0, part.lower[0], part.upper[0]
            )


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
    assert answer.reachable == (answer.err_norm <= 1e-3)
    assert answer.power >= 0.0 and np.isfinite(answer.power)
    if answer.bound is not None:
        assert 0.0 <= answer.bound <= answer.power, f"bound {answer.bound}, power {answer.power}"


def check_default(answer: Allocation, question: Question, robot: Robot, word: str) -> None:
    """The default method delivers what can be, at no more power than a command that is known to,
    and no command of a tick has changed faster than its drive can, angles the shorter way round."""
    if question.known is not None:
        assert answer.err_norm <= 1e-5
        if word in ("whole", "lost"):
            assert answer.power <= robot.plant.power(question.known) * (1.0 + 1e-6) + 1e-9
    previous = question.asked.get("previous")
    if previous is None:
        return
    period_s = 0.1
    for part, old, new in zip(answer.layout.actuators, previous, answer.command, strict=True):
        if np.isnan(new).any():
            continue
        change = np.abs(new - old)
        turns = np.isclose(np.array(part.upper) - np.array(part.lower), 2.0 * math.pi)
        change[turns] = np.minimum(change, np.abs(2.0 * math.pi - change))[turns]
        most = np.array(part.rates) * period_s
        assert (change <= most * (1.0 + 1e-9) + 1e-9).all(), (
            f"{part.name}: {old} to {new} in {most}"
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
