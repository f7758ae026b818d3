"""Answers where jets meet, by outer iterations: where they begin anew, and how far they go along a
ray."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.allocation import Allocator
from finlab.allocation.dual.compiled import core_policy
from finlab.allocation.dual.outer_iterations import (
    JET_ROTATION,
    RANDOM_STARTS,
    WALSH,
    start_factors,
)
from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import ROUNDS, Array
from finlab.core.calls import NOMINAL
from finlab.core.coupled_core import CoupledCore
from finlab.interaction.jets import Jets
from finlab.layout import Layout, load_layout
from finlab.layout.load import parse_layout
from finlab.physics import Plant
from finlab.research.random_layouts import random_azimuth, random_jet_robot, random_thruster
from tests.random_robots import bluerov2_heavy

MOST_STEPS = 540.0
"""Steps of the iterations of all questions: what they took when this was written, and a tenth
more."""


def test_other_starts_rotate_planes_and_change_sizes() -> None:
    lines = np.array([False, True, False, False, True, False])
    factors = start_factors(lines)
    patterns = len(WALSH) + 1
    assert factors.shape == (patterns + RANDOM_STARTS, 6, 2)

    rotation = factors[..., 0] + 1j * factors[..., 1]
    # By the patterns each plane turns by the same angle, one way or the other, and keeps its size.
    np.testing.assert_allclose(np.abs(rotation[:patterns, ~lines]), 1.0, rtol=1e-12)
    np.testing.assert_allclose(
        np.abs(np.angle(rotation[:patterns, ~lines])), JET_ROTATION, rtol=1e-12
    )
    signs = np.sign(np.angle(rotation[:patterns, ~lines]))
    np.testing.assert_allclose(
        signs[:8].T @ signs[:8], 8.0 * np.eye(4), atol=1e-12
    )  # independent of each other
    np.testing.assert_array_equal(signs[8], -signs[0])
    # At random angles and sizes differ, and no line turns.
    assert (np.abs(rotation) <= 2.0).all() and np.abs(
        np.abs(rotation[patterns:, ~lines]) - 1.0
    ).min() > 1e-6
    assert np.unique(np.angle(rotation[patterns:, ~lines]).round(9)).size == 4 * RANDOM_STARTS
    np.testing.assert_allclose(rotation[:, lines].imag, 0.0, atol=1e-12)
    assert np.unique(rotation[:, lines].real.round(9)).size == 2 * (patterns + RANDOM_STARTS)
    assert (rotation[:, lines].real >= 0.0).all()


def largest_share(layout: Layout, target: Array, scale: Array, start: Array) -> float:
    """The largest share of a wrench that SLSQP finds, from a command (n, 3) and from commands near
    to it."""
    plant = Plant(layout)
    counts = np.array(plant.counts)
    along = (target / scale)[counts]
    used = layout.upper > layout.lower

    def full(x: Array) -> Array:
        command = layout.lower.copy()
        command[used] += x[:-1] * (layout.upper - layout.lower)[used]
        return command

    def missing(x: Array) -> Array:
        return np.asarray((plant.wrench(full(x)) / scale)[counts] - x[-1] * along)

    best = 0.0
    rng = np.random.default_rng(2)
    own = ((start - layout.lower) / np.where(used, layout.upper - layout.lower, 1.0))[used]
    for spread in (0.0, 0.1, 0.3):
        first = np.clip(own + spread * rng.normal(size=own.shape), 0.0, 1.0)
        optimum = minimize(
            lambda x: -x[-1],
            np.append(first, 0.3),
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(first) + [(0.0, 2.0)],
            constraints={"type": "eq", "fun": missing},
            options={"maxiter": 100},
        )
        if np.abs(missing(optimum.x)).max() < 1e-6:
            best = max(best, float(optimum.x[-1]))
    return best


@pytest.mark.parametrize("name", ["heavy", "catamaran"])
def test_a_direction_goes_as_far_as_steps_on_commands_find(name: str) -> None:
    whole = parse_layout(bluerov2_heavy()) if name == "heavy" else load_layout(name)
    layout = replace(whole, interaction=Jets())
    allocator = Allocator(layout)
    rng = np.random.default_rng(3)
    drawn = Plant(layout).wrench(Plant(layout).sample(rng, (2,)))
    for target in 4.0 * drawn:
        answer = allocator.allocate(target, policy="direction")
        along = np.nan_to_num(target / answer.scale) * (~np.isnan(answer.target))
        ray_share = float(along @ (answer.wrench / answer.scale) / (along @ along))
        assert 0.05 < ray_share < 1.0
        other = largest_share(layout, target, answer.scale, answer.command)
        assert ray_share >= other * (1.0 - 2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_direction_is_kept_on_its_ray_whatever_the_robot(seed: int) -> None:
    rng = np.random.default_rng([4, seed])
    layout = replace(random_jet_robot(rng, "robot", (4, 7)), interaction=Jets())
    plant = Plant(layout)
    allocator = Allocator(layout)
    for target in 5.0 * plant.wrench(plant.sample(rng, (3,))):
        answer = allocator.allocate(target, policy="direction")
        along = target / answer.scale
        wrench = answer.wrench / answer.scale
        share = float(along @ wrench / (along @ along))
        assert np.linalg.norm(wrench - share * along) <= 1e-5
        assert answer.err_norm == pytest.approx(
            (1.0 - share) * np.linalg.norm(along), rel=1e-4, abs=1e-6
        )


def test_iterations_settle_in_few_steps_at_the_conditions_of_a_minimum() -> None:
    """Each iteration is exact on the model that is linear at the last answer: a fault of that model
    costs iterations, or ends elsewhere."""
    steps = 0.0
    for seed in range(4):
        rng = np.random.default_rng([5, seed])
        layout = replace(random_jet_robot(rng, "robot", (4, 7)), interaction=Jets())
        plant = Plant(layout)
        dual = Allocator(layout)._whole.method
        for target in 0.6 * plant.wrench(plant.sample(rng, (3,))):
            by_laws = dual.compiled.forces(target[None], CLOSEST, None, NOMINAL)
            ended = dual.coupled.iterate(
                target,
                by_laws.force[0],
                ROUNDS,
                core_policy(CLOSEST),
                by_laws.multipliers[0],
                NOMINAL,
                most_steps=1e6,
            )
            steps += ended.steps
    assert steps <= MOST_STEPS


def test_forces_without_an_iteration_come_with_no_answer_of_the_dual() -> None:
    layout = replace(parse_layout(bluerov2_heavy()), interaction=Jets())
    dual = Allocator(layout)._whole.method
    target = 0.5 * dual.scale
    by_laws = dual.compiled.forces(target[None], CLOSEST, None, NOMINAL)
    iterated = dual.coupled.iterate(target, by_laws.force[0], ROUNDS, core_policy(CLOSEST))
    assert iterated.answer is not None and iterated.answer.command.shape == (1, layout.n, 3)
    only_steps = dual.coupled.iterate(target, by_laws.force[0], 0)
    assert only_steps.answer is None
    assert only_steps.force.shape == (layout.n, 2)


def coupled_with(allocator: Allocator, **changes: Any) -> CoupledCore:
    """The core of a robot with jets, some of what its actuators do to each other replaced."""
    dual: Any = allocator._whole.method
    usual = dual.coupled._wrench_offset
    return CoupledCore(dual.compiled.block, usual._replace(**changes))


class _CountedEffect:
    """The effect of jets, and how often the core asks for it."""

    def __init__(self, allocator: Allocator) -> None:
        self._interaction: Any = Plant(allocator.layout).interaction
        self.asked = 0

    def __call__(self, force: Array, inflow: Array | None) -> tuple[Array, Array]:
        self.asked += 1
        offset, slope = self._interaction.effect(force, inflow)
        return np.asarray(offset), np.asarray(slope)


def pods_with_jets(seed: int) -> Allocator:
    """A random robot of pods."""
    rng = np.random.default_rng([41, seed])
    layout = random_jet_robot(rng, "robot", (4, 8), [random_azimuth])
    return Allocator(replace(layout, interaction=Jets()))


def test_other_starts_are_tried_and_none_makes_an_answer_worse() -> None:
    """The search of all starts begins as iterations from the forces by the laws alone do."""
    gains = []
    for seed in (2, 10, 14):
        allocator = pods_with_jets(seed)
        dual = allocator._whole.method
        plant = Plant(allocator.layout)
        for target in 0.6 * plant.wrench(plant.sample(np.random.default_rng(seed), (4,))):
            by_laws = dual.compiled.forces(target[None], CLOSEST, None, NOMINAL)
            first = dual.coupled.iterate(
                target, by_laws.force[0], ROUNDS, core_policy(CLOSEST), by_laws.multipliers[0]
            )
            assert first.answer is not None
            best = dual.coupled.answer_many(target[None], core_policy(CLOSEST))
            power = plant.power(best.command[0]).sum()
            power_of_first = plant.power(first.answer.command[0]).sum()
            assert power <= power_of_first * (1.0 + 1e-6)
            gains.append(1.0 - power / power_of_first)
    assert max(gains) > 0.01


def test_no_other_start_is_tried_where_jets_cost_nothing() -> None:
    allocator = pods_with_jets(2)
    n = allocator.layout.n
    target = 0.5 * Plant(allocator.layout).wrench(allocator.layout.upper)
    asked = 0

    def nothing(force: Array, inflow: Array | None) -> tuple[Array, Array]:
        nonlocal asked
        asked += 1
        return np.zeros(6), np.zeros((n, 3, 6))

    free = coupled_with(allocator, core_constants=None, effect=nothing)
    free.answer_many(target[None], core_policy(CLOSEST))
    assert asked <= 2 * ROUNDS


@pytest.mark.parametrize("kinds", [[random_thruster], [random_azimuth]])
def test_without_starts_fewer_are_tried(kinds: list[Any]) -> None:
    """Of those that rotate forces or change their sizes; one reversed force is always a start."""
    rng = np.random.default_rng([77, 4])
    layout = replace(random_jet_robot(rng, "robot", (5, 7), kinds), interaction=Jets())
    allocator = Allocator(layout)
    plant = Plant(layout)
    targets = 0.5 * plant.wrench(plant.sample(rng, (6,)))
    asked = []
    for starts in (None, start_factors(allocator._whole.method.compiled.is_line)):
        effect = _CountedEffect(allocator)
        core = coupled_with(allocator, core_constants=None, effect=effect, starts=starts)
        core.answer_many(targets, core_policy(CLOSEST))
        asked.append(effect.asked)
    assert asked[0] < asked[1]


def test_thrusters_that_would_push_the_same_way_again_are_not_followed() -> None:
    """Of the twenty other starts of eight thrusters most come to the same forces."""
    allocator = Allocator(replace(parse_layout(bluerov2_heavy()), interaction=Jets()))
    plant = Plant(allocator.layout)
    effect = _CountedEffect(allocator)
    core = coupled_with(allocator, core_constants=None, effect=effect)
    targets = 0.5 * plant.wrench(plant.sample(np.random.default_rng(6), (10,)))
    core.answer_many(targets, core_policy(CLOSEST))
    assert effect.asked <= 40 * len(targets)


def test_one_answer_is_one_of_many() -> None:
    allocator = pods_with_jets(10)
    plant = Plant(allocator.layout)
    core = allocator._whole.method.coupled
    targets = 0.5 * plant.wrench(plant.sample(np.random.default_rng(5), (3,)))
    many = core.answer_many(targets, core_policy(CLOSEST))
    for k, target in enumerate(targets):
        one = core.answer_many(target[None], core_policy(CLOSEST))
        np.testing.assert_array_equal(one.command[0], many.command[k])
        np.testing.assert_array_equal(one.multipliers[0], many.multipliers[k])


def test_what_an_effect_raises_reaches_the_caller_once() -> None:
    allocator = pods_with_jets(2)
    target = 0.5 * Plant(allocator.layout).wrench(allocator.layout.upper)
    works = _CountedEffect(allocator)
    fails = True

    def effect(force: Array, inflow: Array | None) -> tuple[Array, Array]:
        if fails:
            raise ZeroDivisionError("no effect")
        return works(force, inflow)

    core = coupled_with(allocator, core_constants=None, effect=effect)
    with pytest.raises(ZeroDivisionError, match="no effect"):
        core.answer_many(target[None], core_policy(CLOSEST))
    fails = False
    again = core.answer_many(target[None], core_policy(CLOSEST))
    usual = allocator._whole.method.coupled.answer_many(target[None], core_policy(CLOSEST))
    np.testing.assert_allclose(again.command, usual.command, atol=1e-9)


@pytest.mark.parametrize("kind", ["closest", "direction"])
def test_beyond_reach_the_core_finishes_answers_of_thrusters(kind: str) -> None:
    """Their laws are those of the core: what it serves is what the plant gives."""
    allocator = Allocator(replace(parse_layout(bluerov2_heavy()), interaction=Jets()))
    dual = allocator._whole.method
    plant = Plant(allocator.layout)
    drawn = plant.wrench(plant.sample(np.random.default_rng(9), (8,)))
    finished = 0
    for target in 8.0 * drawn:
        row = dual.coupled.answer_row(
            target, core_policy(Policy(kind)), None, NOMINAL, dual._most_core_error
        )
        if row.is_met or not row.is_finished:
            continue  # the last linear model has the target within reach
        finished += 1
        wrench = plant.wrench(row.command)
        served = row.wrench_served[0]
        if kind == "direction":
            along = target / allocator.scale
            share = float(served / allocator.scale @ along / (along @ along))
            assert 0.05 < share < 1.0
            np.testing.assert_allclose(served, share * target, atol=1e-9)
            assert np.linalg.norm((wrench - served) / allocator.scale) <= 1e-6
        # Steps by the laws themselves find nothing nearer to what is served.
        problem = dual.problem_under(NOMINAL)
        refined = refine(problem, served[None] / problem.error_scale, row.command[None], ROUNDS)
        error = problem.error(row.command[None], served[None] / problem.error_scale)
        assert error[0] <= refined.error[0] * 1.05 + 1e-6
    assert finished >= 4
