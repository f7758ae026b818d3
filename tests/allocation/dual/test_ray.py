"""The largest share of a target by the laws: beside a stand-in for the core whose laws reach a known
share, and on robots that cannot rest."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.dual import ray
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.ray import NONE_ALONE, _cancelling_command, keep_on_rays
from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.arrays import NEARLY, Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.layout.load import parse_layout
from tests.random_robots import random_robot

SCALE = np.array([10.0, 20.0, 5.0, 1.0, 2.0, 3.0])
"""Scale of wrenches [N, N m]."""
TARGET = np.array([30.0, -10.0, 20.0, 1.0, -0.5, 2.0])
"""A desired wrench [N, N m]."""


class StandIn:
    """Stands for a compiled robot and its problem of commands, which are wrenches in two rows."""

    def __init__(self, reach: float, cancelling: Array | None = None) -> None:
        """Takes what the laws give.

        Args:
            reach: largest share of `TARGET`.
            cancelling: the command (2, 3) of no wrench, where there is one.
        """
        self.error_scale = SCALE
        self.reach = reach
        self.cancelling = cancelling
        self.plant = SimpleNamespace(lower=np.zeros((2, 3)), upper=np.array([[1, 2, 4], [5, 6, 7]]))
        self.starts = np.empty(0)
        self.asked: list[float] = []

    def forces(self, targets: Array, *_: Any) -> Any:
        """An answer whose multipliers and bound say which target it is for."""
        return SimpleNamespace(
            wrench_served=targets,
            multipliers=2.0 * targets,
            gap_power_bound=np.abs(targets).sum(axis=1),
        )

    def error(self, command: Array, wanted: Array) -> Array:
        """How far (N,) commands are off: by what their share is too large, and what is asked."""
        given = command.reshape(-1, 6)
        share = given @ TARGET / (TARGET @ TARGET)
        self.asked.append(float(share[0]))
        missing = np.linalg.norm(given / SCALE - wanted, axis=1)
        return np.asarray(missing + np.maximum(np.abs(share) - self.reach, 0.0))


@pytest.fixture(autouse=True)
def laws_of_the_stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the problem is a stand-in its commands are exact as they are, and it says itself which
    command gives no wrench."""
    exact_commands = ray.exact_commands
    cheapest_exact = ray.cheapest_exact

    def exact(problem: Any, answer: Any) -> Array:
        if isinstance(problem, StandIn):
            return np.asarray(answer.wrench_served.reshape(-1, 2, 3))
        return exact_commands(problem, answer)

    def cheapest(problem: Any, wanted: Array, starts: Array) -> Array | None:
        if isinstance(problem, StandIn):
            assert not wanted.any()
            problem.starts = starts
            return problem.cancelling
        return cheapest_exact(problem, wanted, starts)

    monkeypatch.setattr(ray, "exact_commands", exact)
    monkeypatch.setattr(ray, "cheapest_exact", cheapest)


def kept_on_rays(
    stand_in: StandIn, conditions: Conditions, targets: Array, answer: Any, command: Array
) -> set[str]:
    """The notes of `keep_on_rays`, which overwrites answer and commands (N, 2, 3)."""
    compiled = cast("Compiled", stand_in)
    problem = cast("CommandProblem", stand_in)
    return keep_on_rays(compiled, problem, conditions, targets, cast("Any", answer), command)


def kept(
    method: StandIn, served: Array, command: Array | None = None
) -> tuple[Any, Array, set[str]]:
    """Answer, commands (2, 2, 3) and notes of two targets, of which the second is out of reach."""
    targets = np.stack([0.1 * TARGET, TARGET])
    answer = SimpleNamespace(
        wrench_served=np.stack([targets[0], served]),
        multipliers=np.ones((2, 6)),
        gap_power_bound=np.array([3.0, 4.0]),
        is_attainable=np.array([True, False]),
    )
    commands = np.stack([targets[0], served]).reshape(2, 2, 3)
    if command is not None:
        commands[1] = command
    notes = kept_on_rays(method, NOMINAL, targets, answer, commands)
    # The first one was within reach, and stays as it was.
    np.testing.assert_array_equal(commands[0].ravel(), targets[0])
    np.testing.assert_array_equal(answer.multipliers[0], np.ones(6))
    assert answer.gap_power_bound[0] == 3.0
    return answer, commands, notes


@pytest.mark.parametrize("reach", [0.01, 0.123, 0.5, 0.599])
def test_the_largest_share_by_the_laws_is_found_below_that_of_the_core(reach: float) -> None:
    answer, commands, notes = kept(StandIn(reach), 0.6 * TARGET)
    share = answer.wrench_served[1] @ TARGET / (TARGET @ TARGET)
    assert reach - 2.0 * NEARLY <= share <= reach + NEARLY
    on_ray = share * TARGET
    np.testing.assert_allclose(answer.wrench_served[1], on_ray, rtol=1e-9)
    np.testing.assert_allclose(commands[1].ravel(), on_ray, rtol=1e-9)
    np.testing.assert_allclose(answer.multipliers[1], 2.0 * on_ray, rtol=1e-9)
    assert answer.gap_power_bound[1] == pytest.approx(np.abs(on_ray).sum())
    assert not notes


def test_what_is_on_the_ray_already_stays() -> None:
    method = StandIn(0.9)
    answer, _, notes = kept(method, 0.6 * TARGET)
    np.testing.assert_array_equal(answer.wrench_served[1], 0.6 * TARGET)
    assert answer.gap_power_bound[1] == 4.0 and len(method.asked) == 1 and not notes


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_what_is_off_the_ray_along_any_axis_is_brought_onto_it(axis: int, sign: float) -> None:
    off = 0.6 * TARGET
    off[axis] += sign * 0.05 * SCALE[axis]
    answer, _, _ = kept(StandIn(0.9), off)
    served = answer.wrench_served[1]
    share = served @ TARGET / (TARGET @ TARGET)
    np.testing.assert_allclose(served, share * TARGET, atol=1e-9)
    # Of what was served its part along the ray is kept, by the scaled axes.
    ray = TARGET / SCALE
    assert share == pytest.approx((off / SCALE) @ ray / (ray @ ray), abs=1e-5)


def test_in_a_tick_what_the_rates_leave_stays() -> None:
    method = StandIn(0.1)
    answer = SimpleNamespace(
        wrench_served=0.6 * TARGET[None],
        multipliers=np.ones((1, 6)),
        gap_power_bound=np.ones(1),
        is_attainable=np.array([False]),
    )
    commands = answer.wrench_served.reshape(1, 2, 3).copy()
    in_tick = NOMINAL._replace(previous=np.zeros((2, 3)))
    kept_on_rays(method, in_tick, TARGET[None], answer, commands)
    np.testing.assert_array_equal(commands.ravel(), 0.6 * TARGET)


def test_where_no_share_can_be_given_least_forces_cancel_or_it_is_told() -> None:
    nothing = np.arange(6.0).reshape(2, 3)
    off = 0.6 * TARGET + SCALE
    answer, commands, notes = kept(StandIn(-1.0, nothing), off)
    np.testing.assert_array_equal(commands[1], nothing)
    assert not answer.wrench_served[1].any() and not answer.multipliers[1].any() and not notes
    assert answer.gap_power_bound[1] == 0.0
    answer, commands, notes = kept(StandIn(-1.0), off)
    np.testing.assert_array_equal(answer.wrench_served[1], off)
    assert notes == {NONE_ALONE}


def test_commands_that_may_cancel_begin_near_the_least_forces_at_any_angle() -> None:
    method = StandIn(-1.0)
    assert _cancelling_command(cast("CommandProblem", method)) is None
    share = (method.starts - method.plant.lower) / (method.plant.upper - method.plant.lower)
    assert (share >= 0.0).all() and (share <= 1.0).all()
    assert np.median(share[..., :2]) < 0.2 and share[..., :2].max() > 0.5
    assert 0.3 < np.median(share[..., 2]) < 0.7


def test_fins_that_cannot_rest_cancel_each_other() -> None:
    allocator = Allocator(parse_layout(random_robot("holes", 1, 71)))
    method = allocator._whole.method
    command = _cancelling_command(method.problem_under(NOMINAL))
    assert command is not None
    wrench = method.plant.wrench(command) / method.scale
    assert np.linalg.norm(wrench[method.plant.counts]) <= 2.0 * NEARLY
    assert (command >= method.layout.lower).all() and (command <= method.layout.upper).all()
