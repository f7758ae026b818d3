"""Answers where jets meet, by outer iterations: where they begin anew, and how far they go along a
ray."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.allocation import Allocator
from finlab.allocation.dual.compiled import Compiled, core_policy
from finlab.allocation.dual.outer_iterations import (
    JET_ROTATION,
    MAX_WORK,
    RANDOM_STARTS,
    WALSH,
    _best_of_starts,
    _is_better,
    _rotated_starts,
)
from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.allocation.policy import CLOSEST
from finlab.arrays import ROUNDS, Array
from finlab.core.calls import NOMINAL
from finlab.core.coupled_core import CoupledCore, OuterResult
from finlab.interaction.jets import Jets
from finlab.layout import Layout, load_layout
from finlab.layout.load import parse_layout
from finlab.physics import Plant
from finlab.research.random_layouts import random_jet_robot
from tests.random_robots import bluerov2_heavy

MOST_STEPS = 540.0
"""Steps of the iterations of all questions: what they took when this was written, and a tenth
more."""


def test_other_starts_rotate_planes_and_change_sizes() -> None:
    rng = np.random.default_rng(1)
    lines = np.array([False, True, False, False, True, False])
    force = rng.normal(size=(6, 2))
    force[lines, 1] = 0.0
    parts = _rotated_starts(force, lines)
    starts = parts.all()
    patterns = len(WALSH) + 1
    assert [len(part) for part in parts] == [len(WALSH), 1, RANDOM_STARTS]
    assert starts.shape == (patterns + RANDOM_STARTS, 6, 2)

    complex_force = force[:, 0] + 1j * force[:, 1]
    rotation = (starts[..., 0] + 1j * starts[..., 1]) / complex_force
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


class _ConstantIterations:
    """Stands for a `CoupledCore`: whatever the start, iterations come to the same power."""

    def __init__(self) -> None:
        self.starts_without_iteration = 0

    def iterate(
        self, target: Array, force: Array, most_iterations: int, *_: Any, **__: Any
    ) -> OuterResult:
        self.starts_without_iteration += most_iterations == 0
        return OuterResult(None, force, power=2.0, penalty=1.0, error=0.0, steps=0.0)


def search_from_all_starts(coupled: "_ConstantIterations", n: int, power_by_laws: float) -> None:
    """Has the best of all starts looked for, of a robot of n actuators without lines, whose answer
    by the laws alone takes a power [W]."""
    by_laws = SimpleNamespace(
        force=np.ones((1, n, 2)), multipliers=np.zeros((1, 6)), command=np.zeros((1, n, 3))
    )
    compiled = SimpleNamespace(
        core=SimpleNamespace(answer_one=lambda *_: by_laws), is_line=np.zeros(n, bool)
    )
    problem = SimpleNamespace(
        plant=SimpleNamespace(power=lambda command: np.full(command.shape[:-1], power_by_laws / n))
    )
    _best_of_starts(
        cast("CoupledCore", coupled),
        cast("Compiled", compiled),
        cast("CommandProblem", problem),
        np.zeros(6),
        CLOSEST,
        NOMINAL,
        None,
    )


def test_starts_that_make_nothing_cheaper_are_reversed_in_one_round_alone() -> None:
    n = 6
    coupled = _ConstantIterations()
    search_from_all_starts(coupled, n, power_by_laws=1.0)
    rotated = len(WALSH) + 1 + RANDOM_STARTS
    assert coupled.starts_without_iteration == n + rotated


@pytest.mark.parametrize(
    ("error", "power", "is_better"),
    [
        (0.0, 9.0, True),  # as near at less power
        (0.0, 11.0, False),
        (2e-3, 9.0, False),  # cheaper, but off
        (0.5e-6, 9.0, True),
        (-0.5e-6, 11.0, False),
        (-2e-3, 11.0, True),  # dearer, but nearer
    ],
)
def test_the_better_of_two_is_nearer_or_as_near_and_cheaper(
    error: float, power: float, is_better: bool
) -> None:
    """By more than a millionth of the wrench scale."""
    known = OuterResult(None, np.zeros((1, 2)), power=10.0, penalty=1.0, error=0.01, steps=1.0)
    other = known._replace(error=0.01 + error, power=power)
    assert _is_better(other, known) == is_better


class _CountedIterations(_ConstantIterations):
    """The same, each with so many steps, where reversed starts are cheaper and cheaper."""

    def __init__(self, steps: float) -> None:
        super().__init__()
        self.steps = steps
        self.power = 2.0
        self.followed = 0
        self.allowed: list[float] = []

    def iterate(
        self, target: Array, force: Array, most_iterations: int, *_: Any, **more: Any
    ) -> OuterResult:
        if most_iterations == 0:
            return OuterResult(None, force, power=self.power, penalty=1.0, error=0.0, steps=5.0)
        self.followed += 1
        self.allowed.append(more["most_steps"])
        self.power *= 0.9
        return OuterResult(None, force, self.power, penalty=1.0, error=0.0, steps=self.steps)


@pytest.mark.parametrize(("share", "followed"), [(0.3, 4), (0.6, 2), (1.5, 1)])
def test_steps_of_all_starts_together_bound_how_many_are_followed(
    share: float, followed: int
) -> None:
    n = 4
    steps = share * MAX_WORK / n
    coupled = _CountedIterations(steps)
    search_from_all_starts(coupled, n, power_by_laws=0.1)
    assert coupled.followed == followed
    left = MAX_WORK / n - steps * np.arange(followed)
    np.testing.assert_allclose(coupled.allowed, left)
