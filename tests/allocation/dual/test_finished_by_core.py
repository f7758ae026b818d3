"""Answers that the core has finished by itself, which no step by the laws in Python follows: the
plant judges them, and the slow way says the same."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.method import Dual
from finlab.allocation.policy import POLICY_NAMES, Policy
from finlab.arrays import EXACT, Array
from finlab.assets import shipped_layouts
from finlab.core.calls import Conditions
from finlab.layout import Layout
from tests.random_robots import KINDS, load, random_robot

ROBOTS = [*shipped_layouts(), *KINDS]
"""Shipped robots, and a random one of each kind."""
ROUNDING_OF_ANGLE = 4.0 * np.pi * np.finfo(float).eps
"""By which an angle [rad] may change where it is wrapped."""


def layout_called(name: str) -> Layout:
    """A shipped layout, or a random one of a kind."""
    if name in KINDS:
        return load(random_robot(name, 0, 59))
    return finlab.load_layout(shipped_layouts()[name])


def targets_of(layout: Layout, shares: Sequence[float]) -> Array:
    """Wrenches (N, 6) [N, N m], in five directions, at shares of the most that is given there."""
    allocator = finlab.Allocator(layout)
    rng = np.random.default_rng(59)
    direction = rng.normal(size=(5, 6)) * allocator.scale * layout.commanded
    most = allocator.allocate_batch(50.0 * direction, policy="direction").wrench
    rows = np.concatenate([share * most for share in shares])
    return np.where(layout.commanded, rows, 0.0)


def answers(allocator: finlab.Allocator, targets: Array, **question: Any) -> list[Any]:
    """One answer for each target."""
    return [allocator.allocate(target, **question) for target in targets]


@pytest.fixture
def slow_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """The core's grids count as too coarse to tell: the plant is asked about each answer."""
    monkeypatch.setattr(Dual, "_most_core_error", -1.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_what_counts_as_exact_is_so_by_the_plant(name: str) -> None:
    layout = layout_called(name)
    allocator = finlab.Allocator(layout)
    for answer in answers(allocator, targets_of(layout, (0.3, 0.97))):
        if answer.answered.solution.notes is None:  # met, as the core finished it
            assert answer.err_norm <= EXACT


@pytest.mark.parametrize("policy", POLICY_NAMES)
@pytest.mark.parametrize("name", ROBOTS[::3])
def test_the_slow_way_comes_to_the_same(
    name: str, policy: Any, request: pytest.FixtureRequest
) -> None:
    layout = layout_called(name)
    targets = targets_of(layout, (0.5, 0.97, 1.5))
    quick = answers(finlab.Allocator(layout), targets, policy=policy)
    request.getfixturevalue("slow_way")
    slow = answers(finlab.Allocator(layout), targets, policy=policy)
    for one, other in zip(quick, slow, strict=True):
        assert one.reachable == other.reachable
        assert one.err_norm == pytest.approx(other.err_norm, abs=3.0 * EXACT)
        assert one.power == pytest.approx(other.power, rel=1e-6)
        assert one.notes == other.notes


@pytest.mark.parametrize("name", ROBOTS)
def test_commands_of_a_tick_are_within_the_rates_as_they_are(name: str) -> None:
    """But for the rounding of an angle: nothing clips them after the core."""
    layout = layout_called(name)
    allocator = finlab.Allocator(layout)
    method = allocator._whole.method
    previous = allocator.allocate(np.zeros(6)).command
    for target in targets_of(layout, (0.4, 1.2)):
        answer = allocator.allocate(target, previous=previous)
        box = method.rates.box(previous)
        held = box.clip_feasible(answer.command, method.plant)
        np.testing.assert_allclose(answer.command, held, rtol=0.0, atol=ROUNDING_OF_ANGLE)
        previous = answer.command


def test_lost_actuators_have_nan_commands_that_nobody_can_write_to() -> None:
    layout = finlab.load_layout("bluerov2_heavy")
    allocator = finlab.Allocator(layout)
    answer = allocator.allocate([5.0, 0.0, 2.0, 0.0, 0.0, 0.0], lost=["front_left"])
    is_lost = [name == "front_left" for name in layout.names]
    np.testing.assert_array_equal(np.isnan(answer.command).all(axis=1), is_lost)
    with pytest.raises(ValueError, match="read-only"):
        answer.command[0, 0] = 1.0


def test_answers_stay_as_they_were_when_others_follow() -> None:
    """Each has memory of its own, also where more are asked for than are allocated at once."""
    layout = finlab.load_layout("A")
    allocator = finlab.Allocator(layout)
    rng = np.random.default_rng(3)
    targets = 0.1 * rng.normal(size=(100, 6)) * allocator.scale
    targets = np.where(layout.commanded, targets, 0.0)
    kept = answers(allocator, targets)
    again = answers(finlab.Allocator(layout), targets)
    for one, other in zip(kept, again, strict=True):
        assert one == other


def test_fields_that_nobody_has_read_are_those_of_the_question() -> None:
    layout = finlab.load_layout("turtle_hybrid")
    allocator = finlab.Allocator(layout)
    flow = [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]
    answer = allocator.allocate(np.zeros(6), policy="direction", flow=flow, seed=4)
    assert answer.seed == 4
    assert answer.policy.kind == "direction"
    assert answer.layout == layout
    assert answer.method == "dual"
    assert answer.checkpoint is None
    assert answer.settings == vars(allocator.settings)
    assert answer.multipliers is not None and answer.multipliers.shape == (6,)
    assert answer.flow is not None
    np.testing.assert_array_equal(answer.flow, flow)
    with pytest.raises(AttributeError, match="wrenches"):
        _ = answer.wrenches


@pytest.mark.parametrize("policy", POLICY_NAMES)
@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "rudders"])
def test_beyond_reach_without_an_actuator_the_forces_give_what_is_served(
    name: str, policy: Any
) -> None:
    """The forces themselves, before steps on commands could make up for them."""
    layout = layout_called(name)
    compiled = Compiled.of(layout)
    targets = targets_of(layout, (1.6,))
    for index in range(layout.n):
        lost = np.arange(layout.n) == index
        offset = compiled.wrench_offset_of(~lost)
        conditions = Conditions(None, lost, None)
        for target in targets[:3]:
            answer = compiled.forces(target[None], Policy(policy), None, conditions)
            assert not answer.force[0, index].any()
            given = np.einsum("nk,nkw->w", answer.force[0], compiled.effectiveness) + offset
            missing = (given - answer.wrench_served[0]) * layout.commanded
            assert np.abs(missing / compiled.axis_scale).max() < 1e-5
