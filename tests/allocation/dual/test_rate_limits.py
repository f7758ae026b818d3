"""From tick to tick: commands within the rates of the drives, and the wrench that they are in time
for."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import CommandError
from finlab.layout import Layout, Servo, load_layout
from finlab.physics import Plant
from finlab.research.evaluation.method_specs import load_method_spec
from finlab.swim.vehicle.fin_motion import LagStep
from tests.allocator_cache import AllocatorCache

TICKS = np.arange(150) * 0.1
"""15 s at 10 Hz."""
SLOW_PATH = np.array([0.98, 0.98, 1.4, 0.175, 0.175, 0.175])
"""Amplitudes of the path [N, N m], about 0.7 standard deviations of what random commands give."""
TARGET = [1.0, 0.5, 2.0, 0.0, 0.1, 0.1]
"""A wrench that the robots are asked for [N, N m]."""
STEP = np.array([0.1, 0.3, 0.5])
"""What the usual servo's commands change by in a tick [rad, Hz, rad]."""


class Drive(NamedTuple):
    """Answers along a path."""

    command: np.ndarray
    """(T, n, 3)."""
    cost: np.ndarray
    """Power (T,) [W]."""
    error: np.ndarray
    """(T,), by the plant."""

    @property
    def change(self) -> np.ndarray:
        """What each command changes by from tick to tick (T - 1, n, 3), the shorter way round."""
        change = np.diff(self.command, axis=0)
        change[..., 2] = wrapped(change[..., 2])
        return np.abs(change)


def answers_along(
    method: AllocatorCache, layout: Layout, path: np.ndarray, *, bound: bool
) -> Drive:
    """Answers to the wrenches of a path; with `bound`, each within the rates from the one
    before."""
    previous = None
    results = []
    for wrench in path:
        result = method.allocate(layout, wrench, previous=previous)
        previous = result.command if bound else None
        results.append(result)
    return Drive(
        np.array([result.command for result in results]),
        np.array([result.power for result in results]),
        np.array([result.err_norm for result in results]),
    )


def smooth_path(seed: int) -> np.ndarray:
    """Slow sines (T, 6) in all axes."""
    rng = np.random.default_rng(seed)
    return SLOW_PATH * np.sin(
        rng.uniform(0.15, 0.6, 6) * TICKS[:, None] + rng.uniform(0.0, 2.0 * math.pi, 6)
    )


@pytest.fixture(scope="module")
def penta() -> Layout:
    """Five fins."""
    return load_layout("penta")


@pytest.fixture(scope="module")
def method() -> AllocatorCache:
    """The default method."""
    return AllocatorCache()


@pytest.fixture(scope="module")
def free(method: AllocatorCache, penta: Layout) -> Drive:
    """Answers along a path with no regard for rates."""
    return answers_along(method, penta, smooth_path(0), bound=False)


@pytest.fixture(scope="module")
def steady(method: AllocatorCache, penta: Layout) -> Drive:
    """Answers along the same path, each within the rates from the one before."""
    return answers_along(method, penta, smooth_path(0), bound=True)


def test_no_command_changes_faster_than_its_servo(free: Drive, steady: Drive) -> None:
    assert (steady.change <= STEP + 1e-9).all()
    assert (free.change.max((0, 1)) > STEP)[2]  # left to themselves, fins turn by more


def test_the_path_is_still_tracked_at_about_the_same_cost(free: Drive, steady: Drive) -> None:
    assert free.error.max() < 1e-5
    assert steady.error.max() < 0.02 and np.median(steady.error) < 1e-6
    assert steady.cost.mean() < 1.002 * free.cost.mean()


def test_rates_are_those_of_each_fin(search: AllocatorCache, penta: Layout) -> None:
    first = replace(
        penta.fins[0], servo=replace(penta.fins[0].servo, frequency_rate=0.5, direction_rate=1.0)
    )
    other = replace(penta, actuators=(first, *penta.fins[1:]))
    ride = answers_along(search, other, smooth_path(1)[:60], bound=True)
    assert (ride.change[:, 0] <= np.array([0.1, 0.05, 0.1]) + 1e-9).all()
    assert (ride.change[:, 1:, 2] > 0.1).any()


def test_ticks_may_be_longer(penta: Layout) -> None:
    slow = AllocatorCache(period_s=0.4)
    before = slow.allocate(penta, TARGET).command
    after = slow.allocate(penta, -np.array(TARGET), previous=before).command
    change = np.abs(after - before)
    assert np.abs(wrapped(change[:, 2])).max() == pytest.approx(2.0)
    assert change[:, 1].max() <= 1.2 + 1e-9


def test_commands_stay_inside_the_limits_across_the_seam(steady: Drive, penta: Layout) -> None:
    assert ((steady.command >= penta.lower) & (steady.command <= penta.upper)).all()
    jumps = np.abs(np.diff(steady.command[..., 2], axis=0)) > math.pi
    assert jumps.any()  # fins do pass the seam


def test_a_fin_follows_a_turning_force_over_the_seam(search: AllocatorCache) -> None:
    layout = load_layout("pair")
    previous = None
    for angle in np.linspace(0.0, 4.0 * math.pi, 80):
        command = np.column_stack([np.full(2, 0.4), np.full(2, 1.5), np.full(2, wrapped(angle))])
        result = search.allocate(layout, Plant(layout).wrench(command), previous=previous)
        assert result.err_norm < 1e-5
        assert ((result.command >= layout.lower) & (result.command <= layout.upper)).all()
        previous = result.command


def test_arcs_are_kept(search: AllocatorCache) -> None:
    layout = load_layout("restricted")
    ride = answers_along(search, layout, smooth_path(1)[:60], bound=True)
    assert ((ride.command >= layout.lower) & (ride.command <= layout.upper)).all()


def test_a_previous_command_that_is_the_answer_stays(
    method: AllocatorCache, penta: Layout, free: Drive
) -> None:
    plant = Plant(penta)
    for tick in (0, 50, 120):
        before = free.command[tick]
        result = method.allocate(penta, smooth_path(0)[tick], previous=before)
        np.testing.assert_allclose(result.forces, plant.body_forces(before), atol=1e-3)
        result_again = method.allocate(penta, smooth_path(0)[tick], previous=result.command)
        np.testing.assert_allclose(result_again.forces, result.forces, atol=1e-3)
        assert result.power < 1.005 * free.cost[tick]


def test_the_first_tick_knows_no_past(free: Drive, steady: Drive) -> None:
    np.testing.assert_array_equal(steady.command[0], free.command[0])


def test_a_failed_fin_comes_back(search: AllocatorCache, penta: Layout) -> None:
    lost = search.allocate(penta, TARGET, lost=["port_back"])
    result_still_lost = search.allocate(penta, TARGET, lost=["port_back"], previous=lost.command)
    assert (
        np.isnan(result_still_lost.command[2]).all()
        and np.isfinite(result_still_lost.command[[0, 1, 3, 4]]).all()
    )
    back = search.allocate(penta, TARGET, previous=lost.command)
    assert np.isfinite(back.command).all() and back.err_norm < 1e-5
    working = [0, 1, 3, 4]
    assert (np.abs(back.command - lost.command)[working] <= STEP + 1e-9).all()


def test_a_target_that_needs_a_turn_is_reached_tick_by_tick(
    method: AllocatorCache, penta: Layout
) -> None:
    """From rise to dive all fins turn by half a circle: seven ticks, in which less and less is
    missing."""
    target = np.array([0.0, 0.0, 12.0, 0.0, 0.0, 0.0])
    previous = method.allocate(penta, target).command
    missing = []
    for _ in range(12):
        result = method.allocate(penta, -target, previous=previous)
        previous = result.command
        missing.append(result.err_norm)
    assert missing[0] > 1.0 and (np.diff(missing) <= 1e-9).all()
    assert missing[-1] < 1e-5


PERIOD_S = 0.1
"""Length of a tick [s]."""
RISING = np.outer(np.arange(1.0, 41.0), [1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
"""What is asked for grows by a newton a tick."""


def in_time(robot: Layout, target: Array, reference: Array) -> Array:
    """The wrench (6,) that a robot whose drives lag is asked for, so that it gives `target` in
    time."""
    return Allocator(robot)._whole.method.in_time(target, reference)


def with_pole(pole: float) -> Layout:
    """Robot A, one of whose fins follows its direction with a pole [1/s]."""
    robot = load_layout("A")
    slow = replace(robot.fins[0], servo=Servo(direction_pole=pole))
    return replace(robot, actuators=(slow, *robot.fins[1:]))


@pytest.mark.parametrize("pole", [1.0, 2.0, 3.5])
def test_it_is_the_one_that_the_slowest_fin_is_in_time_for(pole: float) -> None:
    """A filter that follows a ramp lags by what is looked ahead: what it gives is then what is
    asked for."""
    asked = in_time(with_pole(pole), np.zeros(6), RISING)[0]
    lag = LagStep.of(np.array([pole]), PERIOD_S)
    value = np.zeros(1)
    rate = np.zeros(1)
    for tick in range(200):
        target = tick + asked
        error = value - target
        value = target + lag.error_by_error * error + lag.error_by_rate * rate
        rate = lag.rate_by_error * error + lag.rate_by_rate * rate
    # Between the ends of the last period, in the middle of the steps that the command takes.
    assert 200.0 - 1.0 < value[0] < 200.0


def test_after_the_last_wrench_comes_the_last() -> None:
    robot = with_pole(3.5)
    np.testing.assert_array_equal(in_time(robot, np.zeros(6), RISING[:2]), RISING[1])
    np.testing.assert_array_equal(in_time(robot, np.ones(6), RISING[:0]), np.ones(6))


def test_the_default_method_answers_it_and_others_answer_the_present() -> None:
    robot = load_layout("A")
    now = np.array([1.0, 0, 0.5, 0, 0, 0])
    later = [[3.0, 0, 0, 0, 0, 0]] * 9
    for name, answered in (("dual", later[0]), ("analytic", now)):
        result = load_method_spec(name).on(robot).allocate(now, reference=later)
        np.testing.assert_array_equal(result.target, answered)
        np.testing.assert_allclose(result.wrench, answered, atol=1e-3)
    slower = Allocator(robot, period_s=0.4).allocate(now, reference=[[2.0, 0, 0, 0, 0, 0], *later])
    assert 2.0 < slower.target[0] < 3.0, "by then hardly two ticks have gone by"


def test_what_cannot_be_expected_is_named() -> None:
    with pytest.raises(CommandError, match=r"^reference: expected an array of shape \(N, 6\)"):
        Allocator(load_layout("A")).allocate(np.zeros(6), reference=np.zeros(6))
